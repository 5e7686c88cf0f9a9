"""Initial values: without simulation, by screening effects, by forward build-up."""
