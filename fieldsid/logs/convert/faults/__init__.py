"""Numbers of a log that are no measurements: spikes, and what a logger writes where a sensor has nothing."""
