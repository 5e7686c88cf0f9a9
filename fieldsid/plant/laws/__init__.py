"""Laws of the parameters over speed."""
