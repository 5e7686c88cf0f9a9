"""The free run of a model on a record, and how well it follows."""
