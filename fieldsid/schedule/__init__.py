"""Gains per speed: designed, verified, flown."""
