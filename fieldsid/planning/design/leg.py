"""A leg of a plan: one maneuver at one speed, its expected errors, its duration, and its abort conditions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Annotated, Literal

import numpy as np

from fieldsid.display import Brief
from fieldsid.maneuvers import Autopilot, within
from fieldsid.numerics.arrays import FloatArray
from fieldsid.planning.flight.excitation import Excitation, Window, fin_command
from fieldsid.planning.safety.envelope import Envelope, Excursion
from fieldsid.records.keys import INLINE, Key, Number
from fieldsid.rounding import number

CIRCLE = "turn radius"
"""The purpose of a leg that is a circle."""
TURN_LAG = math.log(10.0)
"""Time constants to 90 % of a turn's rate (the paper's u-turn)."""
LARGEST_SHARE = 0.5
"""Relative standard error from which on a value is not significantly different from zero."""


@dataclass(frozen=True, slots=True)
class Expected:
    """The expected accuracy of a parameter: value, standard error, and its 5/6 quantile over draws of the prior.

    `relative` is the standard error over the scale of the parameter (`belief.prior_model.scales_of`).
    """

    value: Annotated[float, Key("The value that is believed, at the leg's speed.")]
    std_error: Annotated[Number, Key("Expected standard error.")]
    std_error_high: Annotated[Number, Key("The error that five of six draws of what is believed stay below.")]
    relative: Annotated[Number, Key("Standard error over the value; of a trim over a typical one.")]
    baseline: Annotated[Number, Key("Standard error that the usual pulses of the same length give.")] = float("nan")

    def over(self, passes: int) -> Expected:
        """Return the expected accuracy after several passes."""
        root = float(np.sqrt(passes))
        return Expected(self.value, self.std_error / root, self.std_error_high / root, self.relative / root, self.baseline)


def error_in_words(value: float, std_error: float, relative: float) -> str:
    """Return a standard error in words: in per cent where its scale is the value and it is significant, else in its unit."""
    of_value = np.isclose(relative * abs(value), std_error, rtol=1e-6, atol=0.0)
    return f"{100.0 * relative:.1f} %" if of_value and relative < LARGEST_SHARE else f"+/- {number(std_error, 2)}"


@dataclass(frozen=True, slots=True, repr=False)
class Leg(Brief):
    """One maneuver at one speed (m/s), flown `passes` times: run-up, window, turn back.

    `expected` is for all passes together. `excursions` are 95 % quantiles over the prior (rad, m). `nominal` (n,) is the fin
    angle about trim in rad that a rule commands for the prior's mean, NaN where the autopilot steers; `replay_risk` is the
    probability that these commands, flown open loop, leave the envelope. `heading` (rad) replaces the heading limit of the plan.
    """

    speed: Annotated[float, Key("Speed through the water.", "speed_m_s")]
    candidate: Annotated[Excitation, INLINE]
    window: Annotated[Window, Key("The part that is identified on.")]
    run_up_s: Annotated[float, Key("Straight run before the window.")]
    turn_s: Annotated[float, Key("Time to turn at the end.")]
    autopilot: Annotated[Autopilot, Key("Who steers where the maneuver does not.")]
    expected: Annotated[Mapping[str, Expected], Key("By parameter, what it will be known to.")]
    excursions: Annotated[Mapping[str, float], Key("What the flight reaches.", of=Excursion)]
    break_probability: Annotated[float, Key("Probability of leaving the envelope.")]
    passes: Annotated[int, Key("How many times it is flown.")] = 1
    purpose: Annotated[str, Key("`parameters`, `turn radius`, or the effects it separates.")] = "parameters"
    heading: Annotated[
        float | None, Key("Largest deviation of heading on this leg; null where it is not limited.", "heading_limit_rad")
    ] = None
    replay_risk: float = float("nan")
    nominal: FloatArray = field(default_factory=lambda: np.zeros(0))
    alternatives: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def rate_hz(self) -> Annotated[float, Key()]:
        """The vehicle's command rate."""
        return self.window.rate_hz

    @property
    def replay_break_probability(self) -> Annotated[float | None, Key(is_optional=True)]:
        """The same where the fin of a maneuver that follows the motion is flown from a list."""
        return None if self.open_loop else self.replay_risk

    @property
    def expected_fin(self) -> Annotated[tuple[Number, ...] | None, Key(name="expected_fin_rad", is_optional=True)]:
        """The fin expected at each sample of a maneuver that follows the motion; null where the autopilot steers."""
        return None if self.open_loop else tuple(round(float(v), 5) for v in self.nominal)

    @property
    def pass_s(self) -> float:
        """Duration of one pass in s: run-up, window and the turn to the next."""
        return self.run_up_s + self.window.length + self.turn_s

    @property
    def duration_s(self) -> Annotated[float, Key()]:
        """Seconds of all passes."""
        return self.passes * self.pass_s

    @property
    def distance_m(self) -> Annotated[float, Key()]:
        """Metres through the water of all passes."""
        return self.duration_s * self.speed

    def envelope_in(self, envelope: Envelope) -> Envelope:
        """Return the envelope of a plan with this leg's heading limit."""
        return envelope if self.heading is None else replace(envelope, heading=self.heading)

    def flown_from_list_in(self, envelope: Envelope) -> bool:
        """Whether it can be flown as a list of fin angles: it is open loop, or the replay of its rule has an accepted risk."""
        return self.open_loop or self.replay_risk <= envelope.share

    @property
    def open_loop(self) -> bool:
        """Whether the command is known before the flight."""
        return self.candidate.record.rule is None


