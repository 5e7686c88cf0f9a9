"""Training sets of a hull: pulses at each speed, alone or with zig-zags, a circle or a u-turn; logged with noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truth.maneuvering.hulls import Hull
from truth.maneuvering.motion import HOLD, OPEN, ZIGZAG, fly

SAMPLE_S = 0.1
SETS = ("pulses", "pulses+zigzag", "pulses+circle")
MORE_SETS = ("pulses+uturn", "pulses+half", "pulses+zigzag by rpm")
"""One u-turn, or one circle at half rudder, at the middle speed; zig-zags whose speed is known by the propeller's turns only."""
TURNS = ("circle", "uturn", "half")
RPM_PER_M_S = 420.0
GYRO, COMPASS, DVL, FIX = 0.003, 0.005, 0.02, 0.1
"""Standard deviations: rad/s, rad, m/s, m."""
GUST_SHARE, GUST_TIME_S = 0.01, 2.0
"""Standard deviation of the disturbance moment, as a share of the moment of full rudder, and its correlation time."""


@dataclass(frozen=True, slots=True)
class Log:
    """A log: its columns (n,) by canonical name, and the speed (m/s) at which it was flown."""

    name: str
    speed: float
    time: np.ndarray
    columns: dict[str, np.ndarray]


def training(hull: Hull, which: str, rng: np.random.Generator, *, sway: bool) -> list[Log]:
    """Return the logs of a training set by rising speed; a circle or u-turn is flown at the middle speed only."""
    logs = []
    for index, speed in enumerate(hull.speeds):
        logs.append(_log(hull, f"pulses{index}", speed, *_pulses(hull, speed), rng, sway=sway))
        if which.startswith("pulses+zigzag"):
            logs.append(_log(hull, f"zigzag{index}", speed, *_zigzag(hull, speed), rng, sway=sway))
        turn = which.removeprefix("pulses+")
        if turn in TURNS and index == 2:
            logs.append(_log(hull, turn, speed, *_turn(hull, speed, turn), rng, sway=sway))
    return [_by_rpm(log) for log in logs] if which.endswith("by rpm") else logs


def _by_rpm(log: Log) -> Log:
    """Return a log with the propeller's turns added; that of a zig-zag loses its other signals of speed."""
    columns = log.columns | {"propeller_rpm": np.full(log.time.size, RPM_PER_M_S * log.speed)}
    if log.name.startswith("zigzag"):
        columns = {k: v for k, v in columns.items() if k not in ("surge_m_s", "sway_m_s", "x_m", "y_m")}
    return Log(log.name, log.speed, log.time, columns)


def _passage(hull: Hull, speed: float) -> float:
    """Return the time (s) in which the hull travels its own length."""
    return hull.of.length / speed


def _pulses(hull: Hull, speed: float) -> tuple[np.ndarray, np.ndarray]:
    """Return command and mode of four pairs of pulses, of a width by the passage time, the course kept between them."""
    width = max(2.0, 0.8 * _passage(hull, speed))
    rest = 6.0 * width
    time = np.arange(0.0, 4.0 + 4.0 * (2.0 * width + rest), SAMPLE_S)
    command, mode = np.zeros(time.size), np.full(time.size, HOLD)
    for pair, size in enumerate((1.0, 0.6, -1.0, -0.6)):
        start = 3.0 + pair * (2.0 * width + rest)
        for sign, begin in ((1.0, start), (-1.0, start + width)):
            inside = (time >= begin - 1e-9) & (time < begin + width - 1e-9)
            command[inside], mode[inside] = sign * size * min(0.26, hull.rudder_limit), OPEN
    return command, mode


def _zigzag(hull: Hull, speed: float) -> tuple[np.ndarray, np.ndarray]:
    time = np.arange(0.0, max(60.0, 30.0 * _passage(hull, speed)), SAMPLE_S)
    return np.zeros(time.size), np.where(time < 3.0, HOLD, ZIGZAG)


def _turn(hull: Hull, speed: float, which: str) -> tuple[np.ndarray, np.ndarray]:
    time = np.arange(0.0, 6.0 + max(60.0, 45.0 * _passage(hull, speed)), SAMPLE_S)
    command = np.where(time < 6.0, 0.0, -hull.rudder_limit * (0.5 if which == "half" else 1.0))
    mode = np.where(time < 6.0, HOLD, OPEN)
    if which == "uturn":
        settings = np.array([0.0, 0.0, hull.rudder_limit, 1.0, 1.2 * _passage(hull, speed)])
        heading = fly(hull.of, speed, command, mode, settings, SAMPLE_S, np.zeros(time.size))[0][:, 3]
        mode[np.abs(heading) > np.pi - 0.3] = HOLD  # the pilot ends the turn
    return command, mode


def _log(
    hull: Hull, name: str, speed: float, command: np.ndarray, mode: np.ndarray, rng: np.random.Generator, *, sway: bool
) -> Log:
    h, count = hull.of, command.size
    settings = np.array([hull.rudder_limit, 0.35, hull.rudder_limit, 1.0, 1.2 * _passage(hull, speed)])
    keep = np.exp(-SAMPLE_S / GUST_TIME_S)
    size = GUST_SHARE * abs(h.rudder * h.fin_arm) * hull.rudder_limit * speed**2
    gust = np.zeros(count)
    for i in range(1, count):
        gust[i] = keep * gust[i - 1] + size * np.sqrt(1.0 - keep**2) * rng.standard_normal()
    states, given = fly(h, speed, command, mode, settings, SAMPLE_S, gust)
    u, v, r, heading, x, y = states.T
    noise = rng.standard_normal((6, count))
    columns = {
        "yaw_rad": heading + COMPASS * noise[0],
        "yaw_rate_rad_s": r + GYRO * noise[1],
        "surge_m_s": u + DVL * noise[2],
        "sway_m_s": v + DVL * noise[3],
        "x_m": x + FIX * noise[4],
        "y_m": y + FIX * noise[5],
        "rudder_rad": given,
    }
    if not sway:
        del columns["sway_m_s"]
    return Log(name, speed, SAMPLE_S * np.arange(count), columns)
