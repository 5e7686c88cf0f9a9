"""The steady turn of a model: speed lost, drift, transient, and models blended over speed."""
