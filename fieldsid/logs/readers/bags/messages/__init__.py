"""Decode the messages of bags: their definitions, and the numbers of their fields."""
