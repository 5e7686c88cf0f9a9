"""The safety envelope, and the probability of leaving it by Monte Carlo simulation."""
