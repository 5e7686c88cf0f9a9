"""Dead time between the command and the fin: delta(t) = command(t - delay), delay >= 0 in s.

Before the record starts the command is assumed to have had its first value. An apparent delay below zero is an offset of a
clock (`clock_offset`) or comes from feedback. Source: Ljung 1999, chapter 4.
"""

from __future__ import annotations

import numpy as np

from fieldsid.effects._paths import through
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Values
from fieldsid.models.fin_path import FinPath
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit


@jit
def delayed(time: FloatArray, start: FloatArray, end: FloatArray, delay: float, out: FloatArray) -> None:
    """Fill out (n-1, 4) with lines and ends of the delayed path, of exact mean and first moment; time (n,) s, delay in s."""
    n = start.shape[0]
    source = 0
    for i in range(n):
        low, high = time[i] - delay, time[i + 1] - delay
        h, centre = high - low, 0.5 * (high + low)
        area = moment = 0.0
        first = last = start[0]
        seen = low < time[0]
        if seen:
            piece = min(high, time[0]) - low
            area += start[0] * piece
            moment += start[0] * piece * (low + 0.5 * piece - centre)
        while source < n - 1 and time[source + 1] <= low:
            source += 1
        j = source
        while j < n and time[j] < high:
            a, b = max(low, time[j]), min(high, time[j + 1])
            slope = (end[j] - start[j]) / (time[j + 1] - time[j])
            piece = max(b - a, 0.0)
            middle = 0.5 * (a + b)
            value = start[j] + slope * (middle - time[j])
            area += value * piece
            moment += value * piece * (middle - centre) + slope * piece * piece * piece / 12.0
            if not seen:
                first, seen = start[j] + slope * (a - time[j]), True
            last = start[j] + slope * (b - time[j])
            j += 1
        mean, half = area / h, 6.0 * moment / (h * h)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = mean - half, mean + half, first, last


def fin(path: FinPath, values: Values, record: Record) -> FinPath:
    """Return the path `delay` seconds later, (n-1,) rad."""
    if values["delay"] <= 0.0:
        return path
    delay = float(values["delay"])

    def late(steps: FloatArray, start: FloatArray, end: FloatArray, out: FloatArray) -> None:
        time = record.time - record.time[0] if steps is record.steps else np.concatenate([[0.0], np.cumsum(steps)])
        delayed(time, start, end, delay, out)

    return through(path, record.steps, late)


EFFECT = Effect(
    name="delay",
    says="the fin answers the command only after a dead time",
    stage=Stage.ACTUATOR,
    axes=(Axis.YAW, Axis.PITCH),
    equation="delta(t) = command(t - delay)",
    coefficients=(
        Coefficient("delay", "s", 0.0, 1.5, 0.1, scan=(0.05, 0.15, 0.3, 0.6), step=2e-3, says="dead time from command to fin"),
    ),
    telltale="after every command step the residual jumps at once by the full response and dies out a dead time later",
    excited_by=("square_pulses", "doublet", "three_two_one_one", "prbs"),
    mistaken_for=("servo_lag", "clock_offset", "rate_limit", "sway_coupling", "heave_coupling"),
    source="Ljung 1999, System Identification, chapter 4",
    order=10,
    fin=fin,
)
