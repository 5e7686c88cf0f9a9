"""The records of a diagnosis, from the errors of one model to the verdict; all frozen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite, prod
from typing import Any

from fieldsid.comparison.sufficient import pooled_over_noise
from fieldsid.display import Brief, Displayed, Plotted
from fieldsid.logs.run import Note
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise
from fieldsid.rounding import number


@dataclass(frozen=True, slots=True, repr=False)
class Errors(Brief):
    """Free-run error over some runs: rms of measured minus simulated angle (rad) and rate (rad/s), and that of each run."""

    angle_rms_rad: float
    rate_rms_rad_s: float
    each: tuple[Errors, ...] = ()

    @property
    def runs(self) -> tuple[Errors, ...]:
        """The errors of each run; where they are not known, those over all."""
        return self.each or (self,)

    def over(self, floor: Noise) -> float:
        """Return the error over the noise floor, both measured channels pooled."""
        return pooled_over_noise((self.angle_rms_rad, floor.angle), (self.rate_rms_rad_s, floor.rate))

    def sized(self, angle: str = "rad", factor: float = 1.0) -> str:
        """Return the errors of the measured channels in their units, in another unit of angle where factor has rad in it."""
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

    train: Errors
    validation: Errors

    @property
    def runs(self) -> tuple[Errors, ...]:
        """The errors of each run that was measured."""
        return tuple(run for side in (self.train, self.validation) for run in side.runs if isfinite(run.mean))


@dataclass(frozen=True, slots=True, repr=False)
class Candidate(Displayed):
    """One model: its effects, probability beside what was tried and what was not, parameters, errors, its evidence in a sentence.

    `explained` is the share of the excess error it removes, 0..1; `worse` says that it raises the error instead.
    `confusable_with` are models of comparable probability that remove as much.
    """

    effects: tuple[str, ...]
    probability: float
    parameters: Mapping[str, float]
    errors: Pair
    explained: float
    score: float
    evidence: str
    confusable_with: tuple[str, ...] = ()
    worse: bool = False

    @property
    def effect(self) -> str:
        """The effects joined by a plus."""
        return "+".join(self.effects) if self.effects else "none"


@dataclass(frozen=True, slots=True, repr=False)
class Left(Brief):
    """What remains beside the named effects, or of the base where none is named.

    `ratio`: the free-run error over the noise floor, of fitted or of unseen runs, whichever is larger. `unexplained`: it is
    visible, and its innovations are no disturbance's. It is largest in `run` from `start_s` to `end_s`, `burst` times the
    average, and follows `moves_with`, empty where no test says so.
    """

    ratio: float
    unexplained: bool
    run: str = ""
    start_s: float = float("nan")
    end_s: float = float("nan")
    burst: float = 1.0
    moves_with: str = ""

    @property
    def where(self) -> str:
        """The place in words; empty where nothing is left."""
        return f"{self.run} at {self.start_s:.0f}-{self.end_s:.0f} s" if self.run else ""


@dataclass(frozen=True, slots=True, repr=False)
class Diagnosis(Plotted):
    """The verdict, what led to it, and the model with the named effects added.

    `says` is the verdict in a sentence, `short` the same with the effects by their names alone.
    `noiseless`: the logs show almost no noise, so that errors are told in their units and not over the noise floor.
    """

    axis: Axis
    verdict: str
    effects: tuple[str, ...]
    says: str
    short: str
    base: Pair
    final: Pair
    noise_floor: Noise
    candidates: tuple[Candidate, ...]
    model: Model
    base_model: Model
    where: tuple[Any, ...] = ()
    next_maneuver: Mapping[str, Any] | None = None
    skipped: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[Note, ...] = ()
    noiseless: bool = False
    left: Left = Left(float("nan"), unexplained=False)
