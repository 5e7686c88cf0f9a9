"""Inference from the numbers of a log: the signal in a column, its unit, and the direction from which an angle is counted."""
