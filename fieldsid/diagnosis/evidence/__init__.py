"""The comparison of models: likelihood, predictive density, complexity penalty, acceptance rules."""
