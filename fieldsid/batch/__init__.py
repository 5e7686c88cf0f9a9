"""An archive of logs: each is read, identified and diagnosed separately, one row per run; locally or on a cluster, resumable."""
