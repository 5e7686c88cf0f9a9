"""The missing effect: diagnose."""

from __future__ import annotations

from typing import Literal

from guide.shapes.common import AxisName, NoiseFloor, Number, Pair, Remark, Result, Shape, Skipped, Where, schema_field
from pydantic import Field


class Candidate(Pair):
    """One hypothesis that was tried: the base with some effects more."""

    effect: str
    """The effects, joined by a plus."""
    probability: float
    """Its probability among all that are worth having and the base, from half the log evidence."""
    parameters: dict[str, Number]
    """Its values at the law's reference speed."""
    explained: float
    """Share of the base's excess over the noise floor that it takes away, 0 to 1."""
    worse: bool
    """Whether it raises the error instead of taking some away."""
    log_evidence: float
    """Log evidence over that of the base."""
    evidence: str
    """What speaks for it, in one sentence."""
    confusable_with: list[str]
    """Hypotheses of the same size that take away nearly as much on these data."""


class SpeedLaw(Shape):
    """The speed that the model's parameters hold at."""

    reference_m_s: Number
    """In m/s."""


class NextManeuver(Shape):
    """What to fly next."""

    maneuver: str
    """The maneuver, or what else to do."""
    why: str
    """What it is expected to show."""
    separates: list[str] = Field(default_factory=list)
    """The effects it tells apart."""
    command: str | None = None
    """The command that plans it."""
    note: str | None = None
    """What to know about it."""
    expected_log_odds: Number = None
    """Log odds it is expected to give for the right one."""
    spec: str | None = None
    """The maneuver with its parameters, as `--maneuver` takes it."""
    parameters: dict[str, float] = Field(default_factory=dict)
    """Its parameters."""
    speed_m_s: Number = None
    """The speed to fly it at."""
    duration_s: Number = None
    """Its length."""
    expected_odds: Number = None
    """The same as odds."""
    pairs: dict[str, Number] = Field(default_factory=dict)
    """Log odds for each true one against each other."""
    decides: bool | None = None
    """Whether one pass is expected to give odds of 20 to 1."""
    alternatives: dict[str, Number] = Field(default_factory=dict)
    """Other maneuvers, with what they are expected to give."""


class Left(Shape):
    """What remains beside the named effects, or of the model as it is where none is named."""

    ratio: Number
    """The error over the noise floor, of fitted or of unseen runs, whichever is larger."""
    unexplained: bool
    """Whether it is visible and no disturbance."""
    where: str | None
    """The run and the seconds where it is largest; null where nothing is left."""
    moves_with: str | None
    """The signal it follows; null where no test says so."""


class Applied(Shape):
    """One of the named effects added with `--apply`."""

    effect: str
    """The effect."""
    model: str
    """The file of the model with it."""
    pays: bool
    """Whether the error on unseen runs falls by it."""
    added: list[str]
    """The effect again, as `extend` has it."""
    before: Pair
    """Errors without it."""
    after: Pair
    """Errors with it."""
    noise_floor: NoiseFloor
    """Noise of the sensors."""
    over_floor: dict[str, Number]
    """The error on the runs that judge, over the noise floor, `before` and `after`."""
    unseen: bool
    """Whether runs that were not fitted judge."""
    learned_on: list[str]
    """Runs that were fitted."""
    judged_on: list[str]
    """Runs it was judged by."""


class Diagnose(Result):
    """Which physical effect the model lacks."""

    schema_: Literal["fieldsid/diagnose/1"] = schema_field("fieldsid/diagnose/1")
    axis: AxisName
    """The plane."""
    verdict: Literal["effect", "sufficient", "disturbed", "unexplained", "undecided"]
    """The verdict."""
    says: str
    """The verdict in a sentence, with its numbers."""
    short: str
    """The same with the effects by their names alone."""
    effects: list[str]
    """The effects named, in the order to add them."""
    unusual: list[str]
    """Those of them that not every hull has."""
    base: Pair
    """Errors of the model as it is."""
    final: Pair
    """Errors with the named effects added; those of the base where none is."""
    noise_floor: NoiseFloor
    """Noise of the sensors."""
    noiseless: bool
    """Whether the logs show almost no noise, so that errors are told in their units."""
    left: Left
    """What remains beside the named effects."""
    candidates: list[Candidate]
    """What was tried, the one found first, then by evidence."""
    where: list[Where]
    """Where the model as it is fails, the worst first."""
    next_maneuver: NextManeuver | None
    """What to fly next; null where nothing is open."""
    skipped: dict[str, str]
    """Effects that could not be tried, and why."""
    notes: list[Remark]
    """What else there is to know."""
    speed_law: SpeedLaw
    """The speed that the parameters hold at."""
    runs: list[str]
    """Runs that were fitted."""
    validation_runs: list[str]
    """Runs it was judged by."""
    model: str | None
    """The model given with `--model`."""
    applied: list[Applied]
    """With `--apply`: the named effects, added one at a time."""
    known: list[str]
    """Its effects, which are part of the base."""
    file: str | None
    """The file that was written."""
    figure: str | None
    """The figure that was drawn."""
    skipped_runs: list[Skipped]
    """Logs that could not be used, and why; where there are any, the exit code is 1."""
