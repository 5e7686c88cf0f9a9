"""Simulated flights: operating point, closed loop, maneuvers by rule."""
