"""The first lines of every result, made from its record: the verdict, what it rests on, and the next command."""
