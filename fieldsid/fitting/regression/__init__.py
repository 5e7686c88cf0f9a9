"""Regression on the filtered equation of motion, block and recursive."""
