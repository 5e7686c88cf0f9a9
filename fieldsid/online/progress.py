"""The progress of a live estimate towards the accuracy wanted, whether it has settled, and whether the fin excites the motion.

With information I = 1/se^2 of a parameter, the share gathered is I / I_goal = (se_goal / se)^2. The growth of I over the last
seconds gives the time that the rest takes at the same excitation. A parameter has settled where it has stayed, over those
seconds, within 5 % of its value or within one standard error.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, isfinite, nan, sqrt
from typing import Annotated, Any, Literal

import numpy as np

from fieldsid.models.axis import NAMES, Axis
from fieldsid.online.estimate import OnlineEstimate
from fieldsid.records.keys import Key, Number
from fieldsid.records.saved_state import restored, state_of
from fieldsid.settled import settled_band

Verdict = Literal["starting", "contradicts", "collecting", "not_excited", "moving", "enough"]
DEFAULT_ACCURACY = 0.05
"""Default goal: the relative standard error of damping, stiffness and authority."""
LOOK_BACK_S = 10.0
"""Time over which a parameter must stay constant to have settled, and over which the growth of information is measured."""
MIN_WEIGHT = 0.2
"""Sum of weights, reached after two seconds, from which on a root mean square is given."""
QUIET_FIN_RAD = 0.005
"""Root mean square of the fin about its mean (0.3 deg) over the last seconds below which it does not excite the motion."""


@dataclass(frozen=True, slots=True)
class Goal:
    """The standard error wanted of a parameter: in its unit, or as a share of its value."""

    std_error: float = nan
    relative: float = nan

    def error_at(self, value: float) -> float:
        """Return the standard error that is wanted at a value, NaN where there is no goal or no value."""
        return self.std_error if isfinite(self.std_error) else self.relative * abs(value)


@dataclass(frozen=True, slots=True)
class ParameterProgress:
    """One parameter: value, standard error, the error wanted (NaN: none), share of information gathered, settled or not."""

    name: str
    value: Annotated[Number, Key("Its value.")]
    std_error: Annotated[Number, Key("Its standard error.")]
    goal: Annotated[Number, Key("The standard error that is wanted; null where none is.", "goal_std_error")]
    share: Annotated[float, Key("Share of the information for that which is in, 0 to 1.")]
    is_settled: Annotated[
        bool, Key("Whether it stayed, the last 10 s, within 5 % of its value or one standard error.", "settled")
    ]


@dataclass(frozen=True, slots=True)
class Progress:
    """The progress of the estimate.

    `share` is the least share of the parameters that have a goal, `limited_by` the name of that parameter, `left_s` the time to
    the goal at the pace of the last seconds (inf where the information does not grow, NaN where unknown). `fin_rms` (rad) and
    `rate_rms` (rad/s) are the excitation of the last seconds, `contradiction` says how angle and rate contradict each other.
    """

    verdict: Verdict
    share: float
    limited_by: str
    left_s: float
    fin_rms: float
    rate_rms: float
    parameters: tuple[ParameterProgress, ...]
    contradiction: str = ""

    @property
    def is_settled(self) -> bool:
        """Whether every parameter that has a goal is settled."""
        return all(p.is_settled for p in self.parameters if isfinite(p.goal))


def default_goals(axis: Axis) -> dict[str, Goal]:
    """Return a relative goal for damping, stiffness and authority; a trim may be zero and has none."""
    names = NAMES[axis]
    return {n: Goal(relative=DEFAULT_ACCURACY) for n in names.base if n != names.trim}


class RecentExcitation:
    """Root mean square of fin and rate about their means over the last seconds, by exponential averages."""

    STATE = __slots__ = ("_means", "_squares", "_time", "_weights")

    def __init__(self) -> None:
        self._time = nan
        self._weights, self._means, self._squares = np.zeros((3, 2))

    def hear(self, time: float, fin: float, rate: float) -> None:
        """Add a sample of fin in rad and rate in rad/s; a value that is not finite is ignored."""
        step = time - self._time if isfinite(self._time) else 0.0
        self._time = time
        share = min(max(step, 0.0) / LOOK_BACK_S, 1.0) if isfinite(step) else 0.0
        for i, value in enumerate((fin, rate)):
            if isfinite(value):
                self._weights[i] += share * (1.0 - self._weights[i])
                self._means[i] += share * (value - self._means[i])
                self._squares[i] += share * (value * value - self._squares[i])

    def rms(self) -> tuple[float, float]:
        """Return the root mean squares of fin and rate, NaN in the first two seconds."""
        return self._rms(0), self._rms(1)

    def _rms(self, channel: int) -> float:
        weight = self._weights[channel]
        if weight < MIN_WEIGHT:
            return nan
        mean = self._means[channel] / weight
        return sqrt(max(float(self._squares[channel] / weight - mean * mean), 0.0))


class Watch:
    """The progress of an estimate that is looked at repeatedly; keeps the looks of the last seconds only.

    A look is the time of an estimate, that of its last jump (s, zero for none), its values and their standard errors.
    """

    STATE = ("_looks", "excitation")
    __slots__ = ("goals", *STATE)

    def __init__(self, goals: Mapping[str, Goal]) -> None:
        self.goals = dict(goals)
        self.excitation = RecentExcitation()
        self._looks: list[tuple[float, ...]] = []

    def state(self) -> dict[str, Any]:
        """Return the looks of the last seconds as plain values, so that a program that was killed can continue with them."""
        state: dict[str, Any] = state_of(self)
        return state

    def forget(self) -> None:
        """Delete all looks, as they are of another source."""
        self.excitation = RecentExcitation()
        self._looks.clear()

    def recall(self, state: Mapping[str, Any], axis: Axis) -> None:
        """Restore the looks of a state of the same source; raises ValueError where they are not of this axis."""
        if wrong := [look for look in state["looks"] if len(look) != 2 + 2 * len(NAMES[axis].base)]:
            raise ValueError(f"{len(wrong)} looks of other parameters")
        restored(self, state)

    def look(self, now: OnlineEstimate) -> Progress:
        """Return the progress of an estimate, from its errors and from the looks of the last seconds."""
        looks, jumped = self._looks, 0.0 if now.jump is None else now.jump.time
        if looks and not (looks[-1][0] <= now.time and looks[-1][1] == jumped):
            looks.clear()
        while len(looks) > 1 and looks[1][0] <= now.time - LOOK_BACK_S:
            looks.pop(0)
        if not looks or now.time - looks[-1][0] >= LOOK_BACK_S / 20.0:
            looks.append((now.time, jumped, *now.values.values(), *now.std_errors.values()))
        known = tuple(self._progress_of(name, now) for name in now.values)
        wanted = [p for p in known if p.name in self.goals]
        least = min(wanted, key=lambda p: p.share, default=None)
        fin, rate = self.excitation.rms()
        if now.contradiction:
            return Progress("contradicts", 0.0, "", nan, fin, rate, known, now.contradiction)
        left = self._seconds_to_goal(least, now) if least else nan
        share = least.share if least else 0.0
        return Progress(self._verdict(known, share, fin), share, least.name if least else "", left, fin, rate, known)

    def _progress_of(self, name: str, now: OnlineEstimate) -> ParameterProgress:
        value, error = now.values[name], now.std_errors[name]
        goal = self.goals[name].error_at(value) if name in self.goals else nan
        share = min((goal / error) ** 2, 1.0) if isfinite(goal) and isfinite(error) and error > 0.0 else 0.0
        return ParameterProgress(name, value, error, goal, share, self._is_settled(name, now))

    def _is_settled(self, name: str, now: OnlineEstimate) -> bool:
        value, error = now.values[name], now.std_errors[name]
        if not isfinite(error) or now.time - self._looks[0][0] < 0.95 * LOOK_BACK_S:
            return False
        band = settled_band(value, error)
        place = 2 + list(now.values).index(name)
        return all(abs(look[place] - value) <= band for look in self._looks)

    def _seconds_to_goal(self, least: ParameterProgress, now: OnlineEstimate) -> float:
        """Return the seconds until the limiting parameter reaches its goal, at the present growth of its information."""
        then, *numbers = self._looks[0]
        before = numbers[1 + len(now.values) + list(now.values).index(least.name)]
        if least.share >= 1.0:
            return 0.0
        if not (isfinite(before) and isfinite(least.std_error) and isfinite(least.goal) and now.time > then):
            return nan
        gained = least.std_error**-2 - before**-2
        return (now.time - then) * (least.goal**-2 - least.std_error**-2) / gained if gained > 0.0 else inf

    def _verdict(self, known: tuple[ParameterProgress, ...], share: float, fin: float) -> Verdict:
        if not any(isfinite(p.std_error) for p in known):
            return "not_excited" if isfinite(fin) and fin < QUIET_FIN_RAD else "starting"
        if share >= 1.0:
            return "enough" if all(p.is_settled for p in known if p.name in self.goals) else "moving"
        return "not_excited" if isfinite(fin) and fin < QUIET_FIN_RAD else "collecting"
