"""Equilibria of the equations of motion (models/hull.py) of many vehicles: derivatives on a straight run, the rate in a turn."""

from __future__ import annotations

import numpy as np

from fieldsid.models.hull import CROSS_FIN, Core, Kinds, Slope, kinds_of, named, slope
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import inner, jit

STRAIGHT = ("damping", "stiffness", "cross_damping", "moment_of_rate", "moment_of_fin")
"""The quantities that effects add to the linear plant of the base model. The last two are the derivatives of c x' (c x is the
moment of the cross state) by rate, with a minus, in 1/s^2, and by fin, in 1/s^3."""


MAX_RATE_RAD_S = 20.0
"""rad/s; where the equilibrium rate would be above, the model is unstable and has no steady turn."""
MAX_ITERATIONS, DIGITS = 200, 1e-14
"""Limits of Newton's method: iterations, and the relative step at which it ends. It bisects where a step leaves the bracket."""


@jit
def straight_slopes(cores: FloatArray) -> FloatArray:
    """Return the quantities of STRAIGHT, (5, d), for vehicles with the constants cores (d, C) on a straight run."""
    out = np.zeros((5, cores.shape[0]))
    for i in range(cores.shape[0]):
        now = slope(named(cores[i]), kinds_of(cores[i]), 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0)
        out[0, i], out[1, i], out[2, i] = -now.by_rate, -now.by_angle, -now.cross_by_cross
        out[3, i], out[4, i] = -now.by_cross * now.cross_by_rate, now.by_cross * cores[i, CROSS_FIN]
    return out


@inner
def _settled(k: Core, kinds: Kinds, damping: float, moment: float, fin: float, rate: float, x: float) -> tuple[float, Slope]:
    """Return the equilibrium cross state at a steady rate, and the right-hand side there; x is the start of Newton's method."""
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
    """Return the linear interpolation at `at` of values (r,) at rising places (r,), constant beyond them; zero if r = 0."""
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
    """Fill out (m,) with the steady rate of m vehicles in a turn toward `side` (+1 or -1), NaN where there is none.

    cores (m, C), damping, moment and fin (m,). The moments (n, r) rad/s^2 at the rates (r,) are added to p': row i modulo n is
    that of vehicle i; r may be zero.
    """
    for i in range(out.size):
        k, kinds, x = named(cores[i]), kinds_of(cores[i]), 0.0
        low, high, rate = 0.0, MAX_RATE_RAD_S, MAX_RATE_RAD_S
        out[i] = np.nan
        for count in range(MAX_ITERATIONS):
            x, now = _settled(k, kinds, damping[i], moment[i], fin[i], side * rate, x)
            surplus = side * (now.rate + between(side * rate, rates, moments[i % moments.shape[0]]))
            if count == 0:  # at the upper bound, where the surplus moment of a turn that settles is negative
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
