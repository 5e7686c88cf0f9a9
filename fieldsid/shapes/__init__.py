"""What each kind of record must hold: a file for each, and what looks a record through by it."""
