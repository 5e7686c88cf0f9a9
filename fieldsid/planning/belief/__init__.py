"""The prior before a dive: a model with its covariance."""
