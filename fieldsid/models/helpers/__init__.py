"""Measured helper signals (surge, depth, cross-flow speed) without their noise."""
