"""The noise model: its Kalman filter, likelihood, Fisher scoring, and robust covariance."""
