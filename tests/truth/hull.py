"""Coefficients of the REMUS 100 (Prestero 2001, tables of chapter 5 and appendix), origin at the centre of buoyancy.

SNAME: u, v, w forward, starboard, down in m/s; p, q, r in rad/s. Positive rudder turns to port (Nuudr < 0), positive
stern plane pitches the nose down (Muuds < 0).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Hull(NamedTuple):
    """Weight, inertia, added mass, drag, lift and fin coefficients, SI."""

    W: float = 299.0
    B: float = 306.0
    g: float = 9.81
    zg: float = 0.0196
    Ixx: float = 0.177
    Iyy: float = 3.45
    Izz: float = 3.45
    Xudot: float = -0.93
    Yvdot: float = -35.5
    Yrdot: float = 1.93
    Zwdot: float = -35.5
    Zqdot: float = -1.93
    Kpdot: float = -0.0704
    Mwdot: float = -1.93
    Mqdot: float = -4.88
    Nvdot: float = 1.93
    Nrdot: float = -4.88
    Xuu: float = -1.62
    Xwq: float = -35.5
    Xqq: float = -1.93
    Xvr: float = 35.5
    Xrr: float = -1.93
    Yvv: float = -1310.0
    Yrr: float = 0.632
    Yuv: float = -28.6
    Ywp: float = 35.5
    Yur: float = 5.22
    Ypq: float = 1.93
    Yuudr: float = 9.64
    Zww: float = -131.0
    Zqq: float = -0.632
    Zuw: float = -28.6
    Zuq: float = -5.22
    Zvp: float = -35.5
    Zrp: float = 1.93
    Zuuds: float = -9.64
    Kpp: float = -0.13
    Kprop: float = -0.1407  # N m of torque per N of thrust: -0.543 at 3.86
    Mww: float = 3.18
    Mqq: float = -188.0
    Mrp: float = 4.86
    Muq: float = -2.0
    Muw: float = 24.0
    Mvp: float = -1.93
    Muuds: float = -6.15
    Nvv: float = -3.18
    Nrr: float = -94.0
    Nuv: float = -24.0
    Npq: float = -4.86
    Nwp: float = -1.93
    Nur: float = -2.0
    Nuudr: float = -6.15

    @property
    def mass(self) -> float:
        return self.W / self.g


REMUS = Hull()
"""As published: directionally unstable at small angles (Munk moment), limited by cross-flow drag."""


def with_fins(hull: Hull, factor: float) -> Hull:
    """Return the hull with `factor` times the fin area, which scales the fin lift by v, r, w, q and the fin angle alike."""
    lift, arm = hull.Yuudr, hull.Nuudr / hull.Yuudr
    more = (factor - 1.0) * lift
    return hull._replace(
        Yuudr=lift * factor, Nuudr=hull.Nuudr * factor, Zuuds=-lift * factor, Muuds=hull.Muuds * factor,
        Yuv=hull.Yuv - more, Nuv=hull.Nuv - more * arm, Yur=hull.Yur - more * arm, Nur=hull.Nur - more * arm**2,
        Zuw=hull.Zuw - more, Muw=hull.Muw + more * arm, Zuq=hull.Zuq + more * arm, Muq=hull.Muq - more * arm**2,
    )  # fmt: skip


STEADY = with_fins(REMUS, 2.5)
"""Fins of 2.5 times the area: straight running is stable without a pilot."""


def inverse_mass(hull: Hull):
    """Return the inverse (6, 6) of the rigid-body and added mass."""
    m, zg = hull.mass, hull.zg
    matrix = np.diag(
        [m - hull.Xudot, m - hull.Yvdot, m - hull.Zwdot, hull.Ixx - hull.Kpdot, hull.Iyy - hull.Mqdot, hull.Izz - hull.Nrdot]
    )
    matrix[0, 4] = matrix[4, 0] = m * zg
    matrix[1, 3] = matrix[3, 1] = -m * zg
    matrix[1, 5], matrix[5, 1] = -hull.Yrdot, -hull.Nvdot
    matrix[2, 4], matrix[4, 2] = -hull.Zqdot, -hull.Mwdot
    return np.linalg.inv(matrix)


def yaw_plane(hull: Hull, speed: float):
    """Return the linear sway-yaw dynamics at a speed: the matrix (2, 2) on (v, r) and the vector (2,) on the rudder."""
    mass = np.array([[hull.mass - hull.Yvdot, -hull.Yrdot], [-hull.Nvdot, hull.Izz - hull.Nrdot]])
    force = speed * np.array([[hull.Yuv, hull.Yur - hull.mass], [hull.Nuv, hull.Nur]])
    return np.linalg.solve(mass, force), np.linalg.solve(mass, speed**2 * np.array([hull.Yuudr, hull.Nuudr]))
