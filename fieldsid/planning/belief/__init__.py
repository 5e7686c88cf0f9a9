"""What is believed before the dive: a model with its covariance."""
