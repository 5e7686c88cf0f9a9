"""The fin follows its command as a first-order lag: lag d(delta)/dt = command - delta, lag >= 0 in s.

The response to a straight-line command is exact, and so is its mean over the interval; the servo starts at rest on
the command. In its form of second order the servo has inertia: inertia_share lag^2 d2(delta)/dt2 is added on the left, which
is damped by 1 / (2 sqrt(inertia_share)). In another it follows
with lag_ratio times the lag while it falls. Source: Van Amerongen 1982 (the steering machine, linear part).
"""

from __future__ import annotations

import numpy as np

from fieldsid.effects._paths import through
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Values, Variant
from fieldsid.models.fin_path import FinPath
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit

FASTEST_S = 1e-6
"""A lag below this moves nothing that can be measured; the command is returned as it is."""
EQUAL_STEP_SHARE = 1e-12
"""Steps that differ by less, of themselves, decay alike: the exponential of the last one is taken."""


@jit
def lagged(steps: FloatArray, start: FloatArray, end: FloatArray, rising: float, falling: float, out: FloatArray) -> None:
    """Fill out (n-1, 4) with line and ends of the lagged path: fin = line - lag slope + c exp(-t / lag).

    The lag is that of the side the fin moves to at the start of an interval; a held command lets it turn nowhere else.
    """
    fin = start[0]
    x, gone, bend = 0.0, 0.0, 0.0
    for i in range(start.shape[0]):
        h = steps[i]
        lag = rising if start[i] >= fin else falling
        slope = (end[i] - start[i]) / h
        c = fin - start[i] + slope * lag
        if abs(h / lag - x) > EQUAL_STEP_SHARE * x:
            x = h / lag
            gone = -np.expm1(-x)
            if x < 1e-2:
                # First moment of the exponential about the middle, as a series: the closed form cancels.
                bend = -x * (1.0 - 0.5 * x + 0.15 * x * x)
            else:
                bend = 12.0 / (x * x) * (1.0 - (1.0 - gone) * (1.0 + x) - 0.5 * x * gone)
        mean = start[i] + slope * (0.5 * h - lag) + c * gone / x
        half = 0.5 * (slope * h + c * bend)
        last = start[i] + slope * (h - lag) + c * (1.0 - gone)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = mean - half, mean + half, fin, last
        fin = last


@jit
def swung(steps: FloatArray, start: FloatArray, end: FloatArray, lag: float, inertia: float, out: FloatArray) -> None:
    """Fill out (n-1, 4) as `lagged` does for inertia delta'' + lag delta' + delta = command, inertia in s^2.

    e, the fin less the line it follows, has no command: its integrals follow from its own equation, its end from the
    exponential of that.
    """
    fin, speed = start[0], 0.0
    decay = -0.5 * lag / inertia
    squared = decay * decay - 1.0 / inertia
    for i in range(start.shape[0]):
        h = steps[i]
        slope = (end[i] - start[i]) / h
        first, first_speed = fin - start[i] + slope * lag, speed - slope
        root = np.sqrt(abs(squared))
        if root * h < 1e-6:
            even, odd = np.exp(decay * h), h * np.exp(decay * h)
        elif squared < 0.0:
            even, odd = np.exp(decay * h) * np.cos(root * h), np.exp(decay * h) * np.sin(root * h) / root
        else:
            slow, fast = np.exp((decay + root) * h), np.exp((decay - root) * h)
            even, odd = 0.5 * (slow + fast), 0.5 * (slow - fast) / root
        e = even * first + odd * (first_speed - decay * first)
        v = even * first_speed + odd * (decay * first_speed - first / inertia)
        area = -inertia * (v - first_speed) - lag * (e - first)
        moment = -inertia * (h * v - e + first) - lag * h * e + lag * area - 0.5 * h * area
        mean = start[i] + slope * (0.5 * h - lag) + area / h
        half = 0.5 * slope * h + 6.0 * moment / (h * h)
        last = start[i] + slope * (h - lag) + e
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = mean - half, mean + half, fin, last
        fin, speed = last, v + slope


def fin(path: FinPath, values: Values, record: Record) -> FinPath:
    """Return the path of a fin behind a servo of first order, or of second order where its inertia is given, (n-1,) rad."""
    lag = float(values["lag"])
    if lag <= FASTEST_S:
        return path
    if "inertia_share" in values:
        inertia = float(values["inertia_share"]) * lag * lag
        return through(path, record.steps, lambda steps, start, end, out: swung(steps, start, end, lag, inertia, out))
    falling = lag * float(values.get("lag_ratio", 1.0))
    return through(path, record.steps, lambda steps, start, end, out: lagged(steps, start, end, lag, falling, out))


def equivalent_solution(values: Values, axis: Axis) -> dict[str, float] | None:
    """Return the start with the servo's slow pole and the hull's fast one exchanged: in yaw the same response at one speed.

    With inertia the servo's two time constants T1 >= T2 have the sum `lag` and the product inertia_share lag^2; they are real
    where inertia_share is 1/4 at most. A hull that drifts has two poles, of s^2 + (a22 + c) s + a22 c + c_r with the cross
    state's damping c and rate c_r, and keeps its zero -c: the slow pole stays, the fast one is exchanged; complex ones are not.
    A hull that the cross flow along it holds has no poles of its own.
    """
    names, lag = NAMES[axis], values["lag"]
    apart = 1.0 - 4.0 * values.get("inertia_share", 0.0)
    poles = _hull_poles(values[names.damping], values)
    if axis is not Axis.YAW or poles is None or lag <= FASTEST_S or apart < 0.0:
        return None
    slow, fast = (0.5 * lag * (1.0 + sign * np.sqrt(apart)) for sign in (1.0, -1.0))
    pole, kept = poles
    moved = 1.0 / pole + fast
    exchanged = {
        names.damping: 1.0 / slow,
        "lag": moved,
        names.authority: values[names.authority] / (slow * pole),
    }
    if kept is not None:
        zero = values["cross_damping"]
        exchanged[names.damping] += kept - zero
        exchanged["cross_rate"] = kept / slow - exchanged[names.damping] * zero
    return exchanged | {"inertia_share": fast / pole / moved**2} if "inertia_share" in values else exchanged


def _hull_poles(damping: float, values: Values) -> tuple[float, float | None] | None:
    """Return a hull's fast pole and, where it drifts, its slow one, in 1/s; None where they are complex or the fast one grows."""
    if "cross_damping" not in values:
        return (damping, None) if damping > 0.0 else None
    if "strip_drag" in values:
        return None
    middle = 0.5 * (damping + values["cross_damping"])
    squared = middle**2 - damping * values["cross_damping"] - values["cross_rate"]
    if squared < 0.0 or middle + np.sqrt(squared) <= 0.0:
        return None
    return middle + float(np.sqrt(squared)), middle - float(np.sqrt(squared))


LAG_RATIO = Coefficient(
    "lag_ratio", "1", 0.1, 10.0, 1.0, scan=(0.6, 1.6), step=1e-3, says="lag to the negative side over that to the other"
)

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
    equivalent_solution=equivalent_solution,
    variants=(
        Variant(
            "a servo with inertia, of second order",
            (
                Coefficient(
                    "inertia_share", "1", 0.02, 4.0, 0.5, scan=(0.25, 0.8), step=1e-3, says="inertia over the square of the lag"
                ),
            ),
        ),
        Variant("it follows faster to one side than to the other", (LAG_RATIO,)),
    ),
)
