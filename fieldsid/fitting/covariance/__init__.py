"""Standard errors: the noise by restricted likelihood, small-sample corrections."""
