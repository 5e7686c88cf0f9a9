"""The record of the change between two states of a vehicle, and its summary in one line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees
from typing import Annotated, Literal

from fieldsid.display import Brief, Plotted
from fieldsid.logs.run import Note
from fieldsid.models.axis import Axis
from fieldsid.numerics.arrays import FloatArray
from fieldsid.records.keys import Interval, Key, Number, Side
from fieldsid.rounding import with_error

TRIM_ANGLE = "trim_angle"
"""The fin angle in rad that is equivalent to the trim moment: it does not depend on the speed where the fin is bent."""
TRIM_MATTERS_RAD = 0.0087
"""Half a degree of fin, by which a fin may be bent on deck without being noticed."""
LEVEL = 0.05
"""p-value below which a change is significant."""
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

    speed: Annotated[Number, Key("The speed; null for a coefficient that has none.", "speed_m_s")]
    old: Annotated[float, Key("Its value before.", "before")]
    old_std_error: Annotated[float, Key("The standard error of that.", "before_std_error")]
    new: Annotated[float, Key("Its value after.", "after")]
    new_std_error: Annotated[float, Key("The standard error of that.", "after_std_error")]
    change: Annotated[float, Key("The change, as a share of the value before where `is_relative`.")]
    std_error: Annotated[float, Key("The standard error of the change.")]
    p_adjusted: Annotated[Number, Key("The p-value of no change, by Holm over all tests; null where no error is known.")]

    @property
    def is_beyond_errors(self) -> bool:
        """Whether the change is significant, with a family-wise error rate of 5 % over all tests."""
        return self.p_adjusted < LEVEL


@dataclass(frozen=True, slots=True, repr=False)
class ParameterChange(Brief):
    """One quantity over all speeds in common: by how much it changed, as a share of its size before where `is_relative`.

    `p_adjusted` is the smallest of its tests, by Holm over all tests of the comparison. `state` is changed, unchanged (its 95 %
    interval lies within what matters) or unclear.
    """

    name: Annotated[str, Key("The parameter, an effect's coefficient, or `trim_angle`: the fin that the trim amounts to.")]
    word: Annotated[str, Key("What it is: authority, damping, stiffness, trim.", "what")]
    unit: Annotated[str, Key("Its unit.")]
    is_relative: Annotated[bool, Key("Whether changes are shares of the value before.")]
    change: Annotated[float, Key("The change over all speeds.")]
    std_error: Annotated[float, Key("Its standard error.")]
    interval95: Annotated[Interval, Key("Its 95 % interval.")]
    p_adjusted: Annotated[Number, Key("The smallest p-value of its tests, by Holm over all tests.")]
    state: Annotated[
        str, Key("Beyond its errors, within what matters, or neither.", of=Literal["changed", "unchanged", "unclear"])
    ]
    speeds: Annotated[tuple[AtSpeed, ...], Key("At each speed.")]

    @property
    def amount(self) -> str:
        """The change with its standard error: in per cent, an angle in degrees, else in the unit of the quantity."""
        scale, unit = (
            (100.0, " %") if self.is_relative else (degrees(1.0), " deg") if self.unit == "rad" else (1.0, f" {self.unit}")
        )
        return f"{'+' if self.change > 0 else ''}{with_error(scale * self.change, scale * self.std_error)}{unit.rstrip()}"

    @property
    def says(self) -> Annotated[str, Key()]:
        """The change in a few words."""
        if self.state == CHANGED:
            return f"{self.word} {self.amount}"
        return f"{self.word} unchanged" if self.state == UNCHANGED else f"{self.word} unclear ({self.amount})"


@dataclass(frozen=True, slots=True, repr=False)
class GainChange(Brief):
    """The gain kp at one speed (m/s) for the estimates before and after, its change as a share with a 95 % interval.

    And what the loop is with the old gains on the vehicle as it is now: least damping ratio, phase margin in deg.
    """

    speed: Annotated[float, Key("The speed.", "speed_m_s")]
    old: Annotated[float, Key("The gain of before.", "kp_before")]
    new: Annotated[float, Key("The gain that would be designed now.", "kp_after")]
    change: Annotated[float, Key("Its change as a share.")]
    interval95: Annotated[Interval, Key("The 95 % interval of that, all speeds together.")]
    damping_with_old: Annotated[
        float, Key("Least damping ratio of the loop as it is now, with the gain of before.", "damping_ratio_with_old")
    ]
    phase_with_old_deg: Annotated[Number, Key("Phase margin of that loop.", "phase_margin_with_old_deg")]


@dataclass(frozen=True, slots=True, repr=False)
class RadiusChange(Brief):
    """The settled turning radius in m at one speed (m/s) to one side, before and after, each with its 95 % interval."""

    speed: Annotated[float, Key("The speed.", "speed_m_s")]
    side: Annotated[str, Key("The side.", of=Side)]
    old: Annotated[float, Key("The radius before.", "before_m")]
    old95: Annotated[Interval, Key("Its 95 % interval.", "before_interval95")]
    new: Annotated[float, Key("The radius after.", "after_m")]
    new95: Annotated[Interval, Key("Its 95 % interval.", "after_interval95")]


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

    axis: Annotated[Axis, Key("The plane.")]
    speeds: Annotated[tuple[float, ...], Key("Speeds at which both sides were flown.", "speeds_m_s")]
    parameters: Annotated[
        tuple[ParameterChange, ...], Key("The parameters, and the coefficients of effects that both sides have.")
    ]
    added: Annotated[tuple[str, ...], Key("Effects in the models after alone.", "effects_added")]
    removed: Annotated[tuple[str, ...], Key("Effects in the models before alone.", "effects_removed")]
    gains: Annotated[tuple[GainChange, ...], Key("The gains.")]
    radius: Annotated[tuple[RadiusChange, ...], Key("The radius; none in pitch.")]
    rudder: Annotated[float | None, Key("The fin of the turn, and the limit the gains are designed for.", "rudder_rad")]
    answers: Answers | None
    verdict: Annotated[
        str,
        Key(
            "New gains needed; they hold; more runs are needed to say; no gain can be designed; the effects are not the same.",
            of=Literal["needed", "hold", "unclear", "none", "form"],
        ),
    ]
    notes: Annotated[tuple[Note, ...], Key("What to read before the numbers.", "warnings")]

    @property
    def line(self) -> Annotated[str, Key()]:
        """What has changed, and what follows for the gains, in one line."""
        return f"{self.axis.value} {', '.join(self._parts())}: {VERDICTS[self.verdict]}"

    def _parts(self) -> list[str]:
        shown = [p for p in self.parameters if p.name != TRIM_ANGLE or (p.state == CHANGED and abs(p.change) > TRIM_MATTERS_RAD)]
        order = {CHANGED: 0, UNCLEAR: 1, UNCHANGED: 2}
        words = [p.says for p in sorted(shown, key=lambda p: order[p.state])]
        words += [f"{e} only after" for e in self.added] + [f"{e} only before" for e in self.removed]
        return words
