"""The records of a diagnosis, from the errors of one model to the verdict; all frozen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite, prod
from typing import Annotated, Literal

from fieldsid.comparison.localize import Place
from fieldsid.comparison.sufficient import pooled_over_noise
from fieldsid.display import Brief, Displayed, Plotted
from fieldsid.logs.run import Note
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise
from fieldsid.records.keys import INLINE, Key, Number, Words
from fieldsid.rounding import number


@dataclass(frozen=True, slots=True, repr=False)
class Errors(Brief):
    """Free-run error over some runs: rms of measured minus simulated angle (rad) and rate (rad/s), and that of each run."""

    angle_rms_rad: Annotated[Number, Key("Of the angle, in rad.")]
    rate_rms_rad_s: Annotated[Number, Key("Of the rate, in rad/s.")]
    each: tuple[Errors, ...] = ()

    @property
    def runs(self) -> tuple[Errors, ...]:
        """The errors of each run; where they are not known, those over all."""
        return self.each or (self,)

    def over(self, floor: Noise) -> float:
        """Return the ratio of the error to the noise floor, pooled over both measured channels."""
        return pooled_over_noise((self.angle_rms_rad, floor.angle), (self.rate_rms_rad_s, floor.rate))

    def sized(self, angle: str = "rad", factor: float = 1.0) -> str:
        """Return, in words, the errors of the measured channels in rad, or in a unit of angle of which `factor` are one rad."""
        parts = ((self.angle_rms_rad, angle), (self.rate_rms_rad_s, f"{angle}/s"))
        return " and ".join(f"{number(factor * rms, 2)} {unit}" for rms, unit in parts if isfinite(rms))

    @property
    def mean(self) -> float:
        """The geometric mean of both channels, so that the heading, which integrates every error, does not dominate."""
        known = [e for e in (self.angle_rms_rad, self.rate_rms_rad_s) if isfinite(e)]
        return float(prod(known) ** (1.0 / len(known))) if known else float("inf")


@dataclass(frozen=True, slots=True, repr=False)
class Pair(Brief):
    """Errors on the training and on the validation runs."""

    train: Annotated[Errors, Key("On the runs the model was fitted to.")]
    validation: Annotated[Errors, Key("On runs the fit did not see; null inside where there are none.")]

    @property
    def runs(self) -> tuple[Errors, ...]:
        """The errors of each run that was measured."""
        return tuple(run for side in (self.train, self.validation) for run in side.runs if isfinite(run.mean))


@dataclass(frozen=True, slots=True, repr=False)
class Candidate(Displayed):
    """One model: its effects, its probability among the sets tried or not, parameters, errors, and the evidence in a sentence.

    `explained` is the share of the excess error it removes, 0..1; `worse` says that it raises the error instead.
    `confusable_with` are models of comparable probability that remove as much.
    """

    effects: tuple[str, ...]
    probability: Annotated[
        float, Key("Its probability among all that are worth having and the base, from half the log evidence.")
    ]
    parameters: Annotated[Mapping[str, Number], Key("Its values at the law's reference speed.")]
    errors: Annotated[Pair, INLINE]
    explained: Annotated[float, Key("Share of the base's excess over the noise floor that it takes away, 0 to 1.")]
    score: Annotated[float, Key("Log evidence over that of the base.", "log_evidence")]
    evidence: Annotated[str, Key("What speaks for it, in one sentence.")]
    confusable_with: Annotated[
        tuple[str, ...], Key("Hypotheses of the same size that take away nearly as much on these data.")
    ] = ()
    worse: Annotated[bool, Key("Whether it raises the error instead of taking some away.")] = False

    @property
    def effect(self) -> Annotated[str, Key()]:
        """The effects joined by a plus."""
        return "+".join(self.effects) if self.effects else "none"


@dataclass(frozen=True, slots=True, repr=False)
class Left(Brief):
    """The error that remains with the named effects, or with the base where none is named.

    `ratio`: the free-run error over the noise floor, of fitted or of unseen runs, whichever is larger, at the parameters of the
    fitted runs or of all runs, whichever are better. `unexplained`: it is
    visible, and its innovations are no disturbance's. It is largest in `run` from `start_s` to `end_s`, `burst` times the
    average, and follows `moves_with`, empty where no test says so.
    """

    ratio: Annotated[
        Number,
        Key(
            "The error over the noise floor: the larger of fitted and unseen runs, at the better of their and all runs' numbers."
        ),
    ]
    unexplained: Annotated[bool, Key("Whether it is visible and no disturbance.")]
    run: str = ""
    start_s: float = float("nan")
    end_s: float = float("nan")
    burst: float = 1.0
    moves_with: Annotated[Words, Key("The signal it follows; null where no test says so.")] = ""

    @property
    def where(self) -> Annotated[Words, Key()]:
        """The run and the seconds where it is largest; empty where nothing is left."""
        return f"{self.run} at {self.start_s:.0f}-{self.end_s:.0f} s" if self.run else ""


@dataclass(frozen=True, slots=True)
class NextManeuver:
    """What to fly next."""

    maneuver: Annotated[str, Key("The maneuver, or what else to do.")]
    why: Annotated[str, Key("What it is expected to show.")]
    separates: Annotated[tuple[str, ...] | None, Key("The effects it tells apart.", is_optional=True)] = None
    command: Annotated[str | None, Key("The command that plans it.", is_optional=True)] = None
    note: Annotated[str | None, Key("What to know about it.", is_optional=True)] = None
    expected_log_odds: Annotated[float | None, Key("Log odds it is expected to give for the right one.", is_optional=True)] = None
    spec: Annotated[str | None, Key("The maneuver with its parameters, as `--maneuver` takes it.", is_optional=True)] = None
    parameters: Annotated[Mapping[str, float] | None, Key("Its parameters.", is_optional=True)] = None
    speed_m_s: Annotated[float | None, Key("The speed to fly it at.", is_optional=True)] = None
    duration_s: Annotated[float | None, Key("Its length.", is_optional=True)] = None
    expected_odds: Annotated[float | None, Key("The same as odds.", is_optional=True)] = None
    pairs: Annotated[Mapping[str, Number] | None, Key("Log odds for each true one against each other.", is_optional=True)] = None
    decides: Annotated[bool | None, Key("Whether one pass is expected to give odds of 20 to 1.", is_optional=True)] = None
    alternatives: Annotated[
        Mapping[str, Number] | None, Key("Other maneuvers, with what they are expected to give.", is_optional=True)
    ] = None


FLOOR = "Error that the sensors leave; where they have next to no noise, that of the measured speed."
"""What the noise floor of a diagnosis and of an extension is."""


@dataclass(frozen=True, slots=True)
class HeldAt:
    """The speed that the model's parameters hold at."""

    reference: Annotated[Number, Key("In m/s.", "reference_m_s")]


