"""Execution of work: forked workers, background tasks, and the count of evaluations."""
