"""The circle a run really turned."""
