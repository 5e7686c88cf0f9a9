"""An excitation: a maneuver with its parameters, and its place in a window of run-up, excitation and recovery."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from fieldsid.errors import UsageError
from fieldsid.maneuvers import RATE_HZ, Autopilot, Limits, Maneuver, Schedule, pick_maneuver, spec_of
from fieldsid.numerics.arrays import FloatArray
from fieldsid.planning.flight.operating_point import OperatingPoint
from fieldsid.planning.flight.rule_flight import OperatingPointPlant, Response, fly_fins, fly_maneuver, plant_of
from fieldsid.records.keys import Key

LONGEST_WINDOW_S = 300.0
"""Longest window, the longest period of a maneuver in the catalogue."""


@dataclass(frozen=True, slots=True)
class Window:
    """The part of a leg used for identification: `lead` s straight, the excitation, at least `recover` s; `length` s in all."""

    length: Annotated[float, Key("Its length.", "length_s")] = 33.0
    lead: Annotated[float, Key("Straight run at its start.", "lead_s")] = 2.0
    recover: Annotated[float, Key("Recovery at its end.", "recover_s")] = 5.0
    rate_hz: float = RATE_HZ

    @property
    def excitation(self) -> float:
        """Time available for the excitation, s."""
        return self.length - self.lead - self.recover

    @property
    def shortest(self) -> float:
        """Least length of a window with this lead and recovery, s."""
        return self.lead + self.recover + 2.0

    @property
    def schedule(self) -> Schedule:
        """The same for the flight of a rule."""
        return Schedule(self.rate_hz, self.lead, self.recover)

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
        """The record of the maneuver."""
        return pick_maneuver(self.maneuver)

    @property
    def spec(self) -> str:
        """The text of the excitation, which `maneuvers.parse_spec` reads."""
        return spec_of(self.record, self.parameters)

    @property
    def duration(self) -> float:
        """Duration of the excitation in s, for a rule the longest possible."""
        return self.record.duration(self.parameters)

    def with_(self, **changes: float) -> Excitation:
        """Return the candidate with some parameters changed; raises UsageError when they are out of bounds."""
        return replace(self, parameters=self.record.checked({**self.parameters, **changes}))

    def stretched(self, factor: float) -> Excitation:
        """Return the candidate with its tuned times multiplied by a factor and its frequencies divided, within their bounds."""
        factors = {"s": factor, "Hz": 1.0 / factor}
        scaled = {
            p.name: float(np.clip(self.parameters[p.name] * factors[p.unit], p.low, p.high))
            for p in self.record.parameters
            if p.tuned and p.unit in factors
        }
        return self.with_(**scaled)


def fin_command(candidate: Excitation, window: Window) -> FloatArray:
    """Return the fin command of an open-loop candidate over a window, (n,) rad about trim, NaN where the autopilot steers."""
    time = window.time
    command = candidate.record.command
    if command is None:
        raise UsageError(f"maneuver `{candidate.maneuver}` follows the motion: it has no command of its own")
    fin = command(candidate.parameters, time - window.lead)
    steered = (time < window.lead - 1e-9) | (time >= window.length - window.recover - 1e-9)
    return np.where(steered, np.nan, fin)


def fly_window(
    plant: OperatingPointPlant, candidate: Excitation | FloatArray, window: Window, limits: Limits, autopilot: Autopilot
) -> tuple[FloatArray, FloatArray, FloatArray]:  # fmt: skip
    """Return command, angle and rate (k, m) of a plant under a candidate, for at most the length of a window.

    In place of a candidate it may be a list of fin angles about trim (rad, NaN for the autopilot, which steers after its end).
    `plant` is over the window.
    """
    if not isinstance(candidate, Excitation) or candidate.record.rule is None:
        fins = fin_command(candidate, window) if isinstance(candidate, Excitation) else _filled(candidate, window)
        command, angle, rate = fly_fins(plant, fins, limits, autopilot)
        return command, angle, rate
    flight = fly_maneuver(
        plant, candidate.record, candidate.parameters, limits=limits, autopilot=autopilot, schedule=window.schedule
    )
    return flight.fin, flight.angle, flight.rate


def _filled(fins: FloatArray, window: Window) -> FloatArray:
    """Return a list of fin angles over a window, NaN after its end."""
    return np.append(fins, np.full(window.time.size, np.nan))[: window.time.size]


def flown(scene: OperatingPoint, candidate: Excitation, window: Window, limits: Limits, autopilot: Autopilot) -> Response:
    """Return the response of one operating point to a candidate over a window."""
    return flown_all([scene], candidate, window, limits, autopilot)[0]


def flown_all(
    scenes: Sequence[OperatingPoint], candidate: Excitation, window: Window, limits: Limits, autopilot: Autopilot
) -> list[Response]:
    """Return the responses of several operating points to a candidate over a window."""
    plant = plant_of(scenes, window.time.size, window.rate_hz)
    columns = fly_window(plant, candidate, window, limits, autopilot)
    time = window.time[: columns[0].shape[0]]
    return [Response(time, *(c[:, i].copy() for c in columns)) for i in range(len(scenes))]


def fits(candidate: Excitation, window: Window) -> bool:
    """Whether an open-loop candidate ends before the recovery begins, or may be cut there without harm."""
    return candidate.record.rule is not None or candidate.duration <= window.excitation + 1e-6
