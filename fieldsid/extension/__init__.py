"""Extension of a model by a physical effect, kept only where it improves the prediction, and the ancestry of a model."""
