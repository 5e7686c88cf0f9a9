"""The first lines of every result: what it comes to, what it rests on, and what comes next, from the record of it."""
