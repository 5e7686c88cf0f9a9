"""Accuracy goals and quantities as a user types them."""
