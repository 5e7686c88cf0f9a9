"""What a command that goes on shows meanwhile."""
