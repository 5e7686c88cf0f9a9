"""Read the container formats of bags: records with topic and stamp, skipping damaged places."""
