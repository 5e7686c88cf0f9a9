"""Numerical methods that know nothing of vehicles: each a function of arrays, with its source."""
