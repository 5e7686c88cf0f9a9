"""Numbers of time that start again: with each minute, hour, day or week, or where a counter of 16 or 32 bits is full.

What has passed between the last number and the first of the next round is a step of the log like its others, which tells such
a round from a clock that was set back: of two logs in one file the second starts anywhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.logs.convert.times.clock_text import DAY_S, HOUR_S, MINUTE_S, WEEK_S, going_on
from fieldsid.logs.run import Note
from fieldsid.numerics.arrays import FloatArray

FEW_STEPS = 5.0
"""Steps of a log that may be missing where its time starts again."""
ROUNDS_S = {"minute": MINUTE_S, "hour": HOUR_S, "day": DAY_S, "week": WEEK_S}
COUNTERS = {"16 bits": 2.0**16, "32 bits": 2.0**32}
"""Numbers after which a counter starts again, whatever its unit."""


@dataclass(frozen=True, slots=True)
class Round:
    """What a time starts again with, in words, and after which number."""

    words: str
    period: float


def round_of(values: npt.NDArray[Any], factor: float) -> Round | None:
    """Return the shortest round in which numbers (n,) of time start again, `factor` s each; None where they do not.

    At most of the places where they fall back, the next round must go on with a step like the log's others.
    """
    steps = np.diff(values.astype(np.float64))
    ahead = steps[steps > 0.0]
    if not ahead.size or not bool((steps < 0.0).any()):
        return None
    usual, span = float(np.median(ahead)), float(np.ptp(values.astype(np.float64)))
    rounds = [Round(f"each {name}", s / factor) for name, s in ROUNDS_S.items()]
    for found in [*rounds, *(Round(f"after {bits}", size) for bits, size in COUNTERS.items())]:
        falls = steps[steps < -0.5 * found.period] + found.period
        if span <= found.period and falls.size and float((falls <= FEW_STEPS * usual).mean()) > 0.5:
            return found
    return None


def gone_on(values: FloatArray, found: Round, name: str) -> tuple[FloatArray, Note]:
    """Return numbers (n,) of time that do not start again, and the note that says how often they did."""
    whole, times = going_on(values, found.period)
    message = f"`{name}` starts again {found.words}, {times} time{'s' * (times != 1)}: taken for one time that goes on"
    return whole, Note("starts_again", message, {"count": times, "period": found.period})
