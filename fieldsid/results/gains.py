"""What `sysid schedule design`, `verify` and `export` come to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

from fieldsid.models.axis import Axis
from fieldsid.plant.parameter_source import ParameterSource
from fieldsid.records.keys import INLINE, Key, Number, Result
from fieldsid.schedule.controller import Gains
from fieldsid.schedule.linear_plant import not_counted
from fieldsid.schedule.record import Schedule
from fieldsid.schedule.verdict import Gate, against_constant, rests_on, verdict_of
from fieldsid.schedule.verify import Verification


@dataclass(frozen=True, slots=True)
class Design(Result):
    """Gains per speed."""

    SCHEMA = "fieldsid/schedule/1"

    schedule: Annotated[Schedule, INLINE]
    file: Annotated[str | None, Key("The file that was written.")] = None


@dataclass(frozen=True, slots=True)
class Worst:
    """The least margins and the most overshoot, over speeds and draws."""

    phase_margin_deg: Annotated[Number, Key("Phase margin.")]
    gain_margin_db: Annotated[Number, Key("Gain margin.")]
    delay_margin_s: Annotated[Number, Key("Delay margin.")]
    overshoot_percent: Annotated[Number, Key("Overshoot.")]


@dataclass(frozen=True, slots=True)
class Verified(Result):
    """A schedule checked over the identified set."""

    SCHEMA = "fieldsid/verification/1"

    verdict: Annotated[str, Key("The verdict in a word.")]
    says: Annotated[str, Key("The same in a sentence, with its number.")]
    rests_on: Annotated[str, Key("What it rests on.")]
    not_counted: Annotated[
        Mapping[str, tuple[str, ...]], Key("Coefficients between fin and motion that no loop was flown with, by effect.")
    ]
    against_constant: Annotated[str, Key("How it compares with the best one gain for all speeds.")]
    constant_gains: Annotated[Gains, Key("That gain.")]
    axis: Annotated[Axis, Key("The plane.")]
    controller: Annotated[str, Key("The controller.")]
    worst: Annotated[Mapping[str, float], Key("The worst of all.", of=Worst)]
    checked: Annotated[Verification, INLINE]
    gates: Annotated[tuple[Gate, ...], Key("The limits that were asked for.")]
    figure: Annotated[str | None, Key("The figure that was drawn.")]

    @property
    def passed(self) -> Annotated[bool, Key()]:
        """Whether all hold; where not, the exit code is 1."""
        return all(g.passed for g in self.gates)


@dataclass(frozen=True, slots=True)
class Exported(Result):
    """The gains in the vehicle's own format, or put into a file that exists with `--into`."""

    SCHEMA = "fieldsid/export/1"

    target: Annotated[str, Key("The format; `into` for `--into`.")]
    text: Annotated[str | None, Key("The file's text; not with `--into`.", is_optional=True)] = None
    file: Annotated[str | None, Key("The file that was written, or that is shown changed.")] = None
    difference: Annotated[str, Key("How a file that exists changes, as a unified difference.")] = ""
    backup: Annotated[str | None, Key("That file as it was; null where nothing was replaced.")] = None


def verified(checked: Verification, source: ParameterSource, gates: tuple[Gate, ...], figure: str | None) -> Verified:
    """Return a verification as the command tells it; source: the models that it was made on."""
    schedule = checked.schedule
    verdict, says = verdict_of(checked, schedule, gates)
    return Verified(
        verdict=verdict,
        says=says,
        rests_on=rests_on(checked, schedule, source),
        not_counted=not_counted(source.models),
        against_constant=against_constant(checked),
        constant_gains=checked.constant_row.gains,
        axis=schedule.axis,
        controller=schedule.kind,
        worst=checked.worst,
        checked=checked,
        gates=gates,
        figure=figure,
    )
