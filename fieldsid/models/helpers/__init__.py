"""Helper signals and laws that are estimated from measured speeds: the smoothed surge and the drift law."""
