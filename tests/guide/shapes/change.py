"""Before and after, and several models over the same runs: the other objects that `sysid compare` prints."""

from __future__ import annotations

from typing import Literal

from guide.shapes.common import AxisName, Interval, Number, Remark, Result, Shape, Side, Skipped, schema_field
from guide.shapes.fits import ComparedRun


class ChangeAtSpeed(Shape):
    """One quantity at one speed, before and after."""

    speed_m_s: Number
    """The speed; null for a coefficient that has none."""
    before: float
    """Its value before."""
    before_std_error: float
    """The standard error of that."""
    after: float
    """Its value after."""
    after_std_error: float
    """The standard error of that."""
    change: float
    """The change, as a share of the value before where `is_relative`."""
    std_error: float
    """The standard error of the change."""
    p_adjusted: Number
    """The p-value of no change, by Holm over all tests; null where no error is known."""


class ParameterChange(Shape):
    """One quantity over all speeds in common."""

    name: str
    """The parameter, an effect's coefficient, or `trim_angle`: the fin that the trim amounts to."""
    what: str
    """What it is: authority, damping, stiffness, trim."""
    unit: str
    """Its unit."""
    is_relative: bool
    """Whether changes are shares of the value before."""
    change: float
    """The change over all speeds."""
    std_error: float
    """Its standard error."""
    interval95: Interval
    """Its 95 % interval."""
    p_adjusted: Number
    """The smallest p-value of its tests, by Holm over all tests."""
    state: Literal["changed", "unchanged", "unclear"]
    """Beyond its errors; within what matters; or neither can be said."""
    says: str
    """The change in a few words."""
    speeds: list[ChangeAtSpeed]
    """At each speed."""


class GainChange(Shape):
    """The gain at one speed."""

    speed_m_s: float
    """The speed."""
    kp_before: float
    """The gain of before."""
    kp_after: float
    """The gain that would be designed now."""
    change: float
    """Its change as a share."""
    interval95: Interval
    """The 95 % interval of that, all speeds together."""
    damping_ratio_with_old: float
    """Least damping ratio of the loop as it is now, with the gain of before."""
    phase_margin_with_old_deg: Number
    """Phase margin of that loop."""


class RadiusChange(Shape):
    """The settled turning radius at one speed to one side."""

    speed_m_s: float
    """The speed."""
    side: Side
    """The side."""
    before_m: float
    """The radius before."""
    before_interval95: Interval
    """Its 95 % interval."""
    after_m: float
    """The radius after."""
    after_interval95: Interval
    """Its 95 % interval."""


class AxisChange(Shape):
    """What has changed on one axis."""

    axis: AxisName
    """The plane."""
    line: str
    """What has changed and what follows, in one line."""
    verdict: Literal["needed", "hold", "unclear", "none", "form"]
    """New gains needed; they hold; more runs are needed to say; no gain can be designed; the models' effects are not the same."""
    speeds_m_s: list[float]
    """Speeds at which both sides were flown."""
    parameters: list[ParameterChange]
    """The parameters, and the coefficients of effects that both sides have."""
    effects_added: list[str]
    """Effects in the models after alone."""
    effects_removed: list[str]
    """Effects in the models before alone."""
    gains: list[GainChange]
    """The gains."""
    radius: list[RadiusChange]
    """The radius; none in pitch."""
    rudder_rad: Number
    """The fin of the turn, and the limit the gains are designed for."""
    warnings: list[Remark]
    """What to read before the numbers."""
    models: list[list[str]]
    """The model files before, and those after."""
    figure: str | None
    """The figure."""
    next: str | None
    """What to do next; null where nothing is."""


class CompareModels(Result):
    """Two states of a vehicle."""

    schema_: Literal["fieldsid/compare-models/1"] = schema_field("fieldsid/compare-models/1")
    before: str
    """What was given first."""
    after: str
    """What was given second."""
    changes: list[AxisChange]
    """One for each axis that has models on both sides."""


class OneOfSeveral(Shape):
    """One model over the runs."""

    model: str
    """Its file."""
    over_floor: float
    """Error over the noise, angle and rate and the runs pooled."""
    fitted_to: list[str]
    """Runs that it was fitted to, which are no fair judge."""
    runs: list[ComparedRun]
    """One for each run."""


class LoopPlace(Shape):
    """Where the first model of a line fails."""

    condition: str
    """When."""
    beyond: float
    """Its share of the squared error beyond its share of the time."""
    rms_ratio: float
    """The rms there over that of the run."""


class LoopStep(Shape):
    """The error of a model of the line: over the noise floor, without noise over the first model's."""

    added: str
    """What was added."""
    fitted: Number
    """On the runs fitted to."""
    unseen: Number
    """On unseen runs."""


class Loop(Shape):
    """From a model to one that was extended from it."""

    run: str
    """The run that the first fails most on."""
    added: list[str]
    """The effects that were added."""
    where: list[LoopPlace]
    """Where the first fails."""
    steps: list[LoopStep]
    """The first model, and each addition."""


class CompareSeveral(Result):
    """Several models over the same runs."""

    schema_: Literal["fieldsid/compare-several/1"] = schema_field("fieldsid/compare-several/1")
    axis: AxisName
    """The plane."""
    models: list[OneOfSeveral]
    """The models in the order given."""
    best: str
    """The file of the one with the least error."""
    loop: Loop | None
    """Where one of them was extended from another: how the error fell."""
    figures: list[str]
    """The figures, one for each run."""
    skipped_runs: list[Skipped]
    """Logs that could not be used."""
