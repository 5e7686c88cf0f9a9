"""The import doctor: what in a log would spoil an identification."""
