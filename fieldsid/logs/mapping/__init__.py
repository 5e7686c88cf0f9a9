"""Which column or topic is which signal: names, their meaning, and the mapping file."""
