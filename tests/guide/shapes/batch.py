"""What `sysid batch --json` prints."""

from __future__ import annotations

from typing import Literal

from guide.shapes.common import AxisName, Number, Result, Shape, Skipped, schema_field


class NotUsed(Skipped):
    """A run that could not be identified."""

    status: Literal["skipped", "failed"]
    """`skipped`: the log does not allow it; `failed`: a process ended, took too long or too much memory."""


class TrendChange(Shape):
    """A change of a parameter."""

    run: str
    """The first run after it."""
    start_utc: str
    """That run's start."""
    before: float
    """Mean before, at the trend's speed."""
    after: float
    """Mean after."""
    std_error: float
    """Standard error of the difference."""
    share: Number
    """The difference over the mean before: -0.18 is 18 % less."""


class ParameterTrend(Shape):
    """A parameter over the runs' dates."""

    parameter: str
    """Its name."""
    runs: int
    """Runs that know it."""
    speed_m_s: Number
    """The speed all runs are carried to; null where the parameter does not go with speed."""
    scatter: float
    """Scatter from run to run beyond the stated errors."""
    changes: list[TrendChange]
    """Where it changed."""


class Batch(Result):
    """An archive of logs."""

    schema_: Literal["fieldsid/batch/1"] = schema_field("fieldsid/batch/1")
    axis: AxisName
    """The plane."""
    logs: int
    """Logs that were asked for."""
    known_logs: int
    """Those that an earlier batch had answered."""
    runs: int
    """Runs that were identified."""
    table: str
    """The table, Parquet."""
    csv: str
    """The same as CSV."""
    where: str
    """Where the work was done."""
    seconds: float
    """How long it took."""
    verdicts: dict[str, int]
    """How many runs have each verdict."""
    effects: dict[str, int]
    """How many runs miss each effect."""
    skipped_runs: list[NotUsed]
    """What could not be used, with its reason."""
    trend: list[ParameterTrend]
    """With `--trend`, each parameter over the runs' dates."""
    figure: str | None
    """The figure of that."""
