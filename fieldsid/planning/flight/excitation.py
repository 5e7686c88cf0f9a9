"""A candidate: a maneuver with its parameters, and how it is laid into a window of run-up, excitation and recovery."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from fieldsid.errors import UsageError
from fieldsid.maneuvers import RATE_HZ, Autopilot, Limits, Maneuver, Schedule, pick_maneuver, spec_of
from fieldsid.numerics.arrays import FloatArray
from fieldsid.planning.flight.operating_point import OperatingPoint
from fieldsid.planning.flight.rule_flight import Response, fly_fins, fly_operating_points, plant_of
from fieldsid.records.keys import Key

LONGEST_WINDOW_S = 300.0
"""No maneuver of the catalogue has a longer period."""


@dataclass(frozen=True, slots=True)
class Window:
    """The part of a leg that is identified on: `lead` s steady, the excitation, at least `recover` s; `length` s in all."""

    length: Annotated[float, Key("Its length.", "length_s")] = 33.0
    lead: Annotated[float, Key("Straight run at its start.", "lead_s")] = 2.0
    recover: Annotated[float, Key("Recovery at its end.", "recover_s")] = 5.0
    rate_hz: float = RATE_HZ

    @property
    def excitation(self) -> float:
        """Seconds there are for the excitation."""
        return self.length - self.lead - self.recover

    @property
    def shortest(self) -> float:
        """Seconds that a window with this lead and recovery takes at least."""
        return self.lead + self.recover + 2.0

    @property
    def time(self) -> FloatArray:
        """Sample times (n,) in s from the window's start."""
        return np.arange(round(self.length * self.rate_hz) + 1) / self.rate_hz

    def __post_init__(self) -> None:
        if not (0.1 <= self.rate_hz <= 1000.0):
            raise UsageError(
                f"a command rate of {self.rate_hz:g} Hz cannot be right",
                found=f"--rate {self.rate_hz:g}",
                hint="for example `--rate 20`",
            )
        if not self.length <= LONGEST_WINDOW_S:
            raise UsageError(
                f"a window of {self.length:g} s cannot be meant",
                found=f"--window {self.length:g}, at most {LONGEST_WINDOW_S:g} s",
                hint="for example `--window 33`",
            )
        if self.length < self.shortest:
            raise UsageError(
                f"a window of {self.length:g} s leaves {max(self.excitation, 0.0):g} s for the excitation",
                found=f"{self.lead:g} s before it and {self.recover:g} s after it",
                hint=f"give `--window {self.lead + self.recover + 10:g}` or more",
            )


@dataclass(frozen=True, slots=True)
class Excitation:
    """A maneuver by name with all its parameters."""

    maneuver: Annotated[str, Key("The maneuver.")]
    parameters: Annotated[Mapping[str, float], Key("Its parameters.")]

    @property
    def record(self) -> Maneuver:
        """The maneuver's own record."""
        return pick_maneuver(self.maneuver)

    @property
    def spec(self) -> str:
        """The text that `maneuvers.parse_spec` reads back."""
        return spec_of(self.record, self.parameters)

    @property
    def duration(self) -> float:
        """Seconds of excitation, for a rule at most."""
        return self.record.duration(self.parameters)

    def with_(self, **changes: float) -> Excitation:
        """Return the candidate with some parameters changed; raises UsageError when they are out of bounds."""
        return replace(self, parameters=self.record.checked({**self.parameters, **changes}))

    def stretched(self, factor: float) -> Excitation:
        """Return the candidate with every time it may choose multiplied by a factor, frequencies divided, inside their bounds."""
        powers = {"s": factor, "Hz": 1.0 / factor}
        moved = {
            p.name: float(np.clip(self.parameters[p.name] * powers[p.unit], p.low, p.high))
            for p in self.record.parameters
            if p.tuned and p.unit in powers
        }
        return self.with_(**moved)


def asked_of(candidate: Excitation, window: Window) -> FloatArray:
    """Return the command an open-loop candidate asks for over a window, (n,) rad about trim, NaN for the autopilot."""
    time = window.time
    command = candidate.record.command
    if command is None:
        raise UsageError(f"maneuver `{candidate.maneuver}` follows the motion: it has no command of its own")
    asked = command(candidate.parameters, time - window.lead)
    steered = (time < window.lead - 1e-9) | (time >= window.length - window.recover - 1e-9)
    return np.where(steered, np.nan, asked)


def flown(scene: OperatingPoint, candidate: Excitation, window: Window, limits: Limits, autopilot: Autopilot) -> Response:
    """Return a candidate flown on one scene over a window."""
    return flown_all([scene], candidate, window, limits, autopilot)[0]


def flown_all(
    scenes: Sequence[OperatingPoint], candidate: Excitation, window: Window, limits: Limits, autopilot: Autopilot
) -> list[Response]:
    """Return a candidate flown on several scenes, one response each."""
    time = window.time
    if candidate.record.rule is None:
        plant = plant_of(scenes, time.size, window.rate_hz, None)
        columns = fly_fins(scenes, plant, time, asked_of(candidate, window), limits, autopilot)
    else:
        schedule = Schedule(window.rate_hz, window.lead, window.recover)
        flight = fly_operating_points(
            scenes, candidate.record, candidate.parameters, limits=limits, autopilot=autopilot, schedule=schedule
        )
        time, columns = flight.time[: time.size], (flight.fin, flight.angle, flight.rate)
    return [Response(time, *(c[: time.size, i].copy() for c in columns)) for i in range(len(scenes))]


def fits(candidate: Excitation, window: Window) -> bool:
    """Whether an open-loop candidate ends before the recovery begins, or may be cut there without harm."""
    return candidate.record.rule is not None or candidate.duration <= window.excitation + 1e-6
