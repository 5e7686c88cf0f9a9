"""Maneuvers that discriminate rival models."""
