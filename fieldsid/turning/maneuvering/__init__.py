"""A vehicle in surge, sway and yaw, fitted to all runs at once, and the turns that its posterior believes in."""
