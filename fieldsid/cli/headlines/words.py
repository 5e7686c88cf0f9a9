"""Words that several headlines share: shortened lists of names, and the command that uses a finished model."""

from __future__ import annotations

from collections.abc import Sequence

from fieldsid.cli.headlines.typed import pasted

USES = {"yaw": ("turn-radius",), "pitch": ("schedule", "design")}
"""The command that uses a model of each axis once its error is no more than the noise."""
MOST_NAMED = 3


def first_names(names: Sequence[str]) -> str:
    """Return the first few names, and how many more there are."""
    more = len(names) - MOST_NAMED
    return ", ".join(names[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


def next_use(axis: str, model: str) -> str:
    """Return the command that uses a model, once its error is no more than the noise: a turning radius in yaw, gains in pitch."""
    return pasted(*USES[axis], model, *(("-o", "gains.yaml") if axis == "pitch" else ()))
