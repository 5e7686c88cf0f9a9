"""Output error: free-run simulation, least squares on angle and rate weighted by their own residual noise.

Standard errors are those of the residuals' own colour (noise/sandwich_covariance.py), so that a disturbance or a
missing effect widens them. Source: Ljung 1999, section 7.2; Klein and Morelli 2006, chapter 6.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from fieldsid.fitting.covariance.kenward_roger import (
    KNOWN_NOISE_SAMPLES,
    MIN_DEGREES_WHITE_NOISE,
    kenward_roger,
    noise_covariance,
)
from fieldsid.fitting.covariance.noise_selection import chosen_noise
from fieldsid.fitting.covariance.output_error_covariance import white_weight_covariance
from fieldsid.fitting.covariance.reml import linearise_runs, restricted_likelihood
from fieldsid.fitting.initial.effect_screen import backtrack, carry_parameters, linearise_at, screen_effect
from fieldsid.fitting.initial.forward_build import forward_build
from fieldsid.fitting.initial.other_event_times import starts_at_other_times
from fieldsid.fitting.optimise.levenberg_marquardt import Minimum, covariance, levenberg_marquardt, normal_equations
from fieldsid.fitting.optimise.residual_weights import negative_log_likelihood, squares_of
from fieldsid.fitting.optimise.unbounded_motion import refuse_unbounded_motion
from fieldsid.fitting.predict.predict import refit_nuisances
from fieldsid.fitting.problem.estimator import Estimator, Options, Solution, shared_covariance
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.effect import Effect
from fieldsid.models.model import Noise
from fieldsid.noise.white_floor import MIN_ANGLE_NOISE_RAD, MIN_RATE_NOISE_RAD_S, white_noise_floor
from fieldsid.noise.whiten import noise_vector
from fieldsid.numerics.arrays import FloatArray

MAX_ROUNDS = 12
"""Descents with the weights of the residuals before them, and searches for other times of events. From weights of the wrong
proportion each descent takes away most of what is left, not all: two ended up to 50 units of log likelihood
short of the optimum (a delay of 0.6 s)."""
PROVISIONAL_COST_TOLERANCE = 1e-3
"""Relative change of the cost at which a descent under provisional weights ends."""
NEGLIGIBLE_LIKELIHOOD_GAIN = 0.01
"""Log likelihood that the last descent may have gained."""
NEGLIGIBLE_LOG_WEIGHT_CHANGE = 0.02
"""Change of both weights on a long record, in logs, that does not move the minimum."""
MIN_RESCAN_GAIN = 0.5
"""Log likelihood below which another search of the nuisances' grids at the minimum found is not worth it."""
MAX_STARTS = 6
"""Other times of events that a solution is left for, the most promising first."""
START_COST_TOLERANCE = 1e-5
"""Relative change of the cost at which a descent ends from one of many starts, most of which lead nowhere."""
LONG_RECORD_COST_TOLERANCE = 1e-4
"""The same on a long record, whose start is near the end."""
INITIAL_DAMPING = 1e-9
"""Marquardt's damping of its first step: a larger one would stop short of the minimum by more than its error."""
FIRST_PART_SAMPLES = (5_000, 50_000)
"""Samples of the first parts of a long record."""


def residual_noise(problem: Problem, x: FloatArray, parameters: int) -> Noise:
    """Return the residual standard deviation of both channels, corrected for the parameters estimated.

    It is not below what counts as no noise: of a log without any, the channel that the model follows exactly would be all.
    """
    squares, counts = squares_of(problem, x)
    lost = parameters * counts / max(float(counts.sum()), 1.0)
    sigma = np.sqrt(squares / np.maximum(counts - lost, 1.0))
    floor, least = white_noise_floor(problem.records), (MIN_ANGLE_NOISE_RAD, MIN_RATE_NOISE_RAD_S)
    angle, rate = (max(float(v), low) for v, low in zip(sigma, least, strict=True))
    return Noise(angle if sigma[0] > 0 else floor.angle, rate if sigma[1] > 0 else floor.rate)


def minimise(problem: Problem, start: FloatArray, noise: Noise) -> tuple[Minimum, Noise]:
    """Return the output-error minimum from a start, with weights from its own residuals."""
    found = levenberg_marquardt(problem, start, noise, tolerance=PROVISIONAL_COST_TOLERANCE)
    cost = negative_log_likelihood(problem, found.x)
    for _ in range(MAX_ROUNDS):
        noise = residual_noise(problem, found.x, len(found.free))
        found = levenberg_marquardt(problem, found.x, noise)
        before, cost = cost, negative_log_likelihood(problem, found.x)
        if not before - cost > NEGLIGIBLE_LIKELIHOOD_GAIN:
            break
    return found, noise


