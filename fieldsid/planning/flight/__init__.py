"""Simulated flights: operating point, closed loop, maneuvers that are a rule."""
