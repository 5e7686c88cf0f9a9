"""The inputs of a diagnosis: the hold-out, the applicable effects, and the noise floor."""
