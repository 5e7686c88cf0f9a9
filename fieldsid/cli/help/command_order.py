"""The order of an engineer's day, for the page of help; a command that is not named here is listed at its end."""

from __future__ import annotations

COMMAND_ORDER: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("Before the dive", ("init", "plan")),
    ("The trial so far", ("status", "report")),
    ("During the dive", ("live",)),
    ("From log to run", ("inspect", "import")),
    ("From run to model", ("identify", "compare", "simulate")),
    ("The missing effect", ("diagnose", "extend", "history", "effects")),
    ("Turning and gains", ("fit", "turn-radius", "schedule")),
    ("The archive", ("batch",)),
    ("Tour and manual", ("demo", "guide")),
)
"""Headings and, under each, the names of its commands."""
