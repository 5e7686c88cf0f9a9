"""What each command comes to: one record per command, whose keys are those of its JSON object."""
