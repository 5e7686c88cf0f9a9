"""The report of a diagnosis: sentences, the model for the file, the next maneuver."""
