"""The optimal maneuver: Fisher information, objective, search, legs, plan."""
