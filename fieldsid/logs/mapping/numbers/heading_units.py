"""The unit of a heading that nothing states: from the jump where it wraps, which is one turn; else its size, and what is open."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fieldsid.logs.channels import POSITION
from fieldsid.logs.convert.units import UNITS
from fieldsid.logs.run import Note
from fieldsid.numerics.arrays import FloatArray

WRAPPING = ("deg", "gon", "ddeg", "cdeg")
"""Units in which headings are logged from nil to a turn, besides radians."""
OF_A_TURN = 0.9
"""Share of a turn by which a heading jumps at least where it wraps: a vehicle does not turn by a tenth between two samples."""
TO_A_TURN = 1.01
"""Turns that a heading which wraps spans at most: one, and what its last digit is rounded up by."""
OFTEN = 0.05
"""Share of the samples that must be beyond a turn in degrees: fewer may be damage."""
MOST_TURNS = 10.0
"""Turns that a heading of a log of maneuvers may count on."""


def unit_of_wraps(values: FloatArray) -> str:
    """Return the unit of a heading (n,) whose numbers are too large for radians: degrees unless its wraps say otherwise."""
    seen = values[np.isfinite(values)]
    if float((np.abs(seen) > 360.0).mean()) < OFTEN:
        return "deg"
    jump, span = float(np.abs(np.diff(seen)).max(initial=0.0)), float(np.ptp(seen))
    turns = {unit: 2.0 * np.pi / UNITS[unit].factor for unit in WRAPPING}
    return next((u for u, turn in turns.items() if OF_A_TURN * turn <= jump <= span <= TO_A_TURN * turn), "deg")


def wraps_in_rad(values: FloatArray) -> bool:
    """Whether a heading (n,) or (n, 4) jumps by nearly a turn in rad where it wraps."""
    seen = values[np.isfinite(values)] if values.ndim == 1 else values[:0, 0]
    jump, span = float(np.abs(np.diff(seen)).max(initial=0.0)), float(np.ptp(seen)) if seen.size else 0.0
    return 2.0 * np.pi * OF_A_TURN <= jump <= span <= 2.0 * np.pi * TO_A_TURN


def heading_in_doubt(values: FloatArray, signals: Mapping[str, Any]) -> list[Note]:
    """Say of a heading (n,) taken for degrees by its size what else it may be, where no rate and no position tells."""
    unit = signals["yaw_rad"].get("unit")
    if {"yaw_rate_rad_s", "x_m", POSITION} & signals.keys():
        return []
    if unit != "deg":
        message = f"yaw_rad wraps by nearly {2.0 * np.pi / UNITS[unit].factor:.0f}, one turn in {unit}"
        return [Note("evidence", message, {"signal": "yaw_rad", "unit": unit})]
    seen = values[np.isfinite(values)]
    largest = float(np.abs(seen).max())
    in_degrees, in_radians = largest / 360.0, largest / (2.0 * np.pi)
    data = {"signal": "yaw_rad", "largest": largest}
    if in_degrees > MOST_TURNS and float((np.abs(seen) > 360.0 * MOST_TURNS).mean()) >= OFTEN:
        said = (
            f"yaw_rad is taken for degrees and reaches {largest:.5g}, {in_degrees:.0f} turns (limit {MOST_TURNS:.0f}): is it in "
        )
        return [Note("unit", f"{said}another unit, as `unit: cdeg` or `unit: ddeg`?", data)]
    if in_radians <= MOST_TURNS:
        said = f"yaw_rad is taken for degrees because it reaches {largest:.3g}; in radians that would be {in_radians:.1f} turns"
        return [Note("unit", f"{said}, and nothing in the log says which: set `unit: rad` if it counts turns", data)]
    return []
