"""From log to run: init, status, inspect, import, simulate."""

from __future__ import annotations

from typing import Any, Literal

from guide.shapes.common import Number, Remark, RemarkWithData, Result, Shape, Skipped, schema_field


class Init(Result):
    """The trial folder that `sysid init` made."""

    schema_: Literal["fieldsid/init/1"] = schema_field("fieldsid/init/1")
    folder: str
    """The folder."""
    template: str
    """The kind of vehicle it was made for."""
    files: list[str]
    """The files in it."""


class MadeFrom(Shape):
    """A file that another one was made from."""

    path: str
    """The file as it was named then."""
    sha256: str
    """Its hash then."""


class TrialFile(Shape):
    """One file of a trial folder."""

    path: str
    """Its path from the folder."""
    kind: str
    """What it is: log, run, model, fit, schedule, ..."""
    made_from: list[MadeFrom]
    """What it was made from, as it says itself."""
    stale: str | None
    """Why it does not hold any more; null where it does."""
    missing: list[str]
    """What it was made from and is not there any more."""


class JournalLine(Shape):
    """One command of the journal."""

    time: str
    """When it was run, ISO 8601 in UTC."""
    command: list[str]
    """Its words."""
    exit: int
    """Its exit code."""
    seconds: float
    """How long it took."""
    verdict: str
    """The first line of what it said."""


class NextStep(Shape):
    """What to do next."""

    why: str
    """Because of what."""
    command: str
    """The command; empty where nothing is left to do."""


class Status(Result):
    """What a trial folder holds."""

    schema_: Literal["fieldsid/status/1"] = schema_field("fieldsid/status/1")
    folder: str
    """The folder."""
    verdict: str
    """What it holds, in one line."""
    files: list[TrialFile]
    """The files that the program knows."""
    stale: list[str]
    """Those that rest on something that has changed since."""
    journal: list[JournalLine]
    """The commands that were run in it, the oldest first."""
    unreadable_journal_lines: int
    """Lines of the journal that are none, as a power cut leaves them."""
    warnings: list[Remark]
    """What does not go together, as a fin that went beyond the limit of vehicle.yaml."""
    next: NextStep
    """What to do next."""


class ReportVerdict(Shape):
    """One verdict of a report."""

    what: str
    """What it is of."""
    says: str
    """What it says."""


class Report(Result):
    """The report that was written."""

    schema_: Literal["fieldsid/report/1"] = schema_field("fieldsid/report/1")
    file: str
    """The file."""
    bytes: int
    """Its size."""
    verdicts: list[ReportVerdict]
    """What it says first."""
    runs: list[str]
    """Runs in it."""
    models: list[str]
    """Models whose free runs are drawn, the best of an axis first."""
    figures: int
    """Figures in it."""
    skipped: list[str]
    """What could not be used and why."""


class FieldInfo(Shape):
    """One field of a channel."""

    path: str
    """Its path in a message; empty for the column of a table."""
    type: str
    """`number`, `text` or the message's own type."""
    first: list[Any]
    """Its first values."""
    span: list[Number] | None
    """Smallest and largest value; null where it is not a number."""


class Channel(Shape):
    """A column of a table, or a topic of a bag."""

    name: str
    """Its name."""
    type: str
    """Its type."""
    count: int
    """Number of samples."""
    rate_hz: Number
    """Samples per second; null for the columns of a table, which share one clock."""
    fields: list[FieldInfo]
    """What it holds."""


class Shown(Shape):
    """A channel as the page shows it."""

    name: str
    """Its name."""
    type: str
    """Its type."""
    count: int
    """Number of samples."""
    rate: str
    """Samples per second, in words."""
    holds: str
    """Its range, or its first fields."""


class Inspection(Result):
    """What is in a log, the mapping proposed for it, and the import doctor's findings."""

    schema_: Literal["fieldsid/inspection/1"] = schema_field("fieldsid/inspection/1")
    path: str
    """The log."""
    format: str
    """Its format, such as `text table`, `ROS 2 bag`."""
    span: str
    """Its length, in words."""
    duration_s: Number
    """Its length."""
    channels: list[Channel]
    """What is in it, the first hundred."""
    shown: list[Shown]
    """The same as the page shows it."""
    more_channels: int
    """How many channels there are besides."""
    mapping_needed: bool
    """False where the columns have the canonical names."""
    mapping: dict[str, Any]
    """The proposed mapping, as `mapping.yaml` has it."""
    mapping_file: str | None
    """Where it was written."""
    signals: list[str]
    """The signals that the mapping gives."""
    problem: str | None
    """Why no run can be made of it, where none can."""
    joined: list[str]
    """The other tables of its run, where they were named with `--join`."""
    import_options: list[str]
    """What an import must be asked for, where it refuses the log as it is."""
    findings: list[RemarkWithData]
    """The import doctor's findings."""


class ImportedRun(Shape):
    """One run that was imported."""

    run: str
    """Its name."""
    file: str
    """The file that was written."""
    log: str | None
    """The log it came from."""
    samples: int
    """Number of samples."""
    start_s: float
    """Time of the first sample."""
    end_s: float
    """Time of the last sample."""
    duration_s: float
    """Length."""
    rate_hz: float
    """Samples per second, by the median step."""
    signals: dict[str, int]
    """Number of measured samples of each signal."""
    notes: list[RemarkWithData]
    """What was done and what was found."""


class Import(Result):
    """The runs that `sysid import` wrote."""

    schema_: Literal["fieldsid/import/1"] = schema_field("fieldsid/import/1")
    runs: list[ImportedRun]
    """One for each log."""
    skipped_runs: list[Skipped]
    """Logs that could not be used, and why; where there are any, the exit code is 1."""
    already_imported: list[str]
    """Logs whose runs were there, made of the same bytes of log and mapping."""


class SignalRange(Shape):
    """Smallest, largest and last value of a signal, in the unit its name has."""

    low: float
    """Smallest value."""
    high: float
    """Largest value."""
    end: float
    """Last value."""


class Simulation(Result):
    """A model's own prediction, kept as a run."""

    schema_: Literal["fieldsid/simulation/1"] = schema_field("fieldsid/simulation/1")
    model: str
    """The model's file."""
    run: str
    """Name of the run."""
    file: str | None
    """Where it was written."""
    samples: int
    """Number of samples."""
    seconds: float
    """Length."""
    signals: dict[str, SignalRange]
    """Range of each signal."""
