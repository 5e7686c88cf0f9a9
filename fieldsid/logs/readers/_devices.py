"""A table whose rows are in turn several devices': one for each servo, with its number beside the value."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.logs.mapping.name_words import words_of
from fieldsid.logs.readers._columns import Columns

CALLED = frozenset({"id", "device", "instance", "servo", "channel", "fin", "motor", "actuator", "thruster", "number", "no", "nr"})
"""Words of a column that tells the device."""
MOST_DEVICES = 32
IN_TURN = 0.5
"""Share of the rows that are another device's than the one before."""


def devices_of(columns: Columns) -> dict[str, Columns]:
    """Return the rows of each device under its number or word in brackets, as `[3]`; the table itself under nothing elsewhere."""
    for i, name in enumerate(columns.names):
        words = set(words_of(name))
        if not words or not words <= CALLED:
            continue
        cells = columns.take(i)
        told = _told(cells)
        if told:
            rest = replace(columns, names=tuple(n if k != i else "" for k, n in enumerate(columns.names)))
            return {f"[{label}]": rest.rows(rows) for label, rows in told.items()}
    return {"": columns}


def _told(cells: npt.NDArray[Any]) -> dict[str, npt.NDArray[np.bool_]]:
    """Return the rows (n,) of each device that cells (n,) tell; none where they tell no devices."""
    if cells.size < 2 or float(np.mean(cells[1:] != cells[:-1])) < IN_TURN:
        return {}
    if cells.dtype.kind == "f" and not bool((cells == np.round(cells)).all()):
        return {}
    known = sorted(set(cells.tolist()), key=str) if cells.dtype.kind in "iufO" else []
    if not 1 < len(known) <= MOST_DEVICES:
        return {}
    return {(f"{k:.0f}" if isinstance(k, (int, float)) else str(k).strip()): cells == k for k in known}
