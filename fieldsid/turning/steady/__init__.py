"""The steady turn of a model: loss of speed, drift, transient, and interpolation of models over speed."""
