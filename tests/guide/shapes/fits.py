"""From run to model: identify, compare, extend, history."""

from __future__ import annotations

from typing import Any, Literal

from guide.shapes.common import (
    AxisName,
    Errors,
    Headline,
    Interval,
    NoiseFloor,
    Number,
    Pair,
    Remark,
    RemarkWithData,
    Result,
    Shape,
    Skipped,
    Where,
    schema_field,
)
from pydantic import Field


class Parameter(Shape):
    """An estimate with its error."""

    value: float
    """The estimate, in the unit below."""
    std_error: Number
    """Its standard error, corrected for coloured residuals."""
    interval95: Interval
    """Its 95 % interval."""
    unit: str
    """Its unit."""
    shown: str
    """Its name as it is printed: that of several runs with the speed it belongs to."""


class Merit(Errors):
    """How well a free run follows its measurement."""

    angle_fit_percent: Number
    """100 (1 - |y - s| / |y - mean y|) of the angle."""
    rate_fit_percent: Number
    """The same of the rate."""


class FittedRun(Merit):
    """One of the runs a model was fitted to."""

    run: str
    """Its name."""
    speed_m_s: Number
    """Median speed through the water."""
    segment_s: Interval
    """First and last time that was fitted."""


class Fit(Merit):
    """One identified model."""

    run: str
    """Name of the run; of a joint fit all names, joined by a plus."""
    model: str | None
    """The file that was written."""
    speed_m_s: Number
    """The speed the parameters hold at."""
    method: str
    """The estimator: `output_error`, `pem`, `svf_ls`, `svf_rls` or `srivc`."""
    method_reason: str | None
    """Why `auto` took it, where it had to choose; else null."""
    effects: list[str]
    """Effects in the model."""
    parameters: dict[str, Parameter]
    """By name: a22 b2 C0 delta_r0 of yaw, c22 c23 d2 Cb delta_s0 of pitch, and each effect's coefficients. A joint fit has
    `damping_exponent` and an authority for each speed, such as `b2@1.8`."""
    noise_floor: NoiseFloor
    """Noise of the sensors."""
    warnings: list[RemarkWithData]
    """What to know before the numbers are trusted, the gravest first."""
    whiteness_p: Number
    """p-value of the whitened residuals being white (Ljung and Box)."""
    runs: list[FittedRun]
    """Each run's own fit."""
    settled_s: dict[str, float] | None
    """By parameter, when the recursive estimate settled; null for other methods."""


class Identify(Result):
    """The models that `sysid identify` found."""

    schema_: Literal["fieldsid/identify/1"] = schema_field("fieldsid/identify/1")
    axis: AxisName
    """The plane."""
    fits: list[Fit]
    """One for each run, or one of all runs with `--joint`."""
    skipped_runs: list[Skipped]
    """Logs that could not be used, and why; where there are any, the exit code is 1."""


class WhereInRun(Where):
    """A condition, with how often it holds."""

    share_of_samples: float
    """Share of the samples at which it holds."""


class Stretch(Shape):
    """A stretch of time with much of the error."""

    t_start_s: float
    """Its start."""
    t_end_s: float
    """Its end."""
    share_of_error: float
    """Share of the squared error in it."""


class MovesWith(Shape):
    """A signal that the missing moment moves with."""

    signal: str
    """The signal, in words."""
    explained: float
    """Share of the missing moment's variance that it explains."""


class AsFlown(Shape):
    """What the run was taken to have done otherwise than its log says, within the log's own accuracy."""

    run: str
    """Its name."""
    says: str
    """The sentence that the command prints."""
    as_logged: Errors
    """The errors with all of that as logged."""


class CommandTimes(AsFlown):
    """Jumps of the command inside the sampling interval."""

    jumps: int
    """How many."""
    mean_s: float
    """How long before the samples that first show them they were made, on average."""
    largest_s: float
    """The longest."""


class OwnSpeed(AsFlown):
    """Another speed."""

    faster: float
    """Share by which it was faster."""
    speed_m_s: float
    """The speed of its log."""
    std_error: float
    """Standard error that the speed of a log is taken to have, as a share."""


class Failing(Shape):
    """A channel that has more left than its noise."""

    channel: Literal["angle", "rate"]
    """The channel."""
    theil: Number
    """Theil's inequality coefficient, 0 perfect, 1 worst."""
    r2: Number
    """1 - |y - s|^2 / |y - mean y|^2."""
    whiteness_p: Number
    """p-value of the residual being white."""
    where: list[WhereInRun]
    """Where it fails, the worst first."""
    worst: list[Stretch]
    """The worst stretches of two seconds."""


class ComparedRun(Merit):
    """A run beside the model's free run."""

    run: str
    """Its name."""
    fitted_to: bool
    """Whether the model was fitted to it, which makes it no fair judge."""
    speed_m_s: Number
    """Median speed through the water."""
    noise_floor: NoiseFloor
    """Noise of its sensors."""
    command_times: CommandTimes | None
    """When the jumps of the command were made inside the sampling interval, where the motion tells; else null."""
    own_speed: OwnSpeed | None
    """The speed it was flown at, where the motion tells another than the log; else null."""
    judged_by: Literal["angle", "rate"]
    """The channel that `theil`, `r2`, `whiteness_p` and `where` are of."""
    theil: Number
    """Theil's inequality coefficient, 0 perfect, 1 worst."""
    r2: Number
    """1 - |y - s|^2 / |y - mean y|^2."""
    whiteness_p: Number
    """p-value of the residual being white."""
    where: list[WhereInRun]
    """Where it fails, the worst first."""
    worst: list[Stretch]
    """The worst stretches of two seconds."""
    over_noise: float
    """Error over the noise floor, the measured channels pooled: what says whether the run fails."""
    over_floor: dict[str, float]
    """By channel, rms over the noise floor."""
    failing: list[Failing]
    """The channels that have more left than their noise, the worst first; none where the run as a whole has not."""
    moves_with: list[MovesWith]
    """What the missing moment moves with, the most first."""
    figure: str | None
    """The figure that was drawn."""


