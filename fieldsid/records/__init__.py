"""Records read back: the loader of YAML and JSON with its limits, what each kind of record must hold, the files it names."""
