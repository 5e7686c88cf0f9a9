"""Hulls of seven kinds with coefficients from strip theory, slender-body theory, fin lift and cross-flow drag.

Surge, sway and yaw of Fossen (2011, chapter 6) about the centre of buoyancy, SNAME axes, positive rudder turns to port.
Added mass: Lamb (1932, article 114) for the spheroid, strips rho pi c^2 for the section of half height c (Newman 1977, 4.13).
Munk moment (m22 - m11) u v, cut by viscosity to 60 .. 100 %; hull lift as Hoerner (1965, 13-2) has it; fins as wings of low
aspect ratio that stall; cross-flow drag integrated over the hull with coefficients 0.5 .. 1.2 (Hoerner 1965, 3-9).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

WATER = 1025.0
STATIONS = 21
MAX_TRIES = 4000


class Coefficients(NamedTuple):
    """Coefficients of one hull, SI: rigid-body and added mass, hull lift, cross-flow, fins and rudder, drag, propeller, servo."""

    length: float
    mass_surge: float
    mass_sway: float
    inertia_yaw: float
    coupling: float
    centripetal_surge: float
    centripetal_sway: float
    centripetal_yaw: float
    munk: float
    lift: float
    lift_arm: float
    tail_mass: float
    tail_arm: float
    section_drag: float
    profile_power: float
    fin_arm: float
    fixed_fin: float
    rudder: float
    stall: float
    rudder_offset: float
    drag: float
    thrust_slope: float
    servo_lag: float
    rate_limit: float


@dataclass(frozen=True, slots=True)
class Kind:
    """Ranges that the hulls of a kind are drawn from.

    Length (m), length over height, width over height, moment of the rudder over the inviscid Munk moment, that of the fixed fins
    over the reduced one, whether straight running is stable (None: either), lowest speed (m/s).
    """

    length: tuple[float, float]
    slenderness: tuple[float, float]
    width: tuple[float, float]
    rudder: tuple[float, float]
    fixed: tuple[float, float]
    stable: bool | None
    speed: tuple[float, float]


KINDS = {
    "slim torpedo": Kind((1.4, 2.6), (8.0, 12.0), (1.0, 1.0), (0.06, 0.20), (0.1, 0.6), True, (0.8, 1.3)),
    "short and fat": Kind((1.0, 1.6), (3.5, 5.5), (1.0, 1.0), (0.06, 0.20), (0.1, 0.8), True, (0.6, 1.0)),
    "large": Kind((4.0, 6.0), (7.0, 11.0), (1.0, 1.0), (0.05, 0.16), (0.1, 0.6), True, (1.0, 1.5)),
    "flat": Kind((1.2, 3.0), (7.0, 14.0), (1.6, 2.8), (0.05, 0.20), (0.1, 0.8), None, (0.7, 1.2)),
    "tall": Kind((1.0, 2.5), (3.0, 6.0), (0.5, 0.8), (0.04, 0.15), (0.1, 0.8), None, (0.6, 1.0)),
    "weak fins": Kind((1.5, 4.0), (6.0, 10.0), (1.0, 1.0), (0.02, 0.05), (0.3, 0.9), True, (0.9, 1.4)),
    "unstable": Kind((1.2, 4.0), (5.0, 9.0), (1.0, 1.0), (0.05, 0.14), (0.0, 0.4), False, (0.8, 1.3)),
}


@dataclass(frozen=True, slots=True)
class Hull:
    """A random hull: its kind, coefficients, rudder limit (rad) and the five speeds (m/s) at which it is flown."""

    kind: str
    of: Coefficients
    rudder_limit: float
    speeds: tuple[float, ...]

    @property
    def stable(self) -> bool:
        """Whether the hull keeps a straight course with the rudder at rest."""
        return growth_rate(self.of) < 0.0


def draw_hull(number: int, seed: int) -> Hull:
    """Return hull `number` of an ensemble; the kinds take turns, so that each is equally frequent."""
    kind = list(KINDS)[number % len(KINDS)]
    rng = np.random.default_rng([seed, number])
    wanted = KINDS[kind].stable
    for _ in range(MAX_TRIES):
        drawn = _coefficients(KINDS[kind], rng)
        growth = growth_rate(drawn)
        # left out: hulls that leave their course within half a length, and hulls that need 15 lengths to turn
        gentle = growth < 0.0 and linear_radius(drawn, 0.4) > 15.0 * drawn.length
        if (wanted is None or wanted == (growth < 0.0)) and growth * drawn.length < 2.0 and not gentle:
            low = rng.uniform(*KINDS[kind].speed)
            speeds = tuple(float(round(s, 3)) for s in np.linspace(low, rng.uniform(1.7, 2.3) * low, 5))
            return Hull(kind, drawn, float(rng.uniform(0.26, 0.5)), speeds)
    raise RuntimeError(f"no hull of kind {kind!r} in {MAX_TRIES} draws")


def _coefficients(kind: Kind, rng: np.random.Generator) -> Coefficients:
    length, height = rng.uniform(*kind.length), 0.0
    height = length / rng.uniform(*kind.slenderness)
    width = height * rng.uniform(*kind.width)
    power = rng.uniform(2.0, 6.0)
    station = np.linspace(-0.5, 0.5, 201)
    profile = _profile(station, power)
    area, second = np.trapezoid(profile**2, station), np.trapezoid(profile**2 * station**2, station)
    mass = WATER * 0.25 * np.pi * width * height * length * area
    strip = WATER * 0.25 * np.pi * height**2 * length
    end = 1.0 - 1.2 * (height / length) ** 1.3
    m11 = mass * _lamb_axial(length, np.sqrt(width * height)) * rng.uniform(0.9, 1.3)
    m22 = strip * area * end * rng.uniform(0.85, 1.15)
    m66 = strip * length**2 * second * end * rng.uniform(0.7, 1.1)
    inertia = mass * length**2 * second / area * rng.uniform(0.85, 1.2)
    centre = rng.uniform(-0.02, 0.02) * length
    added_centre = rng.uniform(-0.02, 0.04) * length
    munk = (m22 - m11) * rng.uniform(0.6, 1.0)
    arm = -rng.uniform(0.36, 0.48) * length
    rudder = _log_uniform(rng, kind.rudder) * (m22 - m11) / abs(arm)
    frontal = 0.25 * np.pi * width * height
    return Coefficients(
        length=length,
        mass_surge=mass + m11,
        mass_sway=mass + m22,
        inertia_yaw=inertia + m66,
        coupling=mass * centre + m22 * added_centre,
        centripetal_surge=mass + m22 * rng.uniform(0.6, 1.0),
        centripetal_sway=mass + m11,
        centripetal_yaw=mass * centre + m22 * added_centre * rng.uniform(0.0, 1.0),
        munk=munk,
        lift=0.5 * WATER * height * np.sqrt(width * height) * rng.uniform(0.4, 1.4),
        lift_arm=-rng.uniform(0.05, 0.25) * length,
        tail_mass=strip / length * rng.uniform(0.02, 0.25),
        tail_arm=-rng.uniform(0.40, 0.48) * length,
        section_drag=0.5 * WATER * height * rng.uniform(0.5, 1.2),
        profile_power=power,
        fin_arm=arm,
        fixed_fin=rng.uniform(*kind.fixed) * munk / abs(arm),
        rudder=rudder,
        stall=rng.uniform(0.35, 0.6),
        rudder_offset=rng.normal(0.0, 0.012),
        drag=0.5 * WATER * frontal * rng.uniform(0.12, 0.35),
        thrust_slope=rng.uniform(0.0, 1.0),
        servo_lag=rng.uniform(0.05, 0.3),
        rate_limit=rng.uniform(0.8, 4.0),
    )  # fmt: skip


def _profile(station: np.ndarray, power: float) -> np.ndarray:
    """Return the height of the hull over its greatest height, at stations -1/2 .. 1/2 of the length."""
    return np.sqrt(np.maximum(1.0 - np.abs(2.0 * station) ** power, 0.0))


def _lamb_axial(length: float, diameter: float) -> float:
    """Return the axial added mass of a spheroid over its displaced mass (Lamb)."""
    e = np.sqrt(1.0 - min(diameter / length, 0.95) ** 2)
    alpha = 2.0 * (1.0 - e**2) / e**3 * (np.arctanh(e) - e)
    return float(alpha / (2.0 - alpha))


def _log_uniform(rng: np.random.Generator, between: tuple[float, float]) -> float:
    return float(np.exp(rng.uniform(*np.log(between))))


def growth_rate(h: Coefficients) -> float:
    """Return the largest real part (1/s) of the two sway-yaw eigenvalues of straight running at 1 m/s."""
    mass = np.array([[h.mass_sway, h.coupling], [h.coupling, h.inertia_yaw]])
    return float(np.max(np.linalg.eigvals(np.linalg.solve(mass, _lateral(h))).real))


def linear_radius(h: Coefficients, rudder: float) -> float:
    """Return the radius (m) of the steady turn at a rudder angle (rad), without stall, cross-flow drag and loss of speed."""
    rate = np.linalg.solve(_lateral(h), -h.rudder * rudder * np.array([1.0, h.fin_arm]))[1]
    return float(1.0 / abs(rate))


def _lateral(h: Coefficients) -> np.ndarray:
    """Return the matrix (2, 2) of lateral force and yaw moment on sway velocity and yaw rate at 1 m/s."""
    fin = h.fixed_fin + h.rudder
    return np.array(
        [
            [-h.lift - fin - h.tail_mass, -h.centripetal_sway - fin * h.fin_arm - h.tail_mass * h.tail_arm],
            [
                -h.munk - h.lift * h.lift_arm - fin * h.fin_arm - h.tail_mass * h.tail_arm,
                -h.centripetal_yaw - fin * h.fin_arm**2 - h.tail_mass * h.tail_arm**2,
            ],
        ]
    )
