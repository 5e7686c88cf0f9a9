"""The paper's turning formulas for a first-order yaw model r' = -a22 r + b2 (delta + delta_r0).

U-turn with a trapezoidal yaw rate (ramp t1, constant for t2, ramp t1): r_max = |b2| d / a22, t1 = 2.31 / a22 (to 90 %),
r_max (t1 + t2) = pi, so T = pi / r_max + 2.31 / a22 and R = V T / pi. The steady circle is R = V / r_max.
Rapid On-board Identification of the STARFISH AUV, section on the turning radius; table 4 and 5 are its results.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.errors import ModelError, UsageError
from fieldsid.numerics.arrays import FloatArray

RISE_TIME_CONSTANTS = 2.31
"""Time constants to 90 % of the final rate, ln 10 rounded up as in the paper."""


@dataclass(frozen=True, slots=True)
class UTurn:
    """Largest yaw rate (rad/s, magnitude), time of the u-turn (s), u-turn radius and steady radius (m); arrays of one shape."""

    yaw_rate_max: FloatArray
    time: FloatArray
    radius: FloatArray
    steady_radius: FloatArray


def u_turn(speed: npt.ArrayLike, damping: npt.ArrayLike, authority: npt.ArrayLike, fin: npt.ArrayLike) -> UTurn:
    """Return the paper's u-turn for speed m/s, a22 1/s, b2 1/s^2 and the usable fin angle rad, broadcast together."""
    v, a, b, d = (np.asarray(x, dtype=np.float64) for x in (speed, damping, authority, fin))
    rate = np.abs(b) * d / a
    time = np.pi / rate + RISE_TIME_CONSTANTS / a
    return UTurn(rate, np.asarray(time), np.asarray(v * time / np.pi), np.asarray(v / rate))


def refuse_unstable(damping: float, where: str, hint: str) -> None:
    """Raise ModelError when a22 <= 0: there is no steady rate, and the formula has no meaning."""
    if damping > 0:
        return
    raise ModelError(
        f"a22 <= 0 {where}: the yaw rate would grow without end, so the u-turn formula has no meaning",
        found=f"a22 = {damping:.4g} 1/s",
        hint=hint,
    )


def refuse_short_fin(limit: float, offset: float, where: str, hint: str) -> None:
    """Raise UsageError when the fin limit does not exceed the offset: the vehicle cannot turn to one of the sides."""
    if limit > abs(offset):
        return
    raise UsageError(
        f"the fin limit is below the offset {where}: the vehicle can turn to one side only",
        found=f"limit {limit:.4g} rad, offset delta_r0 = {offset:.4g} rad",
        hint=hint,
    )
