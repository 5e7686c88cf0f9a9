"""How work is run: forked workers, background tasks, and the count of evaluations."""
