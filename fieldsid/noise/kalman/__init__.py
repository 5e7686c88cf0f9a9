"""The compiled Kalman filters, one for each structure of the noise."""
