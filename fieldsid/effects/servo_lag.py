"""The fin follows its command as a first-order lag: lag d(delta)/dt = command - delta, lag >= 0 in s.

The response to a command that is linear over the interval is exact, and so is its mean; the servo starts at rest at the command.
In one variant the servo has inertia: inertia_share lag^2 d2(delta)/dt2 is added on the left, a second-order lag with the damping
ratio 1 / (2 sqrt(inertia_share)). In another the lag is lag_ratio times as long while the fin angle falls.
Source: Van Amerongen 1982 (the steering machine, linear part).
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
"""A lag below this has no measurable effect; the command is returned unchanged."""
EQUAL_STEP_SHARE = 1e-12
"""Relative difference of step / lag below which the exponential of the last step is used again."""


@jit
def lagged(steps: FloatArray, start: FloatArray, end: FloatArray, rising: float, falling: float, out: FloatArray) -> None:
    """Fill out (n-1, 4) with lines and ends of the lagged path: fin = command - lag slope + c exp(-t / lag).

    The lag is `rising` or `falling` by the direction in which the fin moves at the start of an interval; under a zero-order-hold
    command the direction cannot change within the interval.
    """
    fin = start[0]
    x, decayed, bend = 0.0, 0.0, 0.0
    for i in range(start.shape[0]):
        h = steps[i]
        lag = rising if start[i] >= fin else falling
        slope = (end[i] - start[i]) / h
        c = fin - start[i] + slope * lag
        if abs(h / lag - x) > EQUAL_STEP_SHARE * x:
            x = h / lag
            decayed = -np.expm1(-x)
            if x < 1e-2:
                # First moment of the exponential about the middle, as a series: the closed form cancels.
                bend = -x * (1.0 - 0.5 * x + 0.15 * x * x)
            else:
                bend = 12.0 / (x * x) * (1.0 - (1.0 - decayed) * (1.0 + x) - 0.5 * x * decayed)
        mean = start[i] + slope * (0.5 * h - lag) + c * decayed / x
        half = 0.5 * (slope * h + c * bend)
        last = start[i] + slope * (h - lag) + c * (1.0 - decayed)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = mean - half, mean + half, fin, last
        fin = last


@jit
def swung(steps: FloatArray, start: FloatArray, end: FloatArray, lag: float, inertia: float, out: FloatArray) -> None:
    """Fill out (n-1, 4) as `lagged` does for inertia delta'' + lag delta' + delta = command, inertia in s^2.

    e, the fin angle less the steady response to the linear command, obeys the homogeneous equation: its value at the end of an
    interval is that of the matrix exponential, and its integrals follow from the equation.
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
    """Return the path of the fin behind a servo of first order, or of second order with `inertia_share`, (n-1,) rad."""
    lag = float(values["lag"])
    if lag <= FASTEST_S:
        return path
    if "inertia_share" in values:
        inertia = float(values["inertia_share"]) * lag * lag
        return through(path, record.steps, lambda steps, start, end, out: swung(steps, start, end, lag, inertia, out))
    falling = lag * float(values.get("lag_ratio", 1.0))
    return through(path, record.steps, lambda steps, start, end, out: lagged(steps, start, end, lag, falling, out))


def equivalent_solution(values: Values, axis: Axis) -> dict[str, float] | None:
    """Return the values with the slow pole of the servo and the fast pole of the hull exchanged; None where that is impossible.

    In yaw both have the same response at one speed. With inertia the servo's two time constants T1 >= T2 have the sum `lag` and
    the product inertia_share lag^2; they are real where inertia_share is at most 1/4. A hull with a cross state has the poles of
    s^2 + (a22 + c) s + a22 c + c_r, with c = cross_damping and c_r = cross_rate, and the zero -c: its fast pole is exchanged if
    both are real, its slow pole and its zero stay. The drag of the cross flow (strip_drag) is nonlinear and has no poles.
    """
    names, lag = NAMES[axis], values["lag"]
    apart = 1.0 - 4.0 * values.get("inertia_share", 0.0)
    poles = _hull_poles(values[names.damping], values)
    if axis is not Axis.YAW or poles is None or lag <= FASTEST_S or apart < 0.0:
        return None
    slow, fast = (0.5 * lag * (1.0 + sign * np.sqrt(apart)) for sign in (1.0, -1.0))
    pole, slow_pole = poles
    new_lag = 1.0 / pole + fast
    exchanged = {
        names.damping: 1.0 / slow,
        "lag": new_lag,
        names.authority: values[names.authority] / (slow * pole),
    }
    if slow_pole is not None:
        zero = values["cross_damping"]
        exchanged[names.damping] += slow_pole - zero
        exchanged["cross_rate"] = slow_pole / slow - exchanged[names.damping] * zero
    return exchanged | {"inertia_share": fast / pole / new_lag**2} if "inertia_share" in values else exchanged


def _hull_poles(damping: float, values: Values) -> tuple[float, float | None] | None:
    """Return the fast pole of the hull and, with a cross state, the slow one, as decay rates in 1/s.

    None where they are complex or the fast one is unstable.
    """
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
