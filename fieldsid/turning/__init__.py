"""Turning radius from models at a few speeds or from all runs together, and measured circles."""