def _rescanned(problem: Problem, found: Minimum, weights: Noise) -> tuple[Minimum, Noise]:
    """Return the minimum from which no search for the runs' event times and phases leads to a lower one, with its weights.

    While the fin rests an event's time changes nothing, and no descent leaves such a stretch. With the shared parameters found,
    the grids show each run's best; with the times found, the effect screened anew shows which times and sizes go together.
    """
    timed = [e for e in problem.layout.effects if any(c.scan for c in e.nuisance)]
    if not timed:
        return found, weights
    cost = negative_log_likelihood(problem, found.x)
    for _ in range(MAX_ROUNDS):
        before, x = cost, found.x
        for start in _starts_at_other_times(problem, x, timed, weights):
            # what a start before this one has gained stays: it is of another event
            other = levenberg_marquardt(problem, found.x + start - x, weights, tolerance=START_COST_TOLERANCE)
            if not other.cost < found.cost:
                continue
            other, new = minimise(problem, other.x, weights)
            after = negative_log_likelihood(problem, other.x)
            if after < cost:
                found, weights, cost = other, new, after
        if not before - cost > MIN_RESCAN_GAIN:
            break
    return found, weights


def _starts_at_other_times(problem: Problem, x: FloatArray, timed: Sequence[Effect], weights: Noise) -> Iterator[FloatArray]:
    """Yield starts with other times of events and other phases, those of every run alone before those of all together."""
    start = x
    for run in range(len(problem.records)):
        start = refit_nuisances(problem, start, run, weights)
    yield start
    for effect in timed:
        yield _screened_again(problem, x, effect, weights)
    yield from starts_at_other_times(problem, x, weights, MAX_STARTS)


def _screened_again(problem: Problem, x: FloatArray, effect: Effect, weights: Noise) -> FloatArray:
    """Return a start with one effect screened beside the other parameters of a solution: times and sizes of its events together.

    The first screen stood on a model that lacked the effect, whose parameters it had biased.
    """
    rest = problem.with_effects([e for e in problem.layout.effects if e is not effect])
    linearisation = linearise_at(rest, carry_parameters(rest.layout, (problem.layout, x)), weights)
    screened = backtrack(linearisation, screen_effect(linearisation, effect))
    return carry_parameters(problem.layout, (screened.problem.layout, screened.start))


def found_minimum(problem: Problem) -> tuple[Minimum, Noise]:
    """Return the output-error minimum of a problem and its weights; raises DivergenceError where no start leads to any."""
    found, weights = _found_over_parts(problem)
    refuse_unbounded_motion(problem, found.x, ESTIMATOR.name, instead="leave effects out")
    return found, weights


def _found_over_parts(problem: Problem) -> tuple[Minimum, Noise]:
    """Return the minimum that a long record comes to over the minima of ever longer first parts, a short one at once.

    Each is so near the next one's that a step or two lead there.
    """
    floor, longest = white_noise_floor(problem.records), max(len(r) for r in problem.records)
    first = problem if longest <= 2 * FIRST_PART_SAMPLES[0] else problem.first(FIRST_PART_SAMPLES[0])
    found, weights = _rescanned(first, *minimise(first, forward_build(first, floor), floor))
    if first is problem:
        return found, weights
    for samples in FIRST_PART_SAMPLES[1:]:
        if longest > 2 * samples:
            found = levenberg_marquardt(
                problem.first(samples), found.x, weights, tolerance=PROVISIONAL_COST_TOLERANCE, damping=INITIAL_DAMPING
            )
    found = levenberg_marquardt(problem, found.x, weights, tolerance=LONG_RECORD_COST_TOLERANCE, damping=INITIAL_DAMPING)
    new = residual_noise(problem, found.x, len(found.free))
    if abs(np.log(new.angle / weights.angle)) + abs(np.log(new.rate / weights.rate)) < NEGLIGIBLE_LOG_WEIGHT_CHANGE:
        return found, weights
    return levenberg_marquardt(problem, found.x, new, tolerance=LONG_RECORD_COST_TOLERANCE, damping=INITIAL_DAMPING), new


def errors(problem: Problem, found: Minimum, weights: Noise, noise: Noise, noise_kind: str) -> FloatArray:
    """Return the covariance (F, F) of the estimate, allowing on short records for noise that is not known exactly."""
    if noise_kind == "white":
        return covariance(found.normal)
    _, normal, _, results = normal_equations(problem, found.x, weights, found.free)
    vector = noise_vector(noise)
    if sum(len(r) for r in problem.records) > KNOWN_NOISE_SAMPLES:
        return white_weight_covariance(problem, found, weights, vector, normal, results)
    lines, count = linearise_runs(problem, found.x), len(problem.layout.parameters)
    spread = noise_covariance(restricted_likelihood(lines, count), vector, noise_kind)
    still = found.x[list(found.free)]
    return kenward_roger(
        lambda v: (still, white_weight_covariance(problem, found, weights, v, normal, results)),
        vector,
        noise_kind,
        spread,
        MIN_DEGREES_WHITE_NOISE,
    )


def solve(problem: Problem, _options: Options) -> Solution:
    """Return the output-error solution of a joint problem."""
    found, weights = found_minimum(problem)
    noise_kind, noise, notes = chosen_noise(problem, found.x, weights)
    full = errors(problem, found, weights, noise, noise_kind)
    return Solution(found.x, shared_covariance(problem, full, found.free), noise, ESTIMATOR.name, notes)


ESTIMATOR = Estimator(
    name="output_error",
    says="simulate from the fin, least squares on angle and rate; errors corrected for coloured residuals",
    source="Ljung 1999, section 7.2",
    solve=solve,
)
