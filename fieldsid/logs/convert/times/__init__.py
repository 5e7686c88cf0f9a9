"""Convert the times of a table to seconds that increase throughout."""
