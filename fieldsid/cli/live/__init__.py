"""The parts of `sysid live`: its source of samples, its display, and its analysis in other processes."""
