"""A vehicle in surge, sway and yaw fitted to all runs at once, and the turns of its posterior distribution."""
