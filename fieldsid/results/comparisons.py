"""What `sysid compare` comes to: one model, several models, or before and after a swap."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Annotated, Literal, TypeVar

from fieldsid.change.promise import KeptStep
from fieldsid.change.record import Change
from fieldsid.comparison.compare import Comparison
from fieldsid.comparison.localize import Place, Stretch
from fieldsid.comparison.metrics import Metrics
from fieldsid.comparison.residuals import Companion
from fieldsid.diagnosis.records import Errors
from fieldsid.extension.lineage import Loop
from fieldsid.logs.run import Note
from fieldsid.models.axis import Axis
from fieldsid.records.keys import INLINE, Key, Number, Result
from fieldsid.results.result import OfLogs

T = TypeVar("T", bound="AsFlown")


@dataclass(frozen=True, slots=True, kw_only=True)
class AsFlown:
    """What the run was taken to have done otherwise than its log says, within the log's own accuracy."""

    run: Annotated[str, Key("Its name.")]
    says: Annotated[str, Key("The sentence that the command prints.")]
    as_logged: Annotated[Errors, Key("The errors with all of that as logged.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandTimes(AsFlown):
    """Jumps of the command inside the sampling interval."""

    jumps: Annotated[int, Key("How many.")]
    mean_s: Annotated[float, Key("How long before the samples that first show them they were made, on average.")]
    largest_s: Annotated[float, Key("The longest.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnSpeed(AsFlown):
    """Another speed."""

    faster: Annotated[float, Key("Share by which it was faster.")]
    speed_m_s: Annotated[float, Key("The speed of its log.")]
    std_error: Annotated[float, Key("Standard error that the speed of a log is taken to have, as a share.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparedRun:
    """A run compared with the model's free run."""

    comparison: Annotated[Comparison, INLINE]
    metrics: Annotated[Metrics, INLINE]
    fitted_to: Annotated[bool, Key("Whether the model was fitted to it, which makes it no fair judge.")]
    speed_m_s: Annotated[Number, Key("Median speed through the water.")]
    command_times: Annotated[
        CommandTimes | None,
        Key("When the jumps of the command were made inside the sampling interval, where the motion tells; else null."),
    ]
    own_speed: Annotated[
        OwnSpeed | None, Key("The speed it was flown at, where the motion tells another than the log; else null.")
    ]
    judged_by: Annotated[
        str, Key("The channel that `theil`, `r2`, `whiteness_p` and `where` are of.", of=Literal["angle", "rate"])
    ]
    where: Annotated[tuple[Place, ...], Key("Where it fails, the worst first.")]
    worst: Annotated[tuple[Stretch, ...], Key("The worst stretches of two seconds.")]
    over_floor: Annotated[Mapping[str, float], Key("By channel, rms over the noise floor.")]
    moves_with: Annotated[tuple[Companion, ...], Key("What the missing moment moves with, the most first.")]
    figure: Annotated[str | None, Key("The figure that was drawn.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Compared(OfLogs):
    """A model against measurement."""

    SCHEMA = "fieldsid/compare/1"

    model: Annotated[str, Key("The model's file.")]
    axis: Annotated[Axis, Key("The plane.")]
    runs: Annotated[tuple[ComparedRun, ...], Key("One for each run.")]
    warnings: Annotated[tuple[Note, ...], Key("What is left out of the runs.")]


@dataclass(frozen=True, slots=True)
class OneOfSeveral:
    """One model over the runs."""

    model: Annotated[str, Key("Its file.")]
    over_floor: Annotated[float, Key("Error over the noise, angle and rate and the runs pooled.")]
    fitted_to: Annotated[tuple[str, ...], Key("Runs that it was fitted to, which are no fair judge.")]
    runs: Annotated[tuple[ComparedRun, ...], Key("One for each run.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparedSeveral(OfLogs):
    """Several models over the same runs."""

    SCHEMA = "fieldsid/compare-several/1"

    axis: Annotated[Axis, Key("The plane.")]
    models: Annotated[tuple[OneOfSeveral, ...], Key("The models in the order given.")]
    best: Annotated[str, Key("The file of the one with the least error.")]
    loop: Annotated[Loop | None, Key("How the error fell where one of them was extended from another; else null.")]
    figures: Annotated[tuple[str, ...], Key("The figures, one for each run.")]


@dataclass(frozen=True, slots=True)
class AxisChange:
    """What has changed on one axis."""

    change: Annotated[Change, INLINE]
    models: Annotated[tuple[tuple[str, ...], ...], Key("The model files before, and those after.")]
    figure: Annotated[str | None, Key("The figure.")]
    next: Annotated[str | None, Key("What to do next; null where nothing is.")]


@dataclass(frozen=True, slots=True)
class BeforeAfter(Result):
    """Two states of a vehicle."""

    SCHEMA = "fieldsid/compare-models/1"

    before: Annotated[str, Key("What was given first.")]
    after: Annotated[str, Key("What was given second.")]
    changes: Annotated[tuple[AxisChange, ...], Key("One for each axis that has models on both sides.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class AsPromised(OfLogs):
    """The steps that were flown with a schedule."""

    SCHEMA = "fieldsid/as-promised/1"

    gains: Annotated[str, Key("The schedule's file.")]
    axis: Annotated[Axis, Key("The plane.")]
    steps: Annotated[tuple[KeptStep, ...], Key("The steps of the goal.")]

    @property
    def as_promised(self) -> Annotated[bool, Key()]:
        """Whether every step went as its verification says."""
        return all(s.as_promised for s in self.steps)


def compared_run(c: Comparison, figure: str | None, fitted: Collection[str]) -> ComparedRun:
    """Return the result of a comparison; one whose worst channel is down to its noise has no places of failure."""
    worst_channel = c.worst_channel
    fails = worst_channel in c.failing
    return ComparedRun(
        comparison=c,
        fitted_to=c.run in fitted,
        speed_m_s=c.shown.record.speed,
        command_times=_as_flown(CommandTimes, c, "command_between_samples"),
        own_speed=_as_flown(OwnSpeed, c, "own_speed"),
        over_floor={channel.name: channel.over_floor for channel in c.channels},
        judged_by=worst_channel.name,
        metrics=worst_channel.metrics,
        where=worst_channel.where if fails else (),
        worst=worst_channel.worst if fails else (),
        moves_with=c.moves_with if c.failing else (),
        figure=figure,
    )


def _as_flown(kind: type[T], c: Comparison, code: str) -> T | None:
    """Return what a run was taken to have done otherwise than its log has it, and the errors with all of that as logged."""
    note = next((n for n in c.shown.notes if n.code == code), None)
    if note is None or c.shown.as_logged is None:
        return None
    return kind(**note.data, says=note.message, as_logged=Errors(*c.shown.as_logged))
