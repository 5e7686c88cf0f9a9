"""Fly and log the six-degree-of-freedom vehicle with any pilot, in a current, with fins that have a lag and stops."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from truth.hull import STEADY, Hull, inverse_mass
from truth.hull_kernel import PHI, PSI, THETA, P, Q, R, U, V, W, X, Y, Z, hull_advance
from truth.noise import ar1
from truth.physics import Physics

DEG = np.pi / 180.0
FINE_S = 0.0025


class Measured(NamedTuple):
    """The noisy measurements that the pilot gets at one sample, SI and radians."""

    yaw: float
    yaw_rate: float
    pitch: float
    pitch_rate: float
    roll: float
    depth: float
    surge: float
    x: float
    y: float


Controller = Callable[[float, Measured], tuple[float, float]]
"""(t, measured) -> (rudder, elevator) in rad; may return a third value, the thrust in N."""


@dataclass(frozen=True, slots=True)
class Fins:
    """The actuators: delay and lag in s, rate limit in rad/s (0: none), stops and offsets in rad."""

    delay: float = 0.0
    lag: float = 0.0
    rate: float = 0.0
    limit: float = 0.35
    rudder_offset: float = 0.0
    elevator_offset: float = 0.0


@dataclass(frozen=True, slots=True)
class Sensors:
    """Standard deviations of white noise: angles and rates in rad and rad/s, depth and position in m, speed in m/s."""

    angle: float = 0.3 * DEG
    rate: float = 0.3 * DEG
    roll: float = 0.1 * DEG
    depth: float = 0.02
    speed: float = 0.02
    position: float = 0.1


STOCK, FITTED, QUIET = Fins(), Sensors(), Sensors(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Sea:
    """Current (north, east) in m/s, and disturbance moments (pitch, yaw) in N m with their correlation time in s."""

    current: tuple[float, float] = (0.0, 0.0)
    gust: tuple[float, float] = (0.0, 0.0)
    gust_s: float = 2.0


CALM = Sea()


@dataclass(frozen=True, slots=True)
class Flight:
    """`log`: canonical columns (n,) with noise and fin commands; `truth`: the same without noise, with true fin angles."""

    log: dict[str, np.ndarray]
    truth: dict[str, np.ndarray] = field(default_factory=dict)


COLUMNS = {
    "yaw_rad": (PSI, "angle"), "yaw_rate_rad_s": (R, "rate"), "pitch_rad": (THETA, "angle"), "pitch_rate_rad_s": (Q, "rate"),
    "roll_rad": (PHI, "roll"), "roll_rate_rad_s": (P, "rate"), "depth_m": (Z, "depth"), "surge_m_s": (U, "speed"),
    "sway_m_s": (V, "speed"), "heave_m_s": (W, "speed"), "x_m": (X, "position"), "y_m": (Y, "position"),
}  # fmt: skip
SEEN = ("yaw_rad", "yaw_rate_rad_s", "pitch_rad", "pitch_rate_rad_s", "roll_rad", "depth_m", "surge_m_s", "x_m", "y_m")


def thrust_for(speed: float, hull: Hull = STEADY) -> float:
    """Return the thrust (N) that keeps a speed (m/s) on a straight course."""
    return -hull.Xuu * speed**2


def fly_vehicle(
    controller: Controller,
    duration: float,
    *,
    speed: float = 1.54,
    hull: Hull = STEADY,
    fins: Fins = STOCK,
    sensors: Sensors = FITTED,
    sea: Sea = CALM,
    sample: float = 0.05,
    seed: int = 0,
    heading: float = 0.0,
    depth: float = 5.0,
    run_up: Controller | None = None,
    run_up_s: float = 0.0,
) -> Flight:
    """Fly `duration` s from straight running at `speed` (m/s); `run_up` steers for run_up_s before that (t < 0), unlogged."""
    rng, before = np.random.default_rng(seed), round(run_up_s / sample)
    n = round(duration / sample) + before
    state = np.zeros(12)
    state[U], state[PSI], state[Z] = speed, heading, depth
    states, commands, angles, thrust = np.zeros((n, 12)), np.zeros((n, 2)), np.zeros((n, 2)), np.full(n, thrust_for(speed, hull))
    noise = rng.standard_normal((n, 12)) * [getattr(sensors, COLUMNS[k][1]) for k in COLUMNS]
    gust = np.stack([ar1(rng, n, size, sea.gust_s, sample) for size in sea.gust], axis=1)
    pins = Physics(max_rate=fins.rate, servo_tau=fins.lag)
    minv, memory, water = inverse_mass(hull), np.zeros((2, 5)), np.array([*sea.current, 0.0])
    offset, late = np.array([fins.rudder_offset, fins.elevator_offset]), fins.delay / sample
    for k in range(n):
        t = (k - before) * sample
        states[k] = state
        seen = Measured(*(state[COLUMNS[name][0]] + noise[k, list(COLUMNS).index(name)] for name in SEEN))
        asked = (controller if t >= -1e-9 or run_up is None else run_up)(t, seen)
        commands[k] = np.clip(asked[:2], -fins.limit, fins.limit)
        if len(asked) > 2:
            thrust[k] = asked[2]
        for start, end, source in _held_parts(k, late):
            count = max(1, int(np.ceil((end - start) * sample / FINE_S - 1e-9)))
            step = (end - start) * sample / count
            angles[k] = hull_advance(
                state, hull, minv, pins, commands[source] + offset, memory, thrust[k], water, gust[k], step, count
            )
    logged = [part[before:] for part in (states, noise, commands, angles, thrust)]
    return _flight(np.arange(n - before) * sample, *logged)


def _held_parts(k, late):
    """Return the parts of interval k as (start, end, index of the command in force); times and delay `late` in samples."""
    whole = int(np.floor(late + 1e-9))
    rest = max(late - whole, 0.0)
    parts = [(0.0, rest, max(k - whole - 1, 0))] if rest > 1e-9 else []
    return [*parts, (rest, 1.0, max(k - whole, 0))]


def _flight(time, states, noise, commands, angles, thrust):
    truth = {"time_s": time, **{name: states[:, i] for name, (i, _) in COLUMNS.items()}, "thrust": thrust}
    log = dict(truth)
    for j, name in enumerate(COLUMNS):
        log[name] = truth[name] + noise[:, j]
    log["rudder_rad"], log["elevator_rad"] = commands.T
    truth["rudder_rad"], truth["elevator_rad"] = angles.T
    return Flight({k: v.copy() for k, v in log.items()}, truth)
