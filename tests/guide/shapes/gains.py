"""Gains: schedule design, verify, export."""

from __future__ import annotations

from typing import Any, Literal

from guide.shapes.common import AxisName, Headline, Number, Remark, Result, Shape, Skipped, schema_field


class Row(Shape):
    """Gains at one speed."""

    speed_m_s: float
    """Speed through the water."""
    kp: float
    """rad of fin per rad of error."""
    ki: float
    """rad of fin per rad s."""
    kd: float
    """rad of fin per rad/s."""
    feed_forward_rad: float
    """Fin that cancels the trim."""
    reference_gain: float
    """rad of fin per rad of reference: cancels the stiffness of pitch."""
    fin_limit_rad: float
    """Largest fin."""
    depth_gain: float
    """rad of pitch per m of depth; zero without `--depth`."""
    supported: bool
    """Whether the data were taken at this speed."""
    slowed: float
    """Share of the formula's speed that is left for the fin's lag, delay and the margin; 1 is not slowed."""
    phase_margin_deg: Number
    """Phase margin."""
    gain_margin_db: Number
    """Gain margin; null where the loop never crosses."""
    delay_margin_s: Number
    """Delay margin; the three margins are the least over 95 % of the draws."""
    draws_held: Number
    """Share of the draws with the wished margin that come to rest from the standard step."""
    settling_s: Number
    """Time of 95 % of them to stay within 5 % of it."""
    binds: str
    """What keeps the gains from more bandwidth."""
    fin_use: Number
    """The share of the fin's limit that the step asks for."""


class Actuator(Shape):
    """The fin that the design counted with."""

    lag_s: Number
    """Time constant."""
    delay_s: Number
    """Dead time."""
    fin_rate_rad_s: Number
    """Fastest rate; null where it is not limited."""
    latency_s: Number
    """The autopilot's own."""


class Answer(Shape):
    """The answer to a step that the rows were designed for, and what was asked of it; null where it was not."""

    settling_s: float
    """The time in which all rows settle; zero where each has its own."""
    step_rad: Number
    """The step, the error that may ask for the fin."""
    asked_settling_s: Number
    """The time asked; zero for the quickest."""
    asked_bandwidth_rad_s: Number
    """The bandwidth asked."""
    asked_overshoot: Number
    """The overshoot asked, as a share."""
    asked_fin_use: Number
    """The share of the fin asked."""


class Schedule(Result):
    """Gains per speed."""

    schema_: Literal["fieldsid/schedule/1"] = schema_field("fieldsid/schedule/1")
    axis: AxisName
    """The plane."""
    controller: Literal["p", "pd", "pi", "pid", "lqr"]
    """The controller."""
    damping_ratio: float
    """Damping ratio asked for."""
    phase_margin_wanted_deg: float
    """Phase margin asked for."""
    depth: bool
    """Whether a depth loop is added."""
    actuator: Actuator
    """The fin."""
    answer: Answer
    """The answer to a step."""
    rows: list[Row]
    """One for each speed."""
    stated: dict[str, Any]
    """What was said of the fin when it was designed."""
    provenance: dict[str, Any]
    """Models, runs, sign convention, what holds between and outside the rows."""
    warnings: list[Remark]
    """Why the gains are for each speed's own model, and not for the vehicle that all runs together make believe in."""
    file: str | None
    """The file that was written."""


class StepCheck(Shape):
    """A step of one size."""

    step_rad: float
    """Its size."""
    said: bool
    """Whether overshoot and settling are said; not those of a large step of an unstable hull that no run turned as tight."""
    overshoot_percent: Number
    """Overshoot by the estimate."""
    overshoot_most_percent: Number
    """Largest over 95 % of the draws."""
    settling_s: Number
    """Time to stay within 5 % by the estimate; null if never."""
    settling_most_s: Number
    """Longest over 95 % of the draws."""
    settling_median_s: Number
    """The middle of the draws."""
    settling_interval95_s: list[Number]
    """The band that holds 95 % of the draws, with what a flight is off its model's."""
    swing_percent: Number
    """What still swings in the last quarter of the flight, peak to peak."""
    steady_error_most_rad: Number
    """How far from what was asked it comes to rest, by 95 % of the draws: the error of the trim."""
    flown_s: Number
    """How long it was flown."""


