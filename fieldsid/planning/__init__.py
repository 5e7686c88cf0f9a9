"""Planning: which maneuver buys the accuracy that is wanted inside the envelope, and which one tells rivals apart."""
