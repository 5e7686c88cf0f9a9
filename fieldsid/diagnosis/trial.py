"""One hypothesis about the runs: base model and some effects, fitted to the training runs, judged by likelihood.

A trial is fitted twice: by output error, which gives the free run, and by generalised least squares under its own
noise model (disturbance moment, coloured sensors), whose likelihood is what hypotheses are compared by. A missing
effect must be paid for by a disturbance; the right effect needs none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fieldsid.fitting.colour import dynamics_of, residuals_of
from fieldsid.fitting.descent import descend
from fieldsid.fitting.layout import layout_of
from fieldsid.fitting.noise import estimate_noise, log_likelihood
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.whitening import noise_vector
from fieldsid.logs.run import FloatArray
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Effect
from fieldsid.models.model import Noise
from fieldsid.models.record import Record

FAMILY = "disturbance"
ALTERNATIONS = 3
POLISH_ROUNDS = 8
SETTLED = 0.5
REFINE_ROUNDS = 25


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


def refine(problem: Problem, start: FloatArray, weights: Noise, rounds: int = REFINE_ROUNDS) -> Trial:
    """Return the output-error trial a start leads to, reweighted once by its own residuals."""
    found = descend(problem, start, weights, rounds=rounds, tolerance=1e-5)
    new = white_weights(problem, found.x)
    if abs(np.log(new.angle / weights.angle)) + abs(np.log(new.rate / weights.rate)) > 0.1:
        found = descend(problem, found.x, new, rounds=rounds, tolerance=1e-5)
        new = white_weights(problem, found.x)
    return Trial(problem, found.x, new)


def white_weights(problem: Problem, x: FloatArray) -> Noise:
    """Return the residual standard deviations of both channels."""
    squares, counts = np.zeros(2), np.zeros(2)
    for run, record in enumerate(problem.records):
        residual, _ = problem.residual(x, run)
        squares += (residual**2).sum(axis=1)
        counts += (record.angle_ok.sum(), record.rate_ok.sum())
    sigma = np.sqrt(np.maximum(squares, 1e-20) / np.maximum(counts, 1.0))
    sigma = np.where(np.isfinite(sigma), sigma, 1.0)
    return Noise(float(max(sigma[0], 1e-9)), float(max(sigma[1], 1e-9)))


def grown(parent: Trial, effect: Effect, values: Mapping[str, float]) -> tuple[Problem, FloatArray]:
    """Return the problem with one effect more, and the parent's vector with the effect's slots at the given values."""
    records = parent.problem.records
    layout = layout_of(records, parent.problem.layout.axis, (*parent.effects, effect), parent.problem.layout.groups)
    known = {(s.name, s.run): v for s, v in zip(parent.problem.layout.slots, parent.x, strict=True)}
    x = np.array([known.get((s.name, s.run), values.get(s.name, s.start)) for s in layout.slots])
    if effect.extra_states and "damping_exponent" in layout.names:
        # a hidden state that is missing drives the exponent far from physics, and a descent does not come back
        place = layout.names.index("damping_exponent")
        x[place] = np.clip(x[place], 0.0, 1.2)
    return Problem(records, layout), x


def without(parent: Trial, effect: Effect) -> tuple[Problem, FloatArray]:
    """Return the problem with one effect less, at the parent's values."""
    layout = layout_of(parent.problem.records, parent.problem.layout.axis, tuple(e for e in parent.effects if e is not effect))
    known = {(s.name, s.run): v for s, v in zip(parent.problem.layout.slots, parent.x, strict=True)}
    x = np.array([known.get((s.name, s.run), s.start) for s in layout.slots])
    return Problem(parent.problem.records, layout), x


def judge(problem: Problem, x: FloatArray, start: Noise, family: str = FAMILY) -> Judged:
    """Return a hypothesis under the noise of highest likelihood, parameters and noise improved in turn from x."""
    noise, likelihood = _noise_at(problem, x, start, family)
    for _ in range(ALTERNATIONS):
        found = descend(problem, x, noise, rounds=POLISH_ROUNDS, tolerance=1e-6)
        new_noise, new = _noise_at(problem, found.x, noise, family)
        if not new > likelihood:
            break
        gained, x, noise, likelihood = new - likelihood, found.x, new_noise, new
        if gained < SETTLED:
            break
    return Judged(Trial(problem, x, white_weights(problem, x)), noise, likelihood, family)


def _noise_at(problem: Problem, x: FloatArray, start: Noise, family: str) -> tuple[Noise, float]:
    return estimate_noise(problem.records, dynamics_of(problem, x), residuals_of(problem, x), family, start)


def likelihood_by_run(problem: Problem, x: FloatArray, noise: Noise) -> FloatArray:
    """Return each run's log likelihood, (R,)."""
    residuals, dynamics, vector = residuals_of(problem, x), dynamics_of(problem, x), noise_vector(noise)
    return np.array([log_likelihood([r], [d], [e], vector) for r, d, e in zip(problem.records, dynamics, residuals, strict=True)])


def samples(records: Sequence[Record]) -> int:
    """Return the number of measured values."""
    return int(sum(r.angle_ok.sum() + r.rate_ok.sum() for r in records))


def axis_of(trial: Trial) -> Axis:
    """Return the axis of a trial."""
    return trial.problem.layout.axis
