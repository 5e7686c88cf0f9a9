"""What a search does to a model: each move adds, drops or changes one thing, and is fitted and scored on the same grounds."""
