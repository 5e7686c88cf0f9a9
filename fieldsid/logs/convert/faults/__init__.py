"""Find numbers of a log that are no measurements: spikes, repeats, and fill values of a sensor without a reading."""
