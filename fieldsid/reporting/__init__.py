"""The report of a trial: one HTML file without external resources, with interactive figures; and its PDF."""
