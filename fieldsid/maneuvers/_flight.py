"""Fly a maneuver against a plant, one sample at a time: run-up, excitation, recovery by the autopilot, limits kept."""

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
"""Commands a second, unless another rate is asked for."""


class Plant(Protocol):
    """What a maneuver is flown on: `size` vehicles side by side that start at rest about their trim."""

    @property
    def size(self) -> int:
        """How many vehicles there are."""
        ...

    def advance(self, fin: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
        """Hold the fins (m,) for `step` s and return angle (m,) and rate (m,) at its end, about the start."""
        ...


@dataclass(frozen=True, slots=True)
class Limits:
    """Largest fin angle about trim (rad) and fin rate (rad/s) that are ever commanded."""

    fin: float
    fin_rate: float = np.inf

    def __post_init__(self) -> None:
        if not (np.isfinite(self.fin) and self.fin > 0 and self.fin_rate > 0):
            raise UsageError(
                "fin limits must be above zero",
                found=f"fin {self.fin:g} rad, fin rate {self.fin_rate:g} rad/s",
                hint="set `fin_max_rad` and `fin_rate_max_rad_s` in vehicle.yaml",
            )


@dataclass(frozen=True, slots=True)
class Autopilot:
    """Brings the vehicle back: fin = -(angle_gain angle + rate_gain rate), at most `fin` rad, the shorter way round."""

    angle_gain: Annotated[float, Key("rad of fin per rad.")]
    rate_gain: Annotated[float, Key("rad of fin per rad/s.")]
    fin: float = np.inf

    @property
    def gains(self) -> FloatArray:
        """Return angle gain, rate gain and largest fin, (3,), as `steer` takes them."""
        return np.array([self.angle_gain, self.rate_gain, self.fin])


@inner
def within(fin: float, last: float, reach: float, low: float, high: float) -> float:
    """Return a fin moved to within `reach` of the last one, then to within its own limits."""
    return min(max(min(max(fin, last - reach), last + reach), low), high)


@inner
def steer(
    asked: float, angle: float, rate: float, last: float, gains: FloatArray, reach: float, low: float, high: float
) -> float:  # fmt: skip
    """Return the fin that is commanded: what is asked for, the autopilot's where that is NaN, moved into the limits.

    gains (3,) are the autopilot's, see `Autopilot.gains`; the other numbers are those of `within`.
    """
    fin = asked
    if np.isnan(asked):
        short = (angle + np.pi) % (2.0 * np.pi) - np.pi
        fin = min(max(-(gains[0] * short + gains[1] * rate), -gains[2]), gains[2])
    return within(fin, last, reach, low, high)


@jit
def steer_all(
    asked: FloatArray, angle: FloatArray, rate: FloatArray, last: FloatArray, gains: FloatArray, reach: float, most: float,
    fin: FloatArray, free: BoolArray,
) -> int:  # fmt: skip
    """Fill fin (m,) with what is commanded and free (m,) with where the autopilot commands it; return for how many it does."""
    count = 0
    for i in range(fin.shape[0]):
        free[i] = np.isnan(asked[i])
        count += free[i]
        fin[i] = steer(asked[i], angle[i], rate[i], last[i], gains, reach, -most, most)
    return count


@dataclass(frozen=True, slots=True)
class Flight:
    """A maneuver as flown: time (n,), fin, angle and rate (n, m), and which samples the autopilot had (n, m)."""

    time: FloatArray
    fin: FloatArray
    angle: FloatArray
    rate: FloatArray
    recovering: BoolArray
    excitation: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Schedule:
    """Seconds before the excitation and after it, and the sampling rate of the commands."""

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
) -> Flight:
    """Return the maneuver flown on a plant: fin over time within the limits, and the motion it made.

    A rule ends when every vehicle has finished it; the recovery follows. Raises UsageError when the maneuver is
    shorter than a sample.
    """
    schedule = schedule or Schedule()
    values, size = maneuver.checked(parameters), plant.size
    numbers, memory, gains = maneuver.vector(values), np.tile(np.array(maneuver.memory(values)), (size, 1)), autopilot.gains
    step, length = 1.0 / schedule.rate_hz, maneuver.duration(values)
    excite = max(length, step)
    count = end = round((schedule.run_up + excite + schedule.recover) * schedule.rate_hz) + 1
    fin, angle, rate = np.zeros((3, count, size))
    free, asked, last, done = np.zeros((count, size), dtype=bool), np.full(size, np.nan), np.zeros(size), False
    finish = schedule.run_up + excite
    for i in range(count):
        time = i * step
        since = time - schedule.run_up
        begun = since >= -1e-9
        if begun and maneuver.rule is not None:
            maneuver.rule(numbers, max(since, 0.0), angle[i], rate[i], memory, asked)
        elif begun and maneuver.command is not None:
            asked[:] = maneuver.command(values, np.array([since]))[0]
        given = steer_all(asked, angle[i], rate[i], last, gains, limits.fin_rate * step, limits.fin, fin[i], free[i])
        last = fin[i]
        if begun and not done and (since >= length - 1e-9 or (maneuver.rule is not None and given == size)):
            done, finish = True, time
            end = min(count, round((finish + schedule.recover) * schedule.rate_hz) + 1)
        if i >= end - 1:
            break
        angle[i + 1], rate[i + 1] = plant.advance(last, step)
    clock, excitation = np.arange(end, dtype=np.float64) * step, (schedule.run_up, finish)
    return Flight(clock, fin[:end], angle[:end], rate[:end], free[:end], excitation)
