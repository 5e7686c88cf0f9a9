"""How models are compared: likelihood, predictive density, complexity penalty, acceptance rules."""
