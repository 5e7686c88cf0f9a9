"""The search over sets of effects."""
