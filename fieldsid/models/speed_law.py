"""The base parameters as functions of the speed u: damping (u/u0)^p, authority by u^2 or by speed group, trim as a fin offset.

With u0 the reference speed and s = u/u0: a(u) = a22 s^p, k(u) = c23 (hydrostatic, independent of speed), b(u) = b2 s^e. Where
the runs form speed groups, b has a value for each group, and b/u^e is interpolated in log u between them. The trim moment in
yaw is that of a bent fin, C0 b(u)/b(u0), so that the fin angle that balances it is the same at every speed; in pitch it is that
of a weight out of place, Cb at every speed. Runs at several speeds can show otherwise. A model of one run keeps p = 1 and
e = 2, the scaling of linear lift-type damping and of lift (Fossen 2011, section 6.3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldsid.display import Brief
from fieldsid.models.axis import NAMES, Axis

GROUP_WIDTH = 0.08
"""Runs whose speeds differ by less than this share form one speed group, in which the authority is proportional to u^2."""
TRIM_OF_FIN = {Axis.YAW: True, Axis.PITCH: False}
"""Whether the trim moment is proportional to the authority where runs at several speeds do not show otherwise."""


def over_reference(authority: float, at_reference: float) -> float:
    """Return b(u)/b(u0), by which the trim moment of a bent fin scales; 1 where b(u0) is zero."""
    return authority / at_reference if at_reference != 0.0 else 1.0


def with_speed(name: str, axis: Axis, speed: float, *, trim_of_fin: bool) -> str:
    """Return a parameter's name with the speed (m/s) its value holds at, like `b2@1.4`; unchanged if it depends on no speed.

    Where the trim moment is proportional to the authority (`trim_of_fin`) the moment depends on speed and its fin offset does
    not; else it is the other way round.
    """
    names = NAMES[axis]
    speed_dependent = (names.damping, names.authority, names.trim if trim_of_fin else names.trim_fin)
    return f"{name}@{speed:.3g}" if name in speed_dependent and np.isfinite(speed) else name


@dataclass(frozen=True, slots=True, repr=False)
class SpeedLaw(Brief):
    """The speed law of a model; speeds in m/s. `points` are (speed, authority) of the groups, empty where one power law holds.

    A speed that differs from a group's by less than the share `snap` counts as the group's: `snap` is set where the runs of one
    group did not follow the law among themselves. `trim_of_fin` says that the trim moment is proportional to the authority.
    """

    reference: float
    damping_exponent: float = 1.0
    authority_exponent: float = 2.0
    points: tuple[tuple[float, float], ...] = ()
    snap: float = 0.0
    trim_of_fin: bool = False

    def effective(self, speed: float) -> float:
        """Return the speed at which the law is evaluated: the nearest group's where that is within `snap`, else `speed`."""
        if self.snap <= 0.0 or not np.isfinite(speed) or speed <= 0.0:
            return speed
        known = np.array([p[0] for p in self.points] or [self.reference])
        nearest = float(known[np.argmin(np.abs(np.log(known / speed)))])
        return nearest if abs(np.log(nearest / speed)) <= self.snap else speed

    def scale(self, speed: float) -> float:
        """Return u/u0, 1 where either speed is not known."""
        ok = np.isfinite(speed) and np.isfinite(self.reference) and self.reference > 0 and speed > 0
        return float(self.effective(speed) / self.reference) if ok else 1.0

    def damping_factor(self, speed: float) -> float:
        """Return a(u)/a(u0)."""
        return float(self.scale(speed) ** self.damping_exponent)

    def trim_factor(self, speed: float) -> float:
        """Return C(u)/C(u0)."""
        return over_reference(self.authority(speed, 1.0), self.authority(self.reference, 1.0)) if self.trim_of_fin else 1.0

    def authority(self, speed: float, at_reference: float) -> float:
        """Return b(u): near a group and beyond the outer ones by the power law, between them with b/u^e linear in log u."""
        scale = self.scale(speed)
        if not self.points:
            return float(at_reference * scale**self.authority_exponent)
        speeds = np.log([p[0] for p in self.points])
        over_law = np.array([p[1] for p in self.points]) / np.exp(speeds * self.authority_exponent)
        u = scale * self.reference
        # the power law of a group holds to half a group width on either side, as in the fit, at most to a third of the gap
        reach = np.minimum(0.5 * GROUP_WIDTH, np.diff(speeds) / 3.0)
        knots = np.sort(np.concatenate([speeds, speeds[:-1] + reach, speeds[1:] - reach]))
        return float(np.interp(np.log(u), knots, np.repeat(over_law, 3)[1:-1]) * u**self.authority_exponent)
