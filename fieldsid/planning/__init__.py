"""Planning: maneuvers within the safety envelope that reach the accuracy goals, or that discriminate rival models."""
