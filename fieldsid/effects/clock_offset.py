"""The sensors' clock is off against the command's: measured(t) = motion(t - offset), offset of either sign in s.

Positive: the sensors are logged late. The motion is interpolated linearly between samples and constant beyond the ends of the
run. Unlike a delay it shifts the response to all inputs, not only to the fin, and it can be negative. In its variant the clock
runs fast or slow as well: the offset changes by clock_drift s a second and is `offset` in the middle of the run.
Source: Ljung 1999, System Identification, chapter 14 (preprocessing of data).
"""

from __future__ import annotations

import numpy as np

from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Motion, Stage, Values, Variant
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit


def _then(values: Values, record: Record) -> FloatArray:
    """Return the times (n,) s at which the hull was what the samples show."""
    time = record.time
    return np.asarray(time - values["offset"] - values.get("clock_drift", 0.0) * (time - 0.5 * (time[0] + time[-1])))


def measure(motion: Motion, values: Values, record: Record) -> Motion:
    """Return the motion `offset` seconds later; angle (n,) rad, rate (n,) rad/s."""
    angle, rate = _late(np.stack([motion.angle, motion.rate])[None], values, record)[0]
    return Motion(angle, rate)


def sensor_jvp(moves: FloatArray, motion: Motion, values: Values, record: Record) -> FloatArray:
    """Return small changes of the motion (P, 2, n) as they are logged, `offset` seconds later."""
    return _late(moves, values, record)


def _late(series: FloatArray, values: Values, record: Record) -> FloatArray:
    """Return series (P, 2, n) as they are logged."""
    out = np.empty_like(series)
    interpolate(record.time, _then(values, record), np.ascontiguousarray(series), out)
    return out


@jit
def interpolate(time: FloatArray, then: FloatArray, series: FloatArray, out: FloatArray) -> None:
    """Fill out (P, 2, n) with series (P, 2, n) at the times `then` (n,), rising like `time` (n,); constant beyond both ends."""
    n, before = time.shape[0], 0
    for i in range(n):
        at = min(max(then[i], time[0]), time[n - 1])
        while before < n - 2 and time[before + 1] <= at:
            before += 1
        after = min(before + 1, n - 1)
        share = (at - time[before]) / (time[after] - time[before]) if after > before else 0.0
        for j in range(series.shape[0]):
            for ch in range(2):
                out[j, ch, i] = series[j, ch, before] * (1.0 - share) + series[j, ch, after] * share


EFFECT = Effect(
    name="clock_offset",
    says="the sensors' clock is off against the command's, early or late",
    stage=Stage.SENSOR,
    axes=(Axis.YAW, Axis.PITCH),
    equation="measured(t) = motion(t - offset)",
    coefficients=(
        Coefficient(
            "offset", "s", -1.5, 1.5, 0.05, scan=(-0.6, -0.25, -0.08, 0.08, 0.25, 0.6), step=2e-3, says="lateness of the sensors"
        ),
    ),
    telltale="the residual is the rate of change of the signal itself; where it is early no delay can explain it",
    excited_by=("square_pulses", "doublet", "three_two_one_one", "prbs"),
    mistaken_for=("delay", "servo_lag", "rate_limit"),
    source="Ljung 1999, System Identification, chapter 14",
    measure=measure,
    sensor_jvp=sensor_jvp,
    variants=(
        Variant(
            "the clock runs fast or slow",
            (Coefficient("clock_drift", "1", -0.05, 0.05, 0.0, step=1e-4, says="what the sensors fall behind in a second"),),
        ),
    ),
    log_prior_penalty=15.0,
)
