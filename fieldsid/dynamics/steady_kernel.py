"""The equations of motion (models/hull.py) of many vehicles at rest: their derivative on a straight run, their root in a turn."""

from __future__ import annotations

import numpy as np

from fieldsid.models.hull import CROSS_FIN, Core, Kinds, Slope, kinds_of, named, slope
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import inner, jit

STRAIGHT = ("damping", "stiffness", "cross_damping", "moment_of_rate", "moment_of_fin")
"""What a linear plant is made of besides what the base model gives: the last two are what rate and fin add to the moment of the
cross state, 1/s^2 for each second and 1/s^3."""


MAX_RATE_RAD_S = 20.0
"""rad/s; a rate that would be above is no steady turn but an unstable model."""
MAX_ITERATIONS, DIGITS = 200, 1e-14
"""Newton's method has one root between its bounds, and halves them where it leaves them."""


@jit
def straight_slopes(cores: FloatArray) -> FloatArray:
    """Return the columns of STRAIGHT (5, d) that the constants (d, C) of vehicles make, at rest on a straight run."""
    out = np.zeros((5, cores.shape[0]))
    for i in range(cores.shape[0]):
        now = slope(named(cores[i]), kinds_of(cores[i]), 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0)
        out[0, i], out[1, i], out[2, i] = -now.by_rate, -now.by_angle, -now.cross_by_cross
        out[3, i], out[4, i] = -now.by_cross * now.cross_by_rate, now.by_cross * cores[i, CROSS_FIN]
    return out


@inner
def _settled(k: Core, kinds: Kinds, damping: float, moment: float, fin: float, rate: float, x: float) -> tuple[float, Slope]:
    """Return the cross state that a steady rate leads to, from a near one, with the right-hand side there; x' falls with x."""
    now = slope(k, kinds, damping, 0.0, moment, fin, 1.0, 0.0, rate, x, 0.0)
    for _ in range(MAX_ITERATIONS):
        if now.cross_by_cross == 0.0:
            break
        step = -now.cross / now.cross_by_cross
        x += step
        now = slope(k, kinds, damping, 0.0, moment, fin, 1.0, 0.0, rate, x, 0.0)
        if not abs(step) > DIGITS * abs(x):
            break
    return x, now


@inner
def between(at: float, places: FloatArray, values: FloatArray) -> float:
    """Return the value at a place between rising ones, held beyond them; zero without any."""
    if places.size == 0:
        return 0.0
    above = min(max(int(np.searchsorted(places, at)), 1), places.size - 1)
    share = min(max((at - places[above - 1]) / (places[above] - places[above - 1]), 0.0), 1.0)
    return float(values[above - 1] + share * (values[above] - values[above - 1]))


@jit
def settled_rates(
    cores: FloatArray, damping: FloatArray, moment: FloatArray, fin: FloatArray, side: float, rates: FloatArray,
    moments: FloatArray, out: FloatArray,
) -> None:  # fmt: skip
    """Fill out (m,) with the steady rate toward `side` of m vehicles, the root of their equations, NaN where there is none.

    cores (m, C), damping, moment and fin (m,); moments (n, r) rad/s^2 at rates (r,) come on top, the first of them for the
    first vehicle and again for the one that follows the last of them, none where they are empty.
    """
    for i in range(out.size):
        k, kinds, x = named(cores[i]), kinds_of(cores[i]), 0.0
        low, high, rate = 0.0, MAX_RATE_RAD_S, MAX_RATE_RAD_S
        out[i] = np.nan
        for count in range(MAX_ITERATIONS):
            x, now = _settled(k, kinds, damping[i], moment[i], fin[i], side * rate, x)
            surplus = side * (now.rate + between(side * rate, rates, moments[i % moments.shape[0]]))
            if count == 0:  # at the upper bound, where a turn that settles has none left
                if not surplus < 0.0:
                    break
                rate = 0.0
                continue
            if count == 1 and not surplus > 0.0:
                break
            if surplus > 0.0:
                low = rate
            else:
                high = rate
            by_rate = now.by_rate - (now.by_cross * now.cross_by_rate / now.cross_by_cross if now.cross_by_cross != 0.0 else 0.0)
            new = rate - surplus / by_rate if by_rate < 0.0 else high
            if not low < new < high:
                new = 0.5 * (low + high)
            out[i] = side * new
            if not abs(new - rate) > DIGITS * new:
                break
            rate = new
