"""Output error: free-run simulation, least squares on angle and rate weighted by their own residual noise.

Standard errors are those of the residuals' own colour (fitting/uncertainty.py), so that a disturbance or a
missing effect widens them. Source: Ljung 1999, section 7.2; Klein and Morelli 2006, chapter 6.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.fitting.colour import chosen_noise
from fieldsid.fitting.descent import Descent, covariance, descend, normal_equations, sandwich
from fieldsid.fitting.grow import grown_start
from fieldsid.fitting.method import Estimator, Options, Solution, shared_covariance
from fieldsid.fitting.noise import floor_of
from fieldsid.fitting.problem import Problem, RunResult
from fieldsid.fitting.restricted import lines_of, restricted_likelihood
from fieldsid.fitting.small_sample import FEWEST_DEGREES_PLAIN, LONG, noise_spread, widened
from fieldsid.fitting.unbounded import refuse_unbounded
from fieldsid.fitting.uncertainty import middle
from fieldsid.fitting.weights import squares_of
from fieldsid.fitting.whitening import noise_vector
from fieldsid.logs.run import FloatArray
from fieldsid.models.model import Noise

REWEIGHTINGS = 2
ROUGH = 1e-3
"""Relative change of the cost at which a descent under provisional weights ends."""
NEGLIGIBLE = 0.02
"""Change of both weights, in logs, that does not move the minimum."""
CLOSE = 1e-4
"""The same on a long record, whose start is near the end."""
NEAR = 1e-9
"""Marquardt's damping of its first step: a larger one would stop short of the minimum by more than its error."""
FIRST_PARTS = (5_000, 50_000)
"""Samples of the first parts of a long record."""


def residual_noise(problem: Problem, x: FloatArray, parameters: int) -> Noise:
    """Return the residual standard deviation of both channels, corrected for the parameters estimated."""
    squares, counts = squares_of(problem, x)
    lost = parameters * counts / max(float(counts.sum()), 1.0)
    sigma = np.sqrt(squares / np.maximum(counts - lost, 1.0))
    floor = floor_of(problem.records)
    return Noise(
        float(sigma[0]) if sigma[0] > 0 else floor.angle,
        float(sigma[1]) if sigma[1] > 0 else floor.rate,
    )


def minimise(problem: Problem, start: FloatArray, noise: Noise) -> tuple[Descent, Noise]:
    """Return the output-error minimum from a start, with weights from its own residuals."""
    found = descend(problem, start, noise, tolerance=ROUGH)
    for _ in range(REWEIGHTINGS):
        new = residual_noise(problem, found.x, len(found.free))
        found = descend(problem, found.x, new)
        change = abs(np.log(new.angle / noise.angle)) + abs(np.log(new.rate / noise.rate))
        noise = new
        if change < NEGLIGIBLE:
            break
    return found, noise


def found_minimum(problem: Problem) -> tuple[Descent, Noise]:
    """Return the output-error minimum of a problem and its weights; raises DivergenceError where no start leads to any."""
    found, weights = _found_over_parts(problem)
    refuse_unbounded(problem, found.x, ESTIMATOR.name, instead="leave effects out")
    return found, weights


def _found_over_parts(problem: Problem) -> tuple[Descent, Noise]:
    """Return the minimum that a long record comes to over the minima of ever longer first parts, a short one at once.

    Each is so near the next one's that a step or two lead there.
    """
    floor, longest = floor_of(problem.records), max(len(r) for r in problem.records)
    first = problem if longest <= 2 * FIRST_PARTS[0] else problem.first(FIRST_PARTS[0])
    found, weights = minimise(first, grown_start(first, floor), floor)
    if first is problem:
        return found, weights
    for samples in FIRST_PARTS[1:]:
        if longest > 2 * samples:
            found = descend(problem.first(samples), found.x, weights, tolerance=ROUGH, damping=NEAR)
    found = descend(problem, found.x, weights, tolerance=CLOSE, damping=NEAR)
    new = residual_noise(problem, found.x, len(found.free))
    if abs(np.log(new.angle / weights.angle)) + abs(np.log(new.rate / weights.rate)) < NEGLIGIBLE:
        return found, weights
    return descend(problem, found.x, new, tolerance=CLOSE, damping=NEAR), new


def coloured_covariance(problem: Problem, found: Descent, weights: Noise, noise: Noise) -> FloatArray:
    """Return the covariance (F, F) of an output-error estimate under a noise model of any colour."""
    _, normal, _, results = normal_equations(problem, found.x, weights, found.free)
    return _sandwich(problem, found, weights, noise_vector(noise), normal, results)


def _sandwich(
    problem: Problem, found: Descent, weights: Noise, noise: FloatArray, normal: FloatArray, results: Sequence[RunResult]
) -> FloatArray:
    sigma = np.array([weights.angle, weights.rate])
    place = {slot: i for i, slot in enumerate(found.free)}
    centre = np.zeros_like(normal)
    for record, result in zip(problem.records, results, strict=True):
        weighted = np.where(record.ok, result.sensitivity / sigma[:, None] ** 2, 0.0)
        index = np.array([place[s] for s in result.slots])
        centre[np.ix_(index, index)] += middle(record, noise, result.base.damping, result.base.stiffness, weighted)
    return sandwich(normal, centre)


def errors(problem: Problem, found: Descent, weights: Noise, noise: Noise, family: str) -> FloatArray:
    """Return the covariance (F, F) of the estimate, allowing on short records for noise that is not known exactly."""
    if family == "white":
        return covariance(found.normal)
    _, normal, _, results = normal_equations(problem, found.x, weights, found.free)
    vector = noise_vector(noise)
    if sum(len(r) for r in problem.records) > LONG:
        return _sandwich(problem, found, weights, vector, normal, results)
    lines, count = lines_of(problem, found.x), len(problem.layout.slots)
    spread = noise_spread(lambda v: restricted_likelihood(lines, count, v), vector, family)
    still = found.x[list(found.free)]
    return widened(
        lambda v: (still, _sandwich(problem, found, weights, v, normal, results)), vector, family, spread, FEWEST_DEGREES_PLAIN
    )


def solve(problem: Problem, _options: Options) -> Solution:
    """Return the output-error solution of a joint problem."""
    found, weights = found_minimum(problem)
    family, noise, notes = chosen_noise(problem, found.x, weights)
    full = errors(problem, found, weights, noise, family)
    return Solution(found.x, shared_covariance(problem, full, found.free), noise, ESTIMATOR.name, notes)


ESTIMATOR = Estimator(
    name="output_error",
    says="simulate from the fin, least squares on angle and rate; errors corrected for coloured residuals",
    source="Ljung 1999, section 7.2",
    solve=solve,
)
