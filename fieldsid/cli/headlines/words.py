"""Words that several headlines share: counts, the error over the noise, lists cut short, the step after a model."""

from __future__ import annotations

from collections.abc import Sequence

from fieldsid.cli.headlines.typed import pasted

USE = {"yaw": ("turn-radius",), "pitch": ("schedule", "design")}
"""What a model is for once it leaves no more than the noise."""
MOST_NAMED = 3


def named(names: Sequence[str]) -> str:
    """Return the first few names, and how many more there are."""
    more = len(names) - MOST_NAMED
    return ", ".join(names[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


def used(axis: str, model: str) -> str:
    """Return the command that a model is for once it leaves no more than the noise."""
    return pasted(*USE[axis], model, *(("-o", "gains.yaml") if axis == "pitch" else ()))
