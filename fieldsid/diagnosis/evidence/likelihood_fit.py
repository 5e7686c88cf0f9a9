"""Fits of one model (base and some effects) to the training runs: by output error and by maximum likelihood.

Output error fits the free run. Maximum likelihood alternates generalised least squares for the parameters with an estimate of the
noise model (disturbance moment, coloured sensor noise). Models are compared by this likelihood: a model that lacks an effect
needs a larger disturbance, which lowers it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fieldsid.diagnosis.evidence.information import Information, information
from fieldsid.diagnosis.thresholds import ALTERNATIVE_LOG_ODDS
from fieldsid.fitting.covariance.noise_selection import residuals_of
from fieldsid.fitting.initial.effect_screen import equivalent_solution
from fieldsid.fitting.optimise.levenberg_marquardt import dynamics_of, levenberg_marquardt
from fieldsid.fitting.optimise.residual_weights import white_weights
from fieldsid.fitting.problem.parameters import ParameterLayout
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.effect import Effect
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.noise.own_moment import FIN_REPEATABILITY_RAD, MomentInformation, estimate_noise_of_runs, moment_information
from fieldsid.noise.white_floor import WhiteBounds
from fieldsid.numerics.arrays import FloatArray
from fieldsid.rounding import nine_digits

MAX_ALTERNATIONS = 3
MAX_GLS_ITERATIONS = 8
MIN_LIKELIHOOD_GAIN = 0.5
MAX_REMAINING_GAIN_RATIO = 10.0
"""Largest total gain in log likelihood of all further iterations, as a multiple of the gain of the last one."""
MAX_OUTPUT_ERROR_ITERATIONS = 25
OUTPUT_ERROR_COST_TOLERANCE, LIKELIHOOD_COST_TOLERANCE = 1e-4, 1e-5
"""Relative decrease of the sum of squares below which iterations end: of output error, whose errors are compared to a percent,
and of generalised least squares, whose log likelihoods are compared to 0.5."""


@dataclass(frozen=True, slots=True)
class FittedProblem:
    """A problem with its parameter vector x, and the white noise of each channel from the residuals at x."""

    problem: Problem
    x: FloatArray
    weights: Noise

    @property
    def vector(self) -> tuple[ParameterLayout, FloatArray]:
        """The layout and the parameter vector, as arguments of `carry_parameters`."""
        return self.problem.layout, self.x

    def by_output_error(self) -> FittedProblem:
        """Return the output-error fit that starts at x."""
        return fit_output_error(self.problem, self.x, self.weights)

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects of the model, in the order they were added."""
        return self.problem.layout.effects

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the effects."""
        return tuple(e.name for e in self.effects)


@dataclass(frozen=True)
class LikelihoodFit:
    """A maximum-likelihood fit: generalised least squares under the noise model estimated with it, and the log likelihood.

    It includes the log prior density of the noise, so that a disturbance slower than any sea cannot replace a missing effect.
    """

    fitted: FittedProblem
    noise: Noise
    log_likelihood: float
    noise_kind: str
    white: WhiteBounds

    @cached_property
    def information(self) -> Information:
        """The information of the training runs on the parameters."""
        return information(self.fitted.problem, self.fitted.x, self.noise)

    @cached_property
    def own_moments(self) -> tuple[MomentInformation, ...]:
        """The information of each training run on a constant moment in that run."""
        problem, x = self.fitted.problem, self.fitted.x
        return moment_information(problem.records, dynamics_of(problem, x), residuals_of(problem, x), self.noise)


def fit_output_error(
    problem: Problem,
    start: FloatArray,
    weights: Noise,
    max_iterations: int = MAX_OUTPUT_ERROR_ITERATIONS,
    tolerance: float = OUTPUT_ERROR_COST_TOLERANCE,
) -> FittedProblem:
    """Return the output-error fit from a start, reweighted once by its residuals."""
    found = levenberg_marquardt(problem, start, weights, max_iterations=max_iterations, tolerance=tolerance)
    new = white_weights(problem, found.x)
    if abs(np.log(new.angle / weights.angle)) + abs(np.log(new.rate / weights.rate)) > 0.1:
        found = levenberg_marquardt(problem, found.x, new, max_iterations=max_iterations, tolerance=tolerance)
        new = white_weights(problem, found.x)
    return FittedProblem(problem, found.x, new)


def fit_maximum_likelihood(
    problem: Problem, x: FloatArray, start: Noise, white: WhiteBounds, noise_kind: str, *, rival: float = -np.inf
) -> LikelihoodFit:  # fmt: skip
    """Return the maximum-likelihood fit that starts from x.

    Generalised least squares of the parameters and estimation of the noise alternate. The white part of
    the noise stays within `white`. The fit stops early where it cannot reach the log likelihood `rival`.
    """
    noise, likelihood = _noise_at(problem, x, start, white, noise_kind)
    for _ in range(MAX_ALTERNATIONS):
        found = levenberg_marquardt(problem, x, noise, max_iterations=MAX_GLS_ITERATIONS, tolerance=LIKELIHOOD_COST_TOLERANCE)
        new_noise, new = _noise_at(problem, found.x, noise, white, noise_kind, reinitialise=False)
        if not new > likelihood:
            break
        gained, x, noise, likelihood = new - likelihood, found.x, new_noise, new
        if gained < MIN_LIKELIHOOD_GAIN or likelihood + MAX_REMAINING_GAIN_RATIO * gained < rival:
            break
    return LikelihoodFit(FittedProblem(problem, x, white_weights(problem, x)), noise, likelihood, noise_kind, white)


def _noise_at(
    problem: Problem, x: FloatArray, start: Noise, white: WhiteBounds, noise_kind: str, *, reinitialise: bool = True
) -> tuple[Noise, float]:  # fmt: skip
    residuals, dynamics = residuals_of(problem, x), dynamics_of(problem, x)
    return estimate_noise_of_runs(
        problem.records, dynamics, residuals, noise_kind, start, white, largest_own_moment(problem, x),
        reinitialise=reinitialise, evaluations=problem.evaluations,
    )  # fmt: skip


def largest_own_moment(problem: Problem, x: FloatArray) -> float:
    """Return the largest standard deviation (rad/s^2) of the trim moments between runs: that of the zero of a fin, times |b2|."""
    return FIN_REPEATABILITY_RAD * max(abs(problem.base_of(x, run).authority) for run in range(len(problem.records)))


def exchange_penalty(ml_fit: LikelihoodFit) -> float:
    """Return the prior log odds against effects whose coefficient is the larger of two equivalent solutions.

    A servo slower than the hull it steers is as unusual as a variant other than the textbook's.
    """
    problem, x = ml_fit.fitted.problem, ml_fit.fitted.x
    total = 0.0
    for effect in ml_fit.fitted.effects:
        other = equivalent_solution(problem, x, effect)
        if other is not None:
            place = problem.layout.names.index(effect.coefficients[0].name)
            total += ALTERNATIVE_LOG_ODDS * (nine_digits(float(other[place])) < nine_digits(float(x[place])))
    return total


def measured_count(records: Sequence[Record]) -> int:
    """Return the number of measured values."""
    return int(sum(r.angle_ok.sum() + r.rate_ok.sum() for r in records))