def commands_of(leg: Leg, envelope: Envelope) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return time (n,) s, fin angle about trim (n,) rad within the limits, and 1 where the autopilot steers (n,).

    For a rule the fin angle is the one for the prior's mean. The angle and rate limits of the envelope are applied here, whatever
    a plan contains.
    """
    time = leg.window.time
    limits = envelope.limits
    if leg.open_loop:
        command = fin_command(leg.candidate, leg.window)
    else:
        command = np.full(time.size, np.nan)
        n = min(time.size, leg.nominal.size)
        command[:n] = leg.nominal[:n]
    steered = np.isnan(command)
    command = np.where(steered, 0.0, command)
    fin = np.empty(time.size)
    last, reach = 0.0, limits.fin_rate / leg.window.rate_hz
    for i in range(time.size):
        fin[i] = last = within(command[i], last, reach, -limits.fin, limits.fin)
    return time, fin, steered.astype(np.float64)


def turn_back_s(damping: float, authority: float, fin: float) -> float:
    """Return the duration (s) of a u-turn at a fin angle d: pi a / (b d) + 2.31 / a (the paper's formula), at most 120 s."""
    if damping <= 0.02:
        return 120.0
    return float(min(np.pi * damping / (abs(authority) * fin) + TURN_LAG / damping, 120.0))


GRACE_S = 5.0
SLOWEST_SHARE = 0.6


@dataclass(frozen=True, slots=True)
class Abort:
    """An abort condition: a signal exceeds `limit`. `kind` is deviation (from the value at the start), below, above or time."""

    signal: Annotated[str, Key("The signal, or `time_s`.")]
    kind: Annotated[str, Key("How it is compared.", of=Literal["deviation", "below", "above", "time"])]
    limit: Annotated[float, Key("The limit.")]
    unit: Annotated[str, Key("Its unit.")]
    says: Annotated[str, Key("In words.")]


def aborts_of(leg: Leg, envelope: Envelope) -> tuple[Abort, ...]:
    """Return the abort conditions of a leg, one for each limit, the time first."""
    limits = leg.envelope_in(envelope)
    found = [
        Abort("time_s", "time", leg.window.length + GRACE_S, "s", "the window is over"),
        Abort("surge_m_s", "below", SLOWEST_SHARE * leg.speed, "m/s", "too slow to steer as planned"),
    ]
    tilts = (("yaw_rad", limits.heading, "heading"), ("pitch_rad", limits.pitch, "pitch"), ("roll_rad", limits.roll, "roll"))
    for signal, limit, says in tilts:
        if limit is not None:
            found.append(Abort(signal, "deviation", limit, "rad", f"{says} left the envelope"))
    if limits.depth_low is not None and limits.depth_high is not None:
        found.append(Abort("depth_m", "above", limits.depth_high, "m", "too deep"))
        found.append(Abort("depth_m", "below", limits.depth_low, "m", "too shallow"))
    return (*found, *_position_aborts(leg, limits))


def _position_aborts(leg: Leg, limits: Envelope) -> tuple[Abort, ...]:
    """Return the conditions on the position: x along the leg from the window's start, y to starboard of its line."""
    found = []
    sides = [s for s in (limits.track, None if limits.area_width is None else 0.5 * limits.area_width) if s is not None]
    if sides:
        found.append(Abort("y_m", "deviation", min(sides), "m", "too far from the leg's line"))
    if limits.area_length is not None:
        run_up = leg.run_up_s * leg.speed
        found.append(Abort("x_m", "above", limits.area_length - run_up, "m", "beyond the end of the area"))
        found.append(Abort("x_m", "below", -run_up, "m", "behind the start of the area"))
    return tuple(found)
