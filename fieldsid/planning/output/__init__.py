"""What is written of a plan: the file, commands, missions, figure data."""
