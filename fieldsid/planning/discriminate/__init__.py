"""Maneuvers that tell rival models apart."""
