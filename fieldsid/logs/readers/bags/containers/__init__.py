"""The container formats of bags: records with their topic and stamp, and damage read around."""
