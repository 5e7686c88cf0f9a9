"""The fin follows its command as a first-order lag: lag d(delta)/dt = command - delta, lag >= 0 in s.

The response to a straight-line command is exact, and so is its mean over the interval; the servo starts at rest on
the command. Source: Van Amerongen 1982 (the steering machine, linear part).
"""

from __future__ import annotations

import numpy as np

from fieldsid.logs.run import FloatArray
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.effect import Coefficient, Effect, FinPath, Stage, Values
from fieldsid.models.jit import jit
from fieldsid.models.record import Record

FASTEST_S = 1e-6
"""A lag below this moves nothing that can be measured; the command is returned as it is."""


@jit
def lagged(steps: FloatArray, start: FloatArray, end: FloatArray, lag: float, out: FloatArray) -> None:
    """Fill out (n-1, 2) with start and end of the lagged path: fin = line - lag slope + c exp(-t / lag)."""
    fin = start[0]
    for i in range(start.shape[0]):
        h = steps[i]
        x = h / lag
        slope = (end[i] - start[i]) / h
        c = fin - start[i] + slope * lag
        gone = -np.expm1(-x)
        mean = start[i] + slope * (0.5 * h - lag) + c * gone / x
        if x < 1e-2:
            # First moment of the exponential about the middle, as a series: the closed form cancels.
            bend = -x * (1.0 - 0.5 * x + 0.15 * x * x)
        else:
            bend = 12.0 / (x * x) * (1.0 - (1.0 - gone) * (1.0 + x) - 0.5 * x * gone)
        half = 0.5 * (slope * h + c * bend)
        out[i, 0], out[i, 1] = mean - half, mean + half
        fin = start[i] + slope * (h - lag) + c * (1.0 - gone)


def fin(path: FinPath, values: Values, record: Record) -> FinPath:
    """Return the path of a fin behind a first-order servo, (n-1,) rad."""
    if values["lag"] <= FASTEST_S:
        return path
    out = np.empty((path.start.size, 2))
    lagged(record.steps, path.start, path.end, float(values["lag"]), out)
    return FinPath(out[:, 0].copy(), out[:, 1].copy())


def twin(values: Values, axis: Axis) -> dict[str, float] | None:
    """Return the start with the servo's pole and the hull's exchanged: in yaw the same response at one speed."""
    damping, lag = values[NAMES[axis].damping], values["lag"]
    if axis is not Axis.YAW or damping <= 0.0 or lag <= FASTEST_S:
        return None
    return {
        NAMES[axis].damping: 1.0 / lag,
        "lag": 1.0 / damping,
        NAMES[axis].authority: values[NAMES[axis].authority] / (lag * damping),
    }


EFFECT = Effect(
    name="servo_lag",
    says="the fin follows its command with a first-order lag",
    stage=Stage.ACTUATOR,
    axes=(Axis.YAW, Axis.PITCH),
    equation="lag * d(delta)/dt = command - delta",
    coefficients=(Coefficient("lag", "s", 0.0, 2.0, 0.15, scan=(0.08, 0.25, 0.7), step=1e-3, says="time constant of the servo"),),
    telltale="after every command step the residual rises at once and decays over a few lags; the onset is rounded",
    excited_by=("square_pulses", "doublet", "three_two_one_one", "prbs", "chirp"),
    mistaken_for=("delay", "rate_limit", "clock_offset", "sway_coupling", "heave_coupling"),
    source="Van Amerongen 1982, Adaptive Steering of Ships (steering machine)",
    order=30,
    fin=fin,
    twin=twin,
)
