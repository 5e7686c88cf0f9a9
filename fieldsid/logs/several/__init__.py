"""Many logs at once: names that tell them apart, and those that cannot be read."""
