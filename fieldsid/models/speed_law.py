"""How the base parameters move with speed: damping as (u/u0)^p, authority by u^2 or by speed group, trim as a fin's offset.

With u0 the reference speed and s = u/u0: a(u) = a22 s^p, k(u) = c23 (hydrostatic, no speed), b(u) = b2 s^e or the groups'
own values with a power law between them; a speed within reach of a group is that of its own. The trim moment of the yaw is
that of a bent fin, C b(u)/b(u0), so that the fin angle that holds it is the same at every speed; that of the pitch is a
weight out of its place, the same at every speed. Runs at several speeds may say otherwise. A model of one run keeps p = 1
and e = 2, the scaling of lift and linear lift-type damping (Fossen 2011, section 6.3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldsid.display import Brief
from fieldsid.models.axis import NAMES, Axis

GROUP_WIDTH = 0.08
"""Runs whose speeds differ by less than this share form one speed group, in which the authority goes with u^2."""
TRIM_OF_FIN = {Axis.YAW: True, Axis.PITCH: False}
"""Whether the trim moment goes with the authority where runs at several speeds do not say otherwise."""


def over_reference(authority: float, at_reference: float) -> float:
    """Return an authority over that at the reference speed, one where there is none: what a bent fin's trim goes with."""
    return authority / at_reference if at_reference != 0.0 else 1.0


def with_speed(name: str, axis: Axis, speed: float, *, trim_of_fin: bool) -> str:
    """Return a parameter's name with the speed (m/s) its value belongs to, like `b2@1.4`; as it is where it has none.

    The fin offset that goes with the trim is at every speed the same where the trim goes with the authority.
    """
    names = NAMES[axis]
    moves = (names.damping, names.authority, names.trim if trim_of_fin else names.trim_fin)
    return f"{name}@{speed:.3g}" if name in moves and np.isfinite(speed) else name


@dataclass(frozen=True, slots=True, repr=False)
class SpeedLaw(Brief):
    """Speeds in m/s; `points` are (speed, authority) of the groups, empty where the power law holds.

    A speed within the share `snap` of a group's speed counts as that group's: set where runs of one group did not
    follow the law among themselves.
    """

    reference: float
    damping_exponent: float = 1.0
    authority_exponent: float = 2.0
    points: tuple[tuple[float, float], ...] = ()
    snap: float = 0.0
    trim_of_fin: bool = False

    def effective(self, speed: float) -> float:
        """Return the speed the law is taken at."""
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
        """Return b(u); between groups log-linear in log u, within reach of one and beyond them by the power law from it."""
        scale = self.scale(speed)
        if not self.points:
            return float(at_reference * scale**self.authority_exponent)
        speeds = np.log([p[0] for p in self.points])
        over_law = np.array([p[1] for p in self.points]) / np.exp(speeds * self.authority_exponent)
        u = scale * self.reference
        # half a group's width on either side is the group's, as it is in the fit; neighbours share what is between them
        reach = np.minimum(0.5 * GROUP_WIDTH, np.diff(speeds) / 3.0)
        knots = np.sort(np.concatenate([speeds, speeds[:-1] + reach, speeds[1:] - reach]))
        return float(np.interp(np.log(u), knots, np.repeat(over_law, 3)[1:-1]) * u**self.authority_exponent)
