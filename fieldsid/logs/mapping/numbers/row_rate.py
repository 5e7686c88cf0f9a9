"""How many rows a second a table without a clock has, where it tells it itself: the heading changes by its rate and the time."""

from __future__ import annotations

import math

from fieldsid.logs.doctor.angle_and_rate import TRUSTED, changes_of
from fieldsid.logs.run import Note, Run
from fieldsid.numerics.shifted_correlation import slope_of

ASSUMED_HZ = 10.0
USUAL_HZ = (1.0, 2.0, 4.0, 5.0, 8.0, 10.0, 16.0, 20.0, 25.0, 30.0, 32.0, 40.0, 50.0, 60.0, 64.0, 100.0, 128.0, 200.0, 250.0)
NEAR = 0.02
"""By how much of itself a rate may be off one that loggers have, and is that."""
SLOWEST_HZ, FASTEST_HZ = 0.5, 400.0
"""Rates at which vehicles log."""


def rate_by_turning(run: Run, *, has_unit: bool) -> tuple[float, str, Note] | None:
    """Return the rows a second of a run that was read with `ASSUMED_HZ`, the unit of its yaw rate, and why; None where open.

    `has_unit` says that the yaw rate's unit is known; else it is that in which a vehicle would log so fast.
    """
    changes = changes_of(run, "yaw_rad", "yaw_rate_rad_s")
    slope, trust = slope_of(*changes[:2]) if changes is not None else (0.0, 0.0)
    if trust < TRUSTED or slope <= 0.0:
        return None
    units = {"rad/s": 1.0} if has_unit else {"rad/s": 1.0, "deg/s": 180.0 / math.pi}
    rates = {unit: ASSUMED_HZ / (slope * factor) for unit, factor in units.items()}
    likely = [unit for unit, rate in rates.items() if SLOWEST_HZ < rate < FASTEST_HZ]
    if len(likely) != 1:
        return None
    rate = rates[likely[0]]
    message = (
        f"no column is a time: heading and yaw rate (in {likely[0]}) agree at {rate:.3g} rows a second, correlation {trust:.2f}; "
        "set the rate that the logger has"
    )
    usual = min(USUAL_HZ, key=lambda known: abs(known - rate))
    return (
        usual if abs(usual / rate - 1.0) < NEAR else float(f"{rate:.3g}"),
        likely[0],
        Note("rate_guessed", message, {"value": rate, "signal": "yaw_rate_rad_s"}),
    )
