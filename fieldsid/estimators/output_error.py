"""Output error: free-run simulation, least squares on angle and rate, each weighted by its residual standard deviation.

Standard errors allow for the colour of the residuals (noise/sandwich_covariance.py), so that a disturbance or a missing effect
widens them. Source: Ljung 1999, section 7.2; Klein and Morelli 2006, chapter 6.
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
from fieldsid.fitting.optimise.residual_weights import negative_log_likelihood, residual_noise
from fieldsid.fitting.optimise.unbounded_motion import refuse_unbounded_motion
from fieldsid.fitting.predict.predict import refit_nuisances
from fieldsid.fitting.problem.estimator import Estimator, Options, Solution, shared_covariance
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.effect import Effect
from fieldsid.models.model import Noise
from fieldsid.noise.white_floor import white_noise_floor
from fieldsid.noise.whiten import noise_vector
from fieldsid.numerics.arrays import FloatArray

MAX_ROUNDS = 12
"""Most descents, each with the weights of the previous residuals, and most searches for other times of events. Where the weights
start in the wrong proportion, each descent closes most of the distance to the optimum: after two, up to 50 units of log
likelihood were missing (a delay of 0.6 s)."""
PROVISIONAL_COST_TOLERANCE = 1e-3
"""Relative change of the cost at which a descent under provisional weights ends."""
NEGLIGIBLE_LIKELIHOOD_GAIN = 0.01
"""Gain of log likelihood by a descent at which the alternation ends."""
NEGLIGIBLE_LOG_WEIGHT_CHANGE = 0.02
"""Sum of the changes of both log weights on a long record below which the minimum is not computed again."""
MIN_RESCAN_GAIN = 0.5
"""Gain of log likelihood below which the grids of the nuisance parameters are not searched again."""
MAX_STARTS = 6
"""Most starts with other times of events that are tried from a solution, the most promising first."""
START_COST_TOLERANCE = 1e-5
"""Relative change of the cost at which a descent from one of many starts ends; most of these reach no lower minimum."""
LONG_RECORD_COST_TOLERANCE = 1e-4
"""Relative change of the cost at which a descent on a long record ends, whose start is near the minimum."""
INITIAL_DAMPING = 1e-9
"""Marquardt's damping of the first step on a long record: a larger one would end farther from the minimum than one error."""
FIRST_PART_SAMPLES = (5_000, 50_000)
"""Lengths, in samples, of the first parts on which the minimum of a long record is computed beforehand."""


def minimise(problem: Problem, start: FloatArray, noise: Noise) -> tuple[Minimum, Noise]:
    """Return the output-error minimum from a start, and its weights, which are those of its residuals."""
    found = levenberg_marquardt(problem, start, noise, tolerance=PROVISIONAL_COST_TOLERANCE)
    cost = negative_log_likelihood(problem, found.x)
    for _ in range(MAX_ROUNDS):
        noise = residual_noise(problem, found.x, len(found.free))
        found = levenberg_marquardt(problem, found.x, noise)
        before, cost = cost, negative_log_likelihood(problem, found.x)
        if not before - cost > NEGLIGIBLE_LIKELIHOOD_GAIN:
            break
    return found, noise


def _search_other_event_times(problem: Problem, found: Minimum, weights: Noise) -> tuple[Minimum, Noise]:
    """Return the lowest minimum that searches for other event times and phases of the runs find, with its weights.

    While the fin is at rest the cost does not depend on the time of an event, and no descent leaves such an interval. One search
    uses the grid of each run at the shared parameters found; another screens the effect again at the times found, which shows
    which times and sizes belong together.
    """
    timed = [e for e in problem.layout.effects if any(c.scan for c in e.nuisance)]
    if not timed:
        return found, weights
    cost = negative_log_likelihood(problem, found.x)
    for _ in range(MAX_ROUNDS):
        before, x = cost, found.x
        for start in _starts_at_other_times(problem, x, timed, weights):
            # the shift of the start is added to the present minimum: an earlier start may have improved another event
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
    """Yield starts with other event times and phases: refitted run by run, by a new screen of each effect, event by event."""
    start = x
    for run in range(len(problem.records)):
        start = refit_nuisances(problem, start, run, weights)
    yield start
    for effect in timed:
        yield _screen_again(problem, x, effect, weights)
    yield from starts_at_other_times(problem, x, weights, MAX_STARTS)


def _screen_again(problem: Problem, x: FloatArray, effect: Effect, weights: Noise) -> FloatArray:
    """Return a start with one effect screened again at the other parameters of a solution: event times and sizes together.

    The first screen used a model without the effect, whose parameters were biased by that.
    """
    rest = problem.with_effects([e for e in problem.layout.effects if e is not effect])
    linearisation = linearise_at(rest, carry_parameters(rest.layout, (problem.layout, x)), weights)
    screened = backtrack(linearisation, screen_effect(linearisation, effect))
    return carry_parameters(problem.layout, (screened.problem.layout, screened.start))


def found_minimum(problem: Problem) -> tuple[Minimum, Noise]:
    """Return the output-error minimum of a problem and its weights; raises DivergenceError where the motion is unbounded."""
    found, weights = _minimum_by_parts(problem)
    refuse_unbounded_motion(problem, found.x, ESTIMATOR.name, instead="leave effects out")
    return found, weights


def _minimum_by_parts(problem: Problem) -> tuple[Minimum, Noise]:
    """Return the minimum of a problem; for a long record by way of the minima of its first parts, each longer than the last.

    The minimum of one part is so near to that of the next that one or two steps suffice.
    """
    floor, longest = white_noise_floor(problem.records), max(len(r) for r in problem.records)
    first = problem if longest <= 2 * FIRST_PART_SAMPLES[0] else problem.first(FIRST_PART_SAMPLES[0])
    found, weights = _search_other_event_times(first, *minimise(first, forward_build(first, floor), floor))
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
    """Return the covariance (F, F) of the estimate; on short records it allows for the uncertainty of the noise parameters."""
    if noise_kind == "white":
        return covariance(found.normal)
    _, normal, _, results = normal_equations(problem, found.x, weights, found.free)
    vector = noise_vector(noise)
    if sum(len(r) for r in problem.records) > KNOWN_NOISE_SAMPLES:
        return white_weight_covariance(problem, found, weights, vector, normal, results)
    lines, count = linearise_runs(problem, found.x), len(problem.layout.parameters)
    spread = noise_covariance(restricted_likelihood(lines, count), vector, noise_kind)
    estimate = found.x[list(found.free)]
    return kenward_roger(
        lambda v: (estimate, white_weight_covariance(problem, found, weights, v, normal, results)),
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
    return Solution(found.x, shared_covariance(problem, found.x, full, found.free), noise, ESTIMATOR.name, notes)


ESTIMATOR = Estimator(
    name="output_error",
    says="simulate from the fin, least squares on angle and rate; errors corrected for coloured residuals",
    source="Ljung 1999, section 7.2",
    solve=solve,
)
