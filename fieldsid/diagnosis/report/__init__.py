"""What a diagnosis says: sentences, the model for the file, the next maneuver."""
