"""How work is run: the pool of worker processes and the count of evaluations."""
