"""The output of a plan: its file, commands, missions and figure data."""
