"""What a diagnosis says: frozen records, from the errors of one hypothesis to the verdict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite, prod
from typing import Any

from fieldsid.display import Brief, Displayed, Plotted
from fieldsid.logs.run import Note
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise


@dataclass(frozen=True, slots=True, repr=False)
class Errors(Brief):
    """Free-run error over some runs: rms of measured minus simulated angle (rad) and rate (rad/s), and of each run alone."""

    angle_rms_rad: float
    rate_rms_rad_s: float
    each: tuple[Errors, ...] = ()

    def over(self, floor: Noise) -> float:
        """Return the error over the noise floor, both measured channels pooled."""
        parts = [
            (rms / sigma) ** 2
            for rms, sigma in ((self.angle_rms_rad, floor.angle), (self.rate_rms_rad_s, floor.rate))
            if isfinite(rms) and sigma > 0.0
        ]
        return float((sum(parts) / len(parts)) ** 0.5) if parts else float("nan")

    @property
    def mean(self) -> float:
        """The geometric mean of both channels: the heading, where every error adds up, has no more say."""
        known = [e for e in (self.angle_rms_rad, self.rate_rms_rad_s) if isfinite(e)]
        return float(prod(known) ** (1.0 / len(known))) if known else float("inf")


@dataclass(frozen=True, slots=True, repr=False)
class Pair(Brief):
    """Errors on the runs learned from and on runs not seen."""

    train: Errors
    validation: Errors


@dataclass(frozen=True, slots=True, repr=False)
class Candidate(Displayed):
    """One hypothesis: effects, probability among all that were tried, parameters, errors, and the evidence in words.

    explained is the share of the excess error it takes away, 0..1; worse tells that it raises the error instead.
    confusable_with are those that are likely enough to be it in its stead.
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
class Diagnosis(Plotted):
    """The verdict, what led to it, and the model with the named effects added."""

    axis: Axis
    verdict: str
    effects: tuple[str, ...]
    says: str
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
