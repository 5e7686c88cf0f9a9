"""The free run of a model on a record, and its goodness of fit."""
