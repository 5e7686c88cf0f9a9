"""The folder of one trial: what it holds, what was made from what, what is stale, and the journal of the commands run in it."""
