"""Gains sought at one speed and for all speeds at once: formulas with two free numbers, one objective, what binds them."""
