"""What the commands on a whole folder come to: init, status, report, batch, demo and guide."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from fieldsid.batch.trend import Trend
from fieldsid.logs.run import Note
from fieldsid.models.axis import Axis
from fieldsid.records.keys import INLINE, Key, Result
from fieldsid.results.result import Skipped
from fieldsid.trial_folder.state import FolderState


@dataclass(frozen=True, slots=True)
class Init(Result):
    """The trial folder that `sysid init` made."""

    SCHEMA = "fieldsid/init/1"

    folder: Annotated[str, Key("The folder.")]
    template: Annotated[str, Key("The kind of vehicle it was made for.")]
    files: Annotated[tuple[str, ...], Key("The files in it.")]


@dataclass(frozen=True, slots=True)
class NextStep:
    """What to do next."""

    why: Annotated[str, Key("Because of what.")]
    command: Annotated[str, Key("The command; empty where nothing is left to do.")]


@dataclass(frozen=True, slots=True)
class Status(Result):
    """What a trial folder holds."""

    SCHEMA = "fieldsid/status/1"

    state: Annotated[FolderState, INLINE]
    verdict: Annotated[str, Key("What it holds, in one line.")]
    warnings: Annotated[tuple[Note, ...], Key("What does not go together, as a fin that went beyond the limit of vehicle.yaml.")]
    next: Annotated[NextStep, Key("What to do next.")]


@dataclass(frozen=True, slots=True)
class ReportVerdict:
    """One verdict of a report."""

    what: Annotated[str, Key("What it is of.")]
    says: Annotated[str, Key("What it says.")]


@dataclass(frozen=True, slots=True)
class Report(Result):
    """The report that was written."""

    SCHEMA = "fieldsid/report/1"

    file: Annotated[str, Key("The file.")]
    bytes: Annotated[int, Key("Its size.")]
    verdicts: Annotated[tuple[ReportVerdict, ...], Key("What it says first.")]
    runs: Annotated[tuple[str, ...], Key("Runs in it.")]
    models: Annotated[tuple[str, ...], Key("Models whose free runs are drawn, the best of an axis first.")]
    figures: Annotated[int, Key("Figures in it.")]
    skipped: Annotated[tuple[str, ...], Key("What could not be used and why.")]


@dataclass(frozen=True, slots=True)
class NotUsed(Skipped):
    """A run that could not be identified."""

    status: Annotated[
        Literal["skipped", "failed"],
        Key("`skipped`: the log does not allow it; `failed`: a process ended, took too long or too much memory."),
    ]


@dataclass(frozen=True, slots=True)
class Batch(Result):
    """An archive of logs."""

    SCHEMA = "fieldsid/batch/1"

    axis: Annotated[Axis, Key("The plane.")]
    logs: Annotated[int, Key("Logs that were asked for.")]
    known_logs: Annotated[int, Key("Those that an earlier batch had answered.")]
    runs: Annotated[int, Key("Runs that were identified.")]
    table: Annotated[str, Key("The table, Parquet.")]
    csv: Annotated[str, Key("The same as CSV.")]
    where: Annotated[str, Key("Where the work was done.")]
    seconds: Annotated[float, Key("How long it took.")]
    verdicts: Annotated[Mapping[str, int], Key("How many runs have each verdict.")]
    effects: Annotated[Mapping[str, int], Key("How many runs miss each effect.")]
    skipped_runs: Annotated[tuple[NotUsed, ...], Key("What could not be used, with its reason.")]
    trend: Annotated[tuple[Trend, ...], Key("With `--trend`, each parameter over the runs' dates.")]
    figure: Annotated[str | None, Key("The figure of that.")]


@dataclass(frozen=True, slots=True)
class Hidden:
    """What the tour hides in its vehicle."""

    effect: Annotated[str, Key("The effect.")]
    axis: Annotated[Axis, Key("The plane.")]
    values: Annotated[Mapping[str, float], Key("The vehicle's true numbers.")]


@dataclass(frozen=True, slots=True)
class Step:
    """One step of the tour."""

    command: Annotated[str, Key("The command line.")]
    seconds: Annotated[float, Key("How long it took.")]
    means: Annotated[str, Key("What its result means.")]
    result: Annotated[Mapping[str, Any] | None, Key("The command's own JSON object.")]


@dataclass(frozen=True, slots=True)
class Demo(Result):
    """The tour."""

    SCHEMA = "fieldsid/demo/1"

    folder: Annotated[str, Key("Where the files are.")]
    hidden: Annotated[Hidden, Key("What was hidden.")]
    named: Annotated[tuple[str, ...], Key("What diagnose named.")]
    steps: Annotated[tuple[Step, ...], Key("The steps.")]
    files: Annotated[tuple[str, ...], Key("The files that were written.")]
    seconds: Annotated[float, Key("How long it took.")]


@dataclass(frozen=True, slots=True)
class Title:
    """A topic of the guide."""

    topic: Annotated[str, Key("Its name, as `sysid guide` takes it.")]
    title: Annotated[str, Key("Its title.")]


@dataclass(frozen=True, slots=True)
class Contents(Result):
    """The topics of the guide."""

    SCHEMA = "fieldsid/guide/1"

    topics: Annotated[tuple[Title, ...], Key("In the order of reading.")]


@dataclass(frozen=True, slots=True)
class Topic(Title, Result):
    """One page of the guide."""

    SCHEMA = "fieldsid/guide/1"

    file: Annotated[str, Key("The file that holds it.")]
    text: Annotated[str, Key("Its text.")]
