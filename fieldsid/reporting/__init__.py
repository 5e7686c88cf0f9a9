"""The report of a trial: one HTML file that needs no network, with figures that can be zoomed and read off, and its PDF."""