class Check(Shape):
    """One speed under one set of gains."""

    speed_m_s: float
    """The speed."""
    knot: bool
    """Whether it is a row's own; else it lies between two."""
    supported: bool
    """Whether the data were taken there."""
    constant_gain: bool
    """Whether the gains are the constant ones."""
    phase_margin_deg: Number
    """Phase margin of the estimate."""
    gain_margin_db: Number
    """Its gain margin."""
    delay_margin_s: Number
    """Its delay margin."""
    phase_margin_least_deg: Number
    """Smallest over the draws of the parameters."""
    gain_margin_least_db: Number
    """Smallest over the draws."""
    delay_margin_least_s: Number
    """Smallest over the draws."""
    unstable_draws: int
    """How many of the draws are unstable."""
    overshoot_percent: Number
    """Overshoot of the standard step, 20 deg of heading or 10 deg of pitch."""
    overshoot_most_percent: Number
    """Largest over the draws."""
    settling_s: Number
    """Time to stay within 5 % of the step; null if never."""
    settling_most_s: Number
    """Longest over 95 % of the draws."""
    steps: list[StepCheck]
    """A small, the standard and a large step."""
    speed_least_m_s: Number
    """The least speed in the large step."""
    fin_offset_error_rad: Number
    """Steady error with a fin 3 deg off that the feed-forward knows."""
    fin_offset_error_unknown_rad: Number
    """The same with one it does not."""
    leg_rms_rad: Number
    """Angle on a straight leg in the disturbance of the models' runs."""
    leg_fin_rms_rad: Number
    """The fin there."""
    depth_overshoot_percent: Number
    """Overshoot of a step of depth."""
    depth_settling_s: Number
    """Its settling time."""
    depth_flown_s: Number
    """How long it was flown."""
    answer_s: Number
    """The time to settle that the rows are designed by."""
    fin_use: Number
    """The share of the fin's limit that the step asks for."""


class Worst(Shape):
    """The least margins and the most overshoot, over speeds and draws."""

    phase_margin_deg: Number
    """Phase margin."""
    gain_margin_db: Number
    """Gain margin."""
    delay_margin_s: Number
    """Delay margin."""
    overshoot_percent: Number
    """Overshoot."""


class Gate(Shape):
    """A limit that was asked for."""

    gate: str
    """Its name."""
    wanted: float
    """The limit."""
    found: Number
    """What was found."""
    speed_m_s: Number
    """The speed it was found at."""
    passed: bool
    """Whether it holds."""


class FlownNumbers(Shape):
    """What a step that was flown came to."""

    overshoot_percent: Number
    """Overshoot of the angle averaged over half a second."""
    settling_s: Number
    """Time to stay within 5 %; null if it was not there at the end of the step."""
    steady_error_rad: Number
    """What was asked less where it came to rest."""


class PromisedStep(Shape):
    """One step of the goal, flown and promised."""

    run: str
    """Name of the run."""
    t_start_s: float
    """When the goal changed."""
    speed_m_s: float
    """Median speed of the step."""
    step_rad: float
    """From the angle then to the goal."""
    held_s: float
    """How long the goal was held."""
    flown: FlownNumbers
    """What was flown."""
    promised: StepCheck
    """What a verification says of this step at this speed."""
    broken: list[str]
    """The numbers that are worse than 95 % of the draws say."""
    as_promised: bool
    """Whether none is."""


class AsPromised(Result):
    """The steps that were flown with a schedule."""

    schema_: Literal["fieldsid/as-promised/1"] = schema_field("fieldsid/as-promised/1")
    gains: str
    """The schedule's file."""
    axis: AxisName
    """The plane."""
    as_promised: bool
    """Whether every step went as its verification says."""
    steps: list[PromisedStep]
    """The steps."""
    skipped_runs: list[Skipped]
    """Runs without a step of the goal, and why."""


class Verification(Result):
    """A schedule checked over the identified set."""

    schema_: Literal["fieldsid/verification/1"] = schema_field("fieldsid/verification/1")
    verdict: str
    """The verdict in a word."""
    says: str
    """The same in a sentence, with its number."""
    rests_on: str
    """What it rests on."""
    against_constant: str
    """How it compares with the best one gain for all speeds."""
    constant_gains: dict[str, float]
    """That gain."""
    axis: AxisName
    """The plane."""
    controller: str
    """The controller."""
    worst: Worst
    """The worst of all."""
    scheduled: list[Check]
    """The schedule, at its rows and between."""
    constant: list[Check]
    """One constant gain, at the same speeds."""
    gates: list[Gate]
    """The limits that were asked for."""
    passed: bool
    """Whether all hold; where not, the exit code is 1."""
    figure: str | None
    """The figure that was drawn."""


class Export(Shape):
    """The gains in the vehicle's own format."""

    headline: Headline | None = None
    """The first lines of the same result as text."""
    schema_: Literal["fieldsid/export/1"] = schema_field("fieldsid/export/1")
    target: str
    """The format."""
    text: str
    """The file's text."""
    file: str | None
    """The file that was written."""
    difference: str
    """How a file that was replaced has changed, as a unified difference."""
    backup: str | None
    """That file as it was; null where none was replaced."""


class Patch(Shape):
    """The gains put into a file that exists, with `--into`."""

    headline: Headline | None = None
    """The first lines of the same result as text."""
    schema_: Literal["fieldsid/export/1"] = schema_field("fieldsid/export/1")
    target: Literal["into"]
    """Always `into`."""
    difference: str
    """What changes, as a unified difference."""
    file: str
    """The file."""
    backup: str | None
    """The file as it was; null where nothing was changed."""
