"""A model with one physical effect more, kept only where that pays, and the line of models it comes from."""
