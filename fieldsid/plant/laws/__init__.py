"""Laws of the parameters against speed."""
