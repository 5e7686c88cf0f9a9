"""The search for gains at one speed and for all speeds: formulas with two free numbers, and one objective."""
