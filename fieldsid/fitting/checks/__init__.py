"""Checks of records, of runs and of estimates, each a note with a number and a limit."""
