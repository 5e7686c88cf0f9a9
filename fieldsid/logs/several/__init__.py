"""Several logs at once: distinct names of runs, logs that cannot be used, and stretches under way."""
