"""What a command run in a trial folder takes from it, and the line it writes into its journal."""
