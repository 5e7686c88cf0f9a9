"""One speed of a verification: its margins, its steps and what its gains come to."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from fieldsid.display import Brief, Displayed
from fieldsid.schedule.flown.response import LIMIT_CYCLE_SHARE
from fieldsid.schedule.search.objective import Outcome


@dataclass(frozen=True, slots=True, repr=False)
class StepCheck(Brief):
    """A step of one size (rad) by the estimate and by 95 % of the draws: overshoot as a share of it, settling in s (5 %).

    Those of the draws are about where each comes to rest; `off` (rad) is how far that is from what was asked, by 95 % of them:
    what a trim that is not known to better leaves. `settling_median` and `settling95` (s) are the middle of the draws and the
    band that holds 95 % of them: settling jumps by half a swing where an overshoot just leaves the corridor. `swing` is what
    still swings in the last quarter, peak to peak as a share of the step, by 95 % of the draws; `flown` (s) how long they were
    flown. Overshoot and settling are NaN
    where what was flown does not say them (`_with_what_is_known`).
    """

    size: float
    overshoot: float
    overshoot_most: float
    settling: float
    settling_most: float
    settling_median: float
    settling95: tuple[float, float]
    swing: float
    off: float
    flown: float

    def record(self) -> dict[str, Any]:
        """Return the step by its fields' names with units."""
        return {
            "step_rad": self.size, "said": not np.isnan(self.settling), "overshoot_percent": 100 * self.overshoot,
            "overshoot_most_percent": 100 * self.overshoot_most, "settling_s": self.settling,
            "settling_most_s": self.settling_most, "settling_median_s": self.settling_median,
            "settling_interval95_s": list(self.settling95), "swing_percent": 100 * self.swing,
            "steady_error_most_rad": self.off, "flown_s": self.flown,
        }  # fmt: skip


@dataclass(frozen=True, slots=True, repr=False)
class Check(Displayed):
    """One speed under one set of gains: margins at the estimate (python-control) and the least over 95 % of the draws; steps.

    `steps` are of the small, the standard and the large size; `unstable` how many of the draws are, `speed_least` (m/s) the
    least speed in the large step. `bent_error` is the steady error (rad) of a 3 deg fin offset that the feed-forward knows,
    `bent_error_unknown` one it does not; `leg_rms` and `leg_fin_rms` (rad) are of a straight leg in the models' disturbance.
    """

    speed: float
    knot: bool
    supported: bool
    constant: bool
    phase_deg: float
    gain_db: float
    delay_s: float
    phase_least_deg: float
    gain_least_db: float
    delay_least_s: float
    unstable: int
    steps: tuple[StepCheck, StepCheck, StepCheck]
    speed_least: float
    bent_error: float
    bent_error_unknown: float
    leg_rms: float
    leg_fin_rms: float
    depth_overshoot: float
    depth_settling: float
    depth_flown: float
    outcome: Outcome
    """What the gains come to by the objective that rows are designed for."""

    @property
    def overshoot(self) -> float:
        """Overshoot of the standard step by the estimate, as a share."""
        return self.steps[1].overshoot

    @property
    def overshoot_most(self) -> float:
        """The most overshoot of the standard step by 95 % of the draws, as a share."""
        return self.steps[1].overshoot_most

    @property
    def settling(self) -> float:
        """Settling time of the standard step by the estimate, s."""
        return self.steps[1].settling

    @property
    def settling_most(self) -> float:
        """Settling time of the standard step by 95 % of the draws, s."""
        return self.steps[1].settling_most

    @property
    def hunts(self) -> StepCheck | None:
        """The first step after which the loop goes on swinging, a limit cycle; None where all come to rest."""
        return next((s for s in self.steps if s.swing > LIMIT_CYCLE_SHARE), None)

    def record(self) -> dict[str, Any]:
        """Return the check by its fields' names with units."""
        return {
            "speed_m_s": self.speed, "knot": self.knot, "supported": self.supported, "constant_gain": self.constant,
            "phase_margin_deg": self.phase_deg, "gain_margin_db": self.gain_db, "delay_margin_s": self.delay_s,
            "phase_margin_least_deg": self.phase_least_deg, "gain_margin_least_db": self.gain_least_db,
            "delay_margin_least_s": self.delay_least_s, "unstable_draws": self.unstable,
            "overshoot_percent": 100 * self.overshoot, "overshoot_most_percent": 100 * self.overshoot_most,
            "settling_s": self.settling, "settling_most_s": self.settling_most,
            "steps": [s.record() for s in self.steps], "speed_least_m_s": self.speed_least,
            "fin_offset_error_rad": self.bent_error, "fin_offset_error_unknown_rad": self.bent_error_unknown,
            "leg_rms_rad": self.leg_rms, "leg_fin_rms_rad": self.leg_fin_rms,
            "depth_overshoot_percent": 100 * self.depth_overshoot, "depth_settling_s": self.depth_settling,
            "depth_flown_s": self.depth_flown, "answer_s": self.outcome.settled, "fin_use": self.outcome.fin,
        }  # fmt: skip


READ_OFF: Mapping[str, tuple[float, Callable[[Check], float]]] = MappingProxyType(
    {
        "phase_margin_deg": (1.0, lambda c: c.phase_least_deg),
        "gain_margin_db": (1.0, lambda c: c.gain_least_db),
        "delay_margin_s": (1.0, lambda c: c.delay_least_s),
        "overshoot_percent": (-1.0, lambda c: 100.0 * c.overshoot_most),
    }
)
"""The numbers a gate may ask for: 1 where more is better, -1 where less is, and how each is read off a check."""
