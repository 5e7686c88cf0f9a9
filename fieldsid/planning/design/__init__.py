"""The optimal experiment: Fisher information, objective, search, legs, plan."""
