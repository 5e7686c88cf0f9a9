"""The page of help and the manual on a terminal."""