class Compare(Result):
    """A model against measurement."""

    schema_: Literal["fieldsid/compare/1"] = schema_field("fieldsid/compare/1")
    model: str
    """The model's file."""
    axis: AxisName
    """The plane."""
    runs: list[ComparedRun]
    """One for each run."""
    warnings: list[Remark]
    """What is left out of the runs."""
    skipped_runs: list[Skipped]
    """Logs that could not be used, and why; where there are any, the exit code is 1."""


class OverFloor(Shape):
    """Free-run error over the noise floor, both channels pooled."""

    before: float
    """Without the addition."""
    after: float
    """With it."""


class Gain(Shape):
    """What an addition changed."""

    added: list[str]
    """The effects added."""
    before: Pair
    """Errors without them."""
    after: Pair
    """Errors with them."""
    noise_floor: NoiseFloor
    """Noise of the sensors."""
    over_floor: OverFloor
    """The errors it is judged by."""
    unseen: bool
    """Whether there were runs to judge by that were not fitted."""
    learned_on: list[str]
    """Runs that were fitted."""
    judged_on: list[str]
    """Runs it was judged by."""


class AddedCoefficient(Shape):
    """A coefficient of an effect that was added."""

    value: float
    """The estimate."""
    std_error: Number
    """Its standard error."""
    unit: str
    """Its unit."""
    at_bound: bool
    """Whether it ended on a bound: then no error is right."""


class Parent(Shape):
    """The model it was made from."""

    path: str
    """Its file."""
    sha256: str
    """The file's hash."""


class LeftOver(Shape):
    """What a model leaves, over the noise floor."""

    fitted: Number
    """On the runs it was fitted to."""
    unseen: Number
    """On runs that were not fitted; null where there are none."""
    more_than_noise: bool
    """Whether either is more than the sensors' noise."""


class Extension(Gain):
    """A model with an effect more."""

    schema_: Literal["fieldsid/extend/1"] = schema_field("fieldsid/extend/1")
    axis: AxisName
    """The plane."""
    log_evidence: float
    """Gain in log evidence."""
    pays: bool
    """Whether the error falls by more than a trifle."""
    kept: bool
    """Whether the model was written: it pays, or `--keep`."""
    kept_by: str | None
    """What it was kept for: `unseen`, `evidence` or `--keep`; null where it was not."""
    model: str
    """The file that was written; the parent where nothing was kept."""
    effects: list[str]
    """The effects in that model."""
    parent: Parent
    """The model it was made from."""
    coefficients: dict[str, AddedCoefficient]
    """The coefficients of the added effects, by name."""
    notes: list[Remark]
    """What else there is to know."""
    left: LeftOver
    """What the model as it now is leaves."""
    next: str
    """The command that goes on from there."""
    skipped_runs: list[Skipped]
    """Logs that could not be used, and why; where there are any, the exit code is 1."""
    headline: Headline
    """The first lines of the same result as text."""


class UndoneParent(Parent):
    """The parent that was given back."""

    state: Literal["intact", "changed", "missing"]
    """Whether it is as it was when its child was made."""


class Undone(Result):
    """An extension taken back with `--undo`."""

    schema_: Literal["fieldsid/extend/1"] = schema_field("fieldsid/extend/1")
    before: dict[str, Any]
    """Errors without the addition, as they were noted; empty where nothing was."""
    after: dict[str, Any]
    """Errors with it."""
    noise_floor: dict[str, Any]
    """Noise of the sensors."""
    kept: Literal[False]
    """Always false."""
    undone: str
    """The file that was taken back; it stays where it is."""
    model: str
    """The parent."""
    effects: list[str]
    """The parent's effects."""
    parent: UndoneParent
    """The parent."""
    added: list[str] = Field(default_factory=list)
    """The effects that had been added."""
    over_floor: OverFloor | None = None
    """The errors it had been judged by."""
    unseen: bool | None = None
    """Whether there had been runs to judge by."""
    learned_on: list[str] = Field(default_factory=list)
    """Runs that had been fitted."""
    judged_on: list[str] = Field(default_factory=list)
    """Runs it had been judged by."""


class Generation(Shape):
    """One model of a line."""

    model: str
    """Its file."""
    effects: list[str]
    """Its effects."""
    state: Literal["intact", "changed", "missing"]
    """Whether the file is as it was when its child was made."""
    added: list[str]
    """The effects added to its parent; none for the first."""
    before: Pair | None = None
    """Errors before the addition."""
    after: Pair | None = None
    """Errors after it."""
    noise_floor: NoiseFloor | None = None
    """Noise of the sensors."""
    over_floor: OverFloor | None = None
    """The errors it was judged by."""
    unseen: bool | None = None
    """Whether there were runs to judge by."""
    learned_on: list[str] = Field(default_factory=list)
    """Runs that were fitted."""
    judged_on: list[str] = Field(default_factory=list)
    """Runs it was judged by."""
    kept_by: str | None = None
    """What it was kept for."""
    changed_data: list[str] = Field(default_factory=list)
    """Data files that have changed since."""


class History(Result):
    """How a model came about."""

    schema_: Literal["fieldsid/history/1"] = schema_field("fieldsid/history/1")
    model: str
    """Its file."""
    axis: AxisName
    """The plane."""
    generations: list[Generation]
    """From the first model to this one."""
    intact: bool
    """Whether every file of the line and its data are as they were."""
    figure: str | None
    """The figure that was drawn."""