@dataclass(frozen=True, slots=True, repr=False)
class Diagnosis(Plotted):
    """The verdict, what led to it, and the model with the named effects added.

    `says` is the verdict in a sentence, `short` the same with the effects by their names alone.
    `noiseless`: the logs show almost no noise, so that errors are stated in their units and not over the noise floor.
    """

    axis: Annotated[Axis, Key("The plane.")]
    verdict: Annotated[str, Key("The verdict.", of=Literal["effect", "sufficient", "disturbed", "unexplained", "undecided"])]
    effects: Annotated[tuple[str, ...], Key("The effects named, in the order to add them.")]
    says: Annotated[str, Key("The verdict in a sentence, with its numbers.")]
    short: Annotated[str, Key("The same with the effects by their names alone.")]
    base: Annotated[Pair, Key("Errors of the model as it is.")]
    final: Annotated[Pair, Key("Errors with the named effects added; those of the base where none is.")]
    noise_floor: Annotated[Noise, Key(FLOOR)]
    candidates: Annotated[tuple[Candidate, ...], Key("What was tried, the one found first, then by evidence.")]
    model: Model
    base_model: Model
    where: Annotated[tuple[Place, ...], Key("Where the model as it is fails, the worst first.")] = ()
    next_maneuver: Annotated[NextManeuver | None, Key("What to fly next; null where nothing is open.")] = None
    skipped: Annotated[Mapping[str, str], Key("Effects that could not be tried, and why.")] = field(default_factory=dict)
    notes: Annotated[tuple[Note, ...], Key("What else there is to know.")] = ()
    noiseless: Annotated[bool, Key("Whether the logs show almost no noise, so that errors are told in their units.")] = False
    left: Annotated[Left, Key("What remains beside the named effects.")] = Left(float("nan"), unexplained=False)
    unusual: Annotated[tuple[str, ...], Key("Those of the named effects that not every hull has.")] = ()

    @property
    def speed_law(self) -> Annotated[HeldAt, Key()]:
        """The speed that the parameters hold at."""
        return HeldAt(self.model.law.reference)
