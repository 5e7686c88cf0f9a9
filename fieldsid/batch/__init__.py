"""An archive of logs: each read, identified and diagnosed by itself, one row per run; here or on a cluster, and resumed."""
