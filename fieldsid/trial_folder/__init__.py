"""The folder of one trial: its files, their inputs, which of them are stale, and the journal of the commands run in it."""
