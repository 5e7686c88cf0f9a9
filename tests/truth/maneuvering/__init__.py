"""Hulls of many kinds in surge, sway and yaw: the ensemble that turns are checked on."""
