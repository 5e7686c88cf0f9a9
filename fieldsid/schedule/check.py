"""One speed of a verification: its margins, its step responses and the outcome of its gains."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import nan
from types import MappingProxyType
from typing import Annotated

import numpy as np

from fieldsid.display import Brief, Displayed
from fieldsid.records.keys import INLINE, Interval, Key, Number
from fieldsid.schedule.flown.response import LIMIT_CYCLE_SHARE
from fieldsid.schedule.search.objective import Outcome


@dataclass(frozen=True, slots=True, repr=False)
class StepCheck(Brief):
    """The response to a step of one size (rad): overshoot as a share of the step, settling time in s (5 %).

    Of the steps to both sides it is the later one, with the worst of both in the other numbers: a trim takes from the fin's reach
    to one side, and a saturated fin overshoots less.

    `..._most` is the worst over 95 % of the draws. Without an integral overshoot and settling of a draw are relative to where the
    estimate comes to rest; `off` (rad) is the error at the end, of the trim or of an integral that is not done, worst over 95 %
    of the draws. `settling_median` and `settling95` (s) are the median and the 95 % band of the draws: settling jumps by half a
    period where an overshoot just leaves the corridor. `swing` is the peak-to-peak oscillation in the last quarter of the flight
    as a share of the step, worst over 95 % of the draws; `flown` (s) is the simulated time. Overshoot and settling are NaN where
    the data do not support them (`_without_unsupported`).
    """

    size: Annotated[float, Key("Its size.", "step_rad")]
    overshoot: Annotated[Number, Key("Overshoot by the estimate.", "overshoot_percent", times=100.0)]
    overshoot_most: Annotated[Number, Key("Largest over 95 % of the draws.", "overshoot_most_percent", times=100.0)]
    settling: Annotated[Number, Key("Time to stay within 5 % by the estimate; null if never.", "settling_s")]
    settling_most: Annotated[Number, Key("Longest over 95 % of the draws.", "settling_most_s")]
    settling_median: Annotated[Number, Key("The middle of the draws.", "settling_median_s")]
    settling95: Annotated[
        Interval, Key("The band that holds 95 % of the draws, with what a flight is off its model's.", "settling_interval95_s")
    ]
    swing: Annotated[
        Number, Key("What still swings in the last quarter of the flight, peak to peak.", "swing_percent", times=100.0)
    ]
    off: Annotated[
        Number,
        Key(
            "How far off it ends by 95 % of the draws: the error of the trim, or what an integral has yet to take up.",
            "steady_error_most_rad",
        ),
    ]
    flown: Annotated[Number, Key("How long it was flown.", "flown_s")]

    @property
    def said(self) -> Annotated[bool, Key()]:
        """Whether overshoot and settling are said; not where the fin cannot hold it, nor of an unstable hull in a tight turn."""
        return not np.isnan(self.settling)


@dataclass(frozen=True, slots=True, repr=False)
class Check(Displayed):
    """One speed with one set of gains: margins of the estimate and the least over 95 % of the draws; step responses.

    `steps` are the small, the standard and the large step; `unstable` is the number of unstable draws, `speed_least` (m/s) the
    least speed in the large step. `bent_error` (rad) is the steady error under a fin offset of 3 deg that the feed-forward
    compensates, `bent_error_unknown` under one that it does not; `leg_rms` and `leg_fin_rms` (rad) are the rms of angle and fin
    on a straight leg under the models' disturbance.
    """

    speed: Annotated[float, Key("The speed.", "speed_m_s")]
    knot: Annotated[bool, Key("Whether it is a row's own; else it lies between two.")]
    supported: Annotated[bool, Key("Whether the data were taken there.")]
    constant: Annotated[bool, Key("Whether the gains are the constant ones.", "constant_gain")]
    phase_deg: Annotated[Number, Key("Phase margin of the estimate.", "phase_margin_deg")]
    gain_db: Annotated[Number, Key("Its gain margin.", "gain_margin_db")]
    delay_s: Annotated[Number, Key("Its delay margin.", "delay_margin_s")]
    phase_least_deg: Annotated[Number, Key("Smallest over the draws of the parameters.", "phase_margin_least_deg")]
    gain_least_db: Annotated[Number, Key("Smallest over the draws.", "gain_margin_least_db")]
    delay_least_s: Annotated[Number, Key("Smallest over the draws.", "delay_margin_least_s")]
    unstable: Annotated[int, Key("How many of the draws are unstable.", "unstable_draws")]
    steps: Annotated[tuple[StepCheck, StepCheck, StepCheck], Key("A small, the standard and a large step.")]
    speed_least: Annotated[Number, Key("The least speed in the large step.", "speed_least_m_s")]
    bent_error: Annotated[Number, Key("Steady error with a fin 3 deg off that the feed-forward knows.", "fin_offset_error_rad")]
    bent_error_unknown: Annotated[Number, Key("The same with one it does not.", "fin_offset_error_unknown_rad")]
    leg_rms: Annotated[Number, Key("Angle on a straight leg in the disturbance of the models' runs.", "leg_rms_rad")]
    leg_fin_rms: Annotated[Number, Key("The fin there.", "leg_fin_rms_rad")]
    depth_overshoot: Annotated[Number, Key("Overshoot of a step of depth.", "depth_overshoot_percent", times=100.0)]
    depth_settling: Annotated[Number, Key("Its settling time.", "depth_settling_s")]
    depth_error: Annotated[Number, Key("How much too deep the loop holds a depth: what level flight takes.", "depth_error_m")]
    depth_flown: Annotated[Number, Key("How long it was flown.", "depth_flown_s")]
    outcome: Annotated[Outcome, INLINE]
    """The outcome of the gains by the objective that rows are designed for."""

    @property
    def overshoot(self) -> Annotated[Number, Key(name="overshoot_percent", times=100.0)]:
        """The most overshoot of the steps by the estimate, as a share."""
        return max((s.overshoot for s in self.steps if s.said), default=nan)

    @property
    def overshoot_most(self) -> Annotated[Number, Key(name="overshoot_most_percent", times=100.0)]:
        """The most overshoot of the steps by 95 % of the draws, as a share."""
        return max((s.overshoot_most for s in self.steps if s.said), default=nan)

    @property
    def settling(self) -> Annotated[Number, Key(name="settling_s")]:
        """Settling time of the standard step by the estimate, s."""
        return self.steps[1].settling

    @property
    def settling_most(self) -> Annotated[Number, Key(name="settling_most_s")]:
        """Settling time of the standard step by 95 % of the draws, s."""
        return self.steps[1].settling_most

    @property
    def hunts(self) -> StepCheck | None:
        """The smallest step after which a limit cycle remains; None without one."""
        return next((s for s in self.steps if s.swing > LIMIT_CYCLE_SHARE), None)


READ_OFF: Mapping[str, tuple[float, Callable[[Check], float]]] = MappingProxyType(
    {
        "phase_margin_deg": (1.0, lambda c: c.phase_least_deg),
        "gain_margin_db": (1.0, lambda c: c.gain_least_db),
        "delay_margin_s": (1.0, lambda c: c.delay_least_s),
        "overshoot_percent": (-1.0, lambda c: 100.0 * c.overshoot_most),
    }
)
"""The numbers that a gate can limit: 1 where more is better, -1 where less is, and the function that reads each from a check."""
