"""What has changed between two states of a vehicle: the record, and the one line that says it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees
from typing import Any

from fieldsid.display import Brief, Plotted
from fieldsid.logs.run import Note
from fieldsid.models.axis import Axis
from fieldsid.numerics.arrays import FloatArray
from fieldsid.rounding import number, with_error

TRIM_ANGLE = "trim_angle"
"""The fin angle that the trim moment amounts to, rad: at one speed and another the same where the fin is bent."""
TRIM_MATTERS_RAD = 0.0087
"""Half a degree of fin: what a fin is bent by on deck and nobody sees."""
CHANGED, UNCHANGED, UNCLEAR = "changed", "unchanged", "unclear"
VERDICTS: Mapping[str, str] = {
    "needed": "new gains needed",
    "hold": "the gains still hold",
    "unclear": "whether the gains still hold takes more runs to say",
    "none": "no gain can be designed for both",
    "form": "not comparable until both have the same effects",
}


@dataclass(frozen=True, slots=True, repr=False)
class AtSpeed(Brief):
    """One quantity at one speed (m/s): before and after with standard errors, and the change as `ParameterChange` has it."""

    speed: float
    old: float
    old_std_error: float
    new: float
    new_std_error: float
    change: float
    std_error: float
    p_adjusted: float


@dataclass(frozen=True, slots=True, repr=False)
class ParameterChange(Brief):
    """One quantity over all speeds in common: by how much it changed, as a share of its size before where `is_relative`.

    `p_adjusted` is the smallest of its tests, by Holm over all tests of the comparison. `state` is changed, unchanged (its 95 %
    interval lies within what matters) or unclear.
    """

    name: str
    word: str
    unit: str
    is_relative: bool
    change: float
    std_error: float
    interval95: tuple[float, float]
    p_adjusted: float
    state: str
    speeds: tuple[AtSpeed, ...]

    @property
    def amount(self) -> str:
        """The change with its standard error: in per cent, an angle in degrees, else in the unit of the quantity."""
        scale, unit = (
            (100.0, " %") if self.is_relative else (degrees(1.0), " deg") if self.unit == "rad" else (1.0, f" {self.unit}")
        )
        return f"{'+' if self.change > 0 else ''}{with_error(scale * self.change, scale * self.std_error)}{unit.rstrip()}"

    @property
    def says(self) -> str:
        """The change in a few words."""
        if self.state == CHANGED:
            return f"{self.word} {self.amount}"
        return f"{self.word} unchanged" if self.state == UNCHANGED else f"{self.word} unclear ({self.amount})"


@dataclass(frozen=True, slots=True, repr=False)
class GainChange(Brief):
    """The gain kp at one speed (m/s), before and after, its change as a share with a 95 % interval.

    And what the loop is with the old gains on the vehicle as it is now: least damping ratio, phase margin in deg.
    """

    speed: float
    old: float
    new: float
    change: float
    interval95: tuple[float, float]
    damping_with_old: float
    phase_with_old_deg: float


@dataclass(frozen=True, slots=True, repr=False)
class RadiusChange(Brief):
    """The settled turning radius in m at one speed (m/s) to one side, before and after, each with its 95 % interval."""

    speed: float
    side: str
    old: float
    old95: tuple[float, float]
    new: float
    new95: tuple[float, float]


@dataclass(frozen=True, slots=True, repr=False)
class Answers(Brief):
    """What both vehicles do at one fin command: time (n,) s, fin (n,) rad, rates (n,) rad/s, at one speed in m/s."""

    speed: float
    time: FloatArray
    fin: FloatArray
    old_rate: FloatArray
    new_rate: FloatArray


@dataclass(frozen=True, slots=True, repr=False)
class Change(Plotted):
    """What has changed on one axis, of the parameters, the effects, the gains and the radius; `verdict` is a key of VERDICTS."""

    axis: Axis
    speeds: tuple[float, ...]
    parameters: tuple[ParameterChange, ...]
    added: tuple[str, ...]
    removed: tuple[str, ...]
    gains: tuple[GainChange, ...]
    radius: tuple[RadiusChange, ...]
    rudder: float | None
    answers: Answers | None
    verdict: str
    notes: tuple[Note, ...]

    @property
    def line(self) -> str:
        """What has changed, and what follows for the gains, in one line."""
        return f"{self.axis.value} {', '.join(self._parts())}: {VERDICTS[self.verdict]}"

    def _parts(self) -> list[str]:
        shown = [p for p in self.parameters if p.name != TRIM_ANGLE or (p.state == CHANGED and abs(p.change) > TRIM_MATTERS_RAD)]
        order = {CHANGED: 0, UNCLEAR: 1, UNCHANGED: 2}
        words = [p.says for p in sorted(shown, key=lambda p: order[p.state])]
        words += [f"{e} only after" for e in self.added] + [f"{e} only before" for e in self.removed]
        return words

    def record(self) -> dict[str, Any]:
        """Return the record by the names of `--json`."""
        return {
            "axis": self.axis.value,
            "line": self.line,
            "verdict": self.verdict,
            "speeds_m_s": list(self.speeds),
            "parameters": [_parameter(p) for p in self.parameters],
            "effects_added": list(self.added),
            "effects_removed": list(self.removed),
            "gains": [
                {
                    "speed_m_s": g.speed,
                    "kp_before": g.old,
                    "kp_after": g.new,
                    "change": g.change,
                    "interval95": list(g.interval95),
                    "damping_ratio_with_old": g.damping_with_old,
                    "phase_margin_with_old_deg": g.phase_with_old_deg,
                }
                for g in self.gains
            ],
            "radius": [
                {
                    "speed_m_s": r.speed,
                    "side": r.side,
                    "before_m": r.old,
                    "before_interval95": list(r.old95),
                    "after_m": r.new,
                    "after_interval95": list(r.new95),
                }
                for r in self.radius
            ],
            "rudder_rad": self.rudder,
            "warnings": [{"code": n.code, "message": n.message} for n in self.notes],
        }


def _parameter(p: ParameterChange) -> dict[str, Any]:
    return {
        "name": p.name,
        "what": p.word,
        "unit": p.unit,
        "is_relative": p.is_relative,
        "change": p.change,
        "std_error": p.std_error,
        "interval95": list(p.interval95),
        "p_adjusted": p.p_adjusted,
        "state": p.state,
        "says": p.says,
        "speeds": [
            {
                "speed_m_s": a.speed,
                "before": a.old,
                "before_std_error": a.old_std_error,
                "after": a.new,
                "after_std_error": a.new_std_error,
                "change": a.change,
                "std_error": a.std_error,
                "p_adjusted": a.p_adjusted,
            }
            for a in p.speeds
        ],
    }


def shown(value: float, error: float) -> str:
    """Return a value with its error, the value alone where the error is not known."""
    return with_error(value, error) if error > 0 else number(value)
