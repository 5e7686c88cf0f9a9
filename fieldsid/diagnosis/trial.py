"""One hypothesis about the runs: base model and some effects, fitted to the training runs, judged by likelihood.

A trial is fitted twice: by output error, which gives the free run, and by generalised least squares under its own
noise model (disturbance moment, coloured sensors), whose likelihood is what hypotheses are compared by. A missing
effect must be paid for by a disturbance; the right effect needs none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldsid.fitting.colour import residuals_of
from fieldsid.fitting.descent import descend, dynamics_of
from fieldsid.fitting.noise import estimate_noise, log_likelihood
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.starts import twin_of
from fieldsid.fitting.weights import white_weights
from fieldsid.fitting.whitening import noise_vector
from fieldsid.logs.run import FloatArray
from fieldsid.models.effect import Effect
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.rounding import nine_digits

NOISES, BOTH = ("disturbance", "coloured"), "both"
"""Kinds of noise that hypotheses are compared under, and the two together."""
ALTERNATIONS = 3
POLISH_ROUNDS = 8
SETTLED = 0.5
HOPE = 10.0
"""What the rounds to come gain at most, in gains of the last one."""
REFINE_ROUNDS = 25
TWINS = 1.0
"""Log likelihood within which two starts of one hypothesis are alike."""
COARSE, FINE = 1e-4, 1e-5
"""Share of the sum of squares a round must gain: of free runs that are compared to the percent, of likelihoods to a half."""


@dataclass(frozen=True, slots=True)
class Trial:
    """A hypothesis at a vector x of its problem's layout, with white channel weights from its own residuals."""

    problem: Problem
    x: FloatArray
    weights: Noise

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects of the hypothesis, in the order they were added."""
        return self.problem.layout.effects

    @property
    def names(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(e.name for e in self.effects)


@dataclass(frozen=True, slots=True)
class Judged:
    """A trial at its generalised least squares under its own noise model, and the log likelihood there."""

    trial: Trial
    noise: Noise
    likelihood: float
    family: str
    floor: Noise


def refine(problem: Problem, start: FloatArray, weights: Noise, rounds: int = REFINE_ROUNDS, tolerance: float = COARSE) -> Trial:
    """Return the output-error trial a start leads to, reweighted once by its own residuals."""
    found = descend(problem, start, weights, rounds=rounds, tolerance=tolerance)
    new = white_weights(problem, found.x)
    if abs(np.log(new.angle / weights.angle)) + abs(np.log(new.rate / weights.rate)) > 0.1:
        found = descend(problem, found.x, new, rounds=rounds, tolerance=tolerance)
        new = white_weights(problem, found.x)
    return Trial(problem, found.x, new)


def judge(
    problem: Problem, x: FloatArray, start: Noise, floor: Noise, family: str, *, rival: float = -np.inf
) -> Judged:  # fmt: skip
    """Return a hypothesis under the noise of highest likelihood, parameters and noise improved in turn from x.

    floor is what the white part of the noise stays near. One that has no hope of a rival's likelihood is left as it is.
    """
    noise, likelihood = _noise_at(problem, x, start, floor, family)
    for _ in range(ALTERNATIONS):
        found = descend(problem, x, noise, rounds=POLISH_ROUNDS, tolerance=FINE)
        new_noise, new = _noise_at(problem, found.x, noise, floor, family, wake=False)
        if not new > likelihood:
            break
        gained, x, noise, likelihood = new - likelihood, found.x, new_noise, new
        if gained < SETTLED or likelihood + HOPE * gained < rival:
            break
    return Judged(Trial(problem, x, white_weights(problem, x)), noise, likelihood, family, floor)


def _noise_at(
    problem: Problem, x: FloatArray, start: Noise, floor: Noise, family: str, *, wake: bool = True
) -> tuple[Noise, float]:  # fmt: skip
    residuals, dynamics = residuals_of(problem, x), dynamics_of(problem, x)
    return estimate_noise(problem.records, dynamics, residuals, family, start, floor=floor, wake=wake)


def smaller_twin(judged: Judged, effect: Effect) -> Judged:
    """Return the likelier of a trial and its twin, which has the same response at one speed: of two alike the smaller effect."""
    problem = judged.trial.problem
    other = twin_of(problem, judged.trial.x, effect)
    if other is None:
        return judged
    twin = judge(problem, other, judged.noise, judged.floor, judged.family)
    place = problem.layout.names.index(effect.coefficients[0].name)
    if abs(twin.likelihood - judged.likelihood) < TWINS:
        return min(judged, twin, key=lambda j: nine_digits(j.trial.x[place]))
    return twin if twin.likelihood > judged.likelihood else judged


def likelihood_at(problem: Problem, x: FloatArray, judged: Judged) -> float:
    """Return the log likelihood of other parameters of a hypothesis under the noise of its family that is likeliest there."""
    return _noise_at(problem, x, judged.noise, judged.floor, judged.family)[1]


def likelihood_by_run(problem: Problem, x: FloatArray, noise: Noise) -> FloatArray:
    """Return each run's log likelihood, (R,)."""
    residuals, dynamics, vector = residuals_of(problem, x), dynamics_of(problem, x), noise_vector(noise)
    return np.array([log_likelihood([r], [d], [e], vector) for r, d, e in zip(problem.records, dynamics, residuals, strict=True)])


def samples(records: Sequence[Record]) -> int:
    """Return the number of measured values."""
    return int(sum(r.angle_ok.sum() + r.rate_ok.sum() for r in records))
