"""The circle in a measured run."""
