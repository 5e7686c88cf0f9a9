"""The safety envelope, and a Monte Carlo ensemble flown inside it."""
