"""Simulation of a maneuver on a plant, one sample at a time: run-up, excitation, recovery by the autopilot, within limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np

from fieldsid.errors import UsageError
from fieldsid.maneuvers._contract import Maneuver, Parameters
from fieldsid.numerics.arrays import BoolArray, FloatArray
from fieldsid.numerics.jit import inner, jit
from fieldsid.records.keys import Key

RATE_HZ = 20.0
"""Default rate of the commands."""


class Plant(Protocol):
    """The plant of a maneuver: `size` independent vehicles that start at rest about their trim."""

    @property
    def size(self) -> int:
        """Number of vehicles."""
        ...

    @property
    def trim(self) -> FloatArray:
        """Fin angle of straight flight (m,), rad, about which fins are given."""
        ...

    def advance(self, fin: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
        """Advance by `step` s with constant fins (m,); return angle (m,), relative to the start, and rate (m,)."""
        ...


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of the commanded fin angle, its trim included (rad), and of its rate (rad/s)."""

    fin: float
    fin_rate: float = np.inf

    def __post_init__(self) -> None:
        if not (np.isfinite(self.fin) and self.fin > 0 and self.fin_rate > 0):
            raise UsageError(
                "fin limits must be above zero",
                found=f"fin {self.fin:g} rad, fin rate {self.fin_rate:g} rad/s",
                hint="set `fin_max_rad` and `fin_rate_max_rad_s` in vehicle.yaml",
            )

    def about(self, trim: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the lowest and the highest fin (m,) about trim angles (m,), rad; the trim itself is within them."""
        return np.minimum(-self.fin - trim, 0.0), np.maximum(self.fin - trim, 0.0)

    def rows(self, trim: FloatArray) -> FloatArray:
        """Return lowest and highest fin, largest rate and trim of vehicles with trim angles (m,), (m, 4), for a kernel."""
        return np.column_stack([*self.about(trim), np.full(trim.size, self.fin_rate), trim])


@dataclass(frozen=True, slots=True)
class Autopilot:
    """Feedback to the initial angle: fin = -(angle_gain angle + rate_gain rate), at most `fin` rad, by the shorter turn."""

    angle_gain: Annotated[float, Key("rad of fin per rad.")]
    rate_gain: Annotated[float, Key("rad of fin per rad/s.")]
    fin: float = np.inf

    @property
    def gains(self) -> FloatArray:
        """Return angle gain, rate gain and largest fin, (3,), for `steer`."""
        return np.array([self.angle_gain, self.rate_gain, self.fin])


@inner
def within(fin: float, last: float, reach: float, low: float, high: float) -> float:
    """Return a fin angle limited to within `reach` of the last one, then to low .. high."""
    return min(max(min(max(fin, last - reach), last + reach), low), high)


@inner
def steer(
    command: float, angle: float, rate: float, last: float, gains: FloatArray, reach: float, low: float, high: float
) -> float:  # fmt: skip
    """Return the fin command within its limits: that of the maneuver, or of the autopilot where that is NaN.

    gains (3,) are those of `Autopilot.gains`; last, reach, low and high those of `within`.
    """
    fin = command
    if np.isnan(command):
        short = (angle + np.pi) % (2.0 * np.pi) - np.pi
        fin = min(max(-(gains[0] * short + gains[1] * rate), -gains[2]), gains[2])
    return within(fin, last, reach, low, high)


@jit
def steer_all(
    command: FloatArray, angle: FloatArray, rate: FloatArray, last: FloatArray, gains: FloatArray, reach: float,
    low: FloatArray, high: FloatArray, fin: FloatArray, free: BoolArray,
) -> int:  # fmt: skip
    """Fill fin (m,) with the limited commands and free (m,) with whether the autopilot steers; return how many it steers."""
    count = 0
    for i in range(fin.shape[0]):
        free[i] = np.isnan(command[i])
        count += free[i]
        fin[i] = steer(command[i], angle[i], rate[i], last[i], gains, reach, low[i], high[i])
    return count


@dataclass(frozen=True, slots=True)
class Flight:
    """The simulation of a maneuver: time (n,), fin, angle and rate (n, m), and whether the autopilot steers (n, m)."""

    time: FloatArray
    fin: FloatArray
    angle: FloatArray
    rate: FloatArray
    recovering: BoolArray
    excitation: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Schedule:
    """Times before and after the excitation in s, and the sampling rate of the commands."""

    rate_hz: float = RATE_HZ
    run_up: float = 2.0
    recover: float = 10.0


def fly(
    maneuver: Maneuver,
    parameters: Parameters,
    plant: Plant,
    *,
    limits: Limits,
    autopilot: Autopilot,
    schedule: Schedule | None = None,
    samples: int | None = None,
) -> Flight:
    """Return the simulation of a maneuver on a plant: the fin within its limits, and the motion; at most `samples` samples.

    A rule ends when every vehicle has finished it; the recovery follows.
    """
    schedule = schedule or Schedule()
    values, size = maneuver.checked(parameters), plant.size
    numbers, memory, gains = maneuver.vector(values), np.tile(np.array(maneuver.memory(values)), (size, 1)), autopilot.gains
    (low, high), step, length = limits.about(plant.trim), 1.0 / schedule.rate_hz, maneuver.duration(values)
    excite = max(length, step)
    count = round((schedule.run_up + excite + schedule.recover) * schedule.rate_hz) + 1
    count = end = count if samples is None else min(count, samples)
    fin, angle, rate = np.zeros((3, count, size))
    free, command, last, done = np.zeros((count, size), dtype=bool), np.full(size, np.nan), np.zeros(size), False
    finish = schedule.run_up + excite
    for i in range(count):
        time = i * step
        since = time - schedule.run_up
        begun = since >= -1e-9
        if begun and maneuver.rule is not None:
            maneuver.rule(numbers, max(since, 0.0), angle[i], rate[i], memory, command)
        elif begun and maneuver.command is not None:
            command[:] = maneuver.command(values, np.array([since]))[0]
        steered = steer_all(command, angle[i], rate[i], last, gains, limits.fin_rate * step, low, high, fin[i], free[i])
        last = fin[i]
        if begun and not done and (since >= length - 1e-9 or (maneuver.rule is not None and steered == size)):
            done, finish = True, time
            end = min(count, round((finish + schedule.recover) * schedule.rate_hz) + 1)
        if i >= end - 1:
            break
        angle[i + 1], rate[i + 1] = plant.advance(last, step)
    clock, excitation = np.arange(end, dtype=np.float64) * step, (schedule.run_up, finish)
    return Flight(clock, fin[:end], angle[:end], rate[:end], free[:end], excitation)
