"""Minimising the whitened sum of squares."""
