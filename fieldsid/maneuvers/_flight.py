"""Fly a maneuver against a plant, one sample at a time: run-up, excitation, recovery by the autopilot, limits kept."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from fieldsid.errors import UsageError
from fieldsid.maneuvers._contract import Maneuver, Parameters
from fieldsid.numerics.arrays import FloatArray


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

    def apply(self, fin: FloatArray, last: FloatArray, step: float) -> FloatArray:
        """Return the fins (m,) moved into the limits, `last` being those of the sample before."""
        reach = self.fin_rate * step
        return _within(_within(fin, last - reach, last + reach) if np.isfinite(reach) else fin, -self.fin, self.fin)


@dataclass(frozen=True, slots=True)
class Autopilot:
    """Brings the vehicle back: fin = -(angle_gain angle + rate_gain rate), at most `fin` rad, the shorter way round."""

    angle_gain: float
    rate_gain: float
    fin: float = np.inf

    def command(self, angle: FloatArray, rate: FloatArray) -> FloatArray:
        """Return the fins (m,) for angles and rates (m,)."""
        short = np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi
        return _within(-(self.angle_gain * short + self.rate_gain * rate), -self.fin, self.fin)


def _within(values: FloatArray, low: FloatArray | float, high: FloatArray | float) -> FloatArray:
    """Return values no lower and no higher than these: a third of what np.clip takes for a few of them, at every sample."""
    return np.asarray(np.minimum(np.maximum(values, low), high))


@dataclass(frozen=True, slots=True)
class Flight:
    """A maneuver as flown: time (n,), fin, angle and rate (n, m), and which samples the autopilot had (n, m)."""

    time: FloatArray
    fin: FloatArray
    angle: FloatArray
    rate: FloatArray
    recovering: npt.NDArray[np.bool_]
    excitation: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Schedule:
    """Seconds before the excitation and after it, and the sampling rate of the commands."""

    rate_hz: float = 20.0
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
    values = maneuver.checked(parameters)
    step = 1.0 / schedule.rate_hz
    excite = max(maneuver.duration(values), step)
    count = round((schedule.run_up + excite + schedule.recover) * schedule.rate_hz) + 1
    log = _Log(count, plant.size)
    asked = _Asked(maneuver, values, schedule.run_up, plant.size)
    angle = rate = last = np.zeros(plant.size)
    end = count
    for i in range(count):
        time = i * step
        fin, free = asked.at(time, angle, rate)
        wanted = np.where(free, autopilot.command(angle, rate), fin) if free.any() else fin
        last = limits.apply(wanted, last, step)
        log.put(i, last, angle, rate, free)
        if asked.done is not None and i >= (end := min(count, round((asked.done + schedule.recover) * schedule.rate_hz) + 1)) - 1:
            break
        angle, rate = plant.advance(last, step)
    finish = asked.done if asked.done is not None else schedule.run_up + excite
    return log.flight(end, step, (schedule.run_up, finish))


class _Log:
    """Arrays that are filled sample by sample."""

    def __init__(self, count: int, size: int) -> None:
        self.values = np.zeros((3, count, size))
        self.free = np.zeros((count, size), dtype=bool)

    def put(self, i: int, fin: FloatArray, angle: FloatArray, rate: FloatArray, free: npt.NDArray[np.bool_]) -> None:
        self.values[0, i], self.values[1, i], self.values[2, i] = fin, angle, rate
        self.free[i] = free

    def flight(self, end: int, step: float, excitation: tuple[float, float]) -> Flight:
        kept = self.values[:, :end]
        return Flight(np.arange(end, dtype=np.float64) * step, kept[0], kept[1], kept[2], self.free[:end], excitation)


class _Asked:
    """What the maneuver asks for at a time: the fins, and where the autopilot has them."""

    def __init__(self, maneuver: Maneuver, values: Parameters, start: float, size: int) -> None:
        self.maneuver, self.values, self.start, self.size = maneuver, values, start, size
        self.memory = np.tile(np.array(maneuver.memory(values)), (size, 1))
        self.length = maneuver.duration(values)
        self.done: float | None = None

    def at(self, time: float, angle: FloatArray, rate: FloatArray) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
        since = time - self.start
        if since < -1e-9:
            return np.zeros(self.size), np.ones(self.size, dtype=bool)
        fin = self._fin(since, angle, rate)
        free = np.isnan(fin)
        if self.done is None and (since >= self.length - 1e-9 or (self.maneuver.rule is not None and bool(free.all()))):
            self.done = time
        return fin, free

    def _fin(self, since: float, angle: FloatArray, rate: FloatArray) -> FloatArray:
        if self.maneuver.rule is not None:
            fin, self.memory = self.maneuver.rule(self.values, max(since, 0.0), angle, rate, self.memory)
            return fin
        if self.maneuver.command is None:
            raise UsageError(f"maneuver `{self.maneuver.name}` has neither a command nor a rule")
        return np.full(self.size, self.maneuver.command(self.values, np.array([since]))[0])
