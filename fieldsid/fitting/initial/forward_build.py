"""Start values of a fit with several effects by forward build-up: the base model, then the best effect, one by one."""

from __future__ import annotations

from collections.abc import Sequence

from fieldsid.fitting.covariance.reml import MAX_NOISE_SAMPLES, linearise_runs, select_noise, whitened_products
from fieldsid.fitting.initial.effect_screen import (
    Linearisation,
    backtrack,
    carry_parameters,
    equivalent_solution,
    linearise_at,
    scan_points,
    screen_points,
)
from fieldsid.fitting.initial.equation_error import equation_error_start, equation_error_starts
from fieldsid.fitting.optimise.levenberg_marquardt import cost_of, levenberg_marquardt
from fieldsid.fitting.optimise.residual_weights import negative_log_likelihood, white_weights
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.effect import Effect
from fieldsid.models.model import Noise
from fieldsid.noise.whiten import noise_vector
from fieldsid.numerics.arrays import FloatArray
from fieldsid.rounding import nine_digits

MAX_BUILD_ITERATIONS = 40
MAX_SCAN_POINTS = 3
RELATIVE_COST_TOLERANCE = 1e-5
SMALLER_EFFECT_LOG_ODDS = 4.6
"""Prior log odds, a hundred to one, that of two equivalent solutions the one with the smaller effect is true.

Fin servos follow within 0.03 to 0.3 s; hulls answer within 0.3 s (1 m) to a minute (a ship).
"""


def forward_build(problem: Problem, floor: Noise) -> FloatArray:
    """Return the start vector of a problem; without effects it is that of equation error."""
    layout = problem.layout
    if not layout.effects:
        return equation_error_start(problem.records, layout)
    current = problem.with_effects(())
    x = _refined(current, equation_error_start(current.records, current.layout), floor)
    remaining = list(layout.effects)
    while remaining:
        linearisation = linearise_at(current, x, white_weights(current, x))
        points = min((screen_points(linearisation, effect) for effect in remaining), key=lambda p: p[0].predicted_cost)[
            :MAX_SCAN_POINTS
        ]
        effect, current = points[0].effect, points[0].problem
        starts = [backtrack(linearisation, p).start for p in points]
        if effect.fin is not None:
            starts.append(_by_equation_error(linearisation, current, effect))
        x = _best(current, [_refined(current, start, linearisation.noise) for start in starts])
        equivalent = equivalent_solution(current, x, effect)
        if equivalent is not None:
            x = _best(current, [x, _refined(current, equivalent, linearisation.noise)])
        remaining.remove(effect)
    by_equation_error = (_refined(problem, start, floor) for start in equation_error_starts(problem.records, layout))
    x = _best(problem, [carry_parameters(layout, (current.layout, x)), *by_equation_error])
    return plausible(problem, x, floor)


def _by_equation_error(linearisation: Linearisation, problem: Problem, effect: Effect) -> FloatArray:
    """Return the equation-error start of least cost over the scan points of an actuator effect, the other effects fixed.

    It is needed where the model without the actuator effect fits hardly at all: a first-order step from its parameters does not
    reach the solution.
    """
    known = dict(zip(linearisation.problem.layout.names, linearisation.x.tolist(), strict=False))
    starts = (equation_error_start(problem.records, problem.layout, known | v) for v in scan_points(linearisation, effect))
    return min(starts, key=lambda x: nine_digits(cost_of(problem, x, linearisation.noise)))


def plausible(problem: Problem, x: FloatArray, floor: Noise) -> FloatArray:
    """Return x, or an equivalent solution with a smaller effect where the data do not exclude it: servos are faster than hulls.

    At one speed, a servo lag and the time constant of the hull can be exchanged, apart from nonlinear terms. The residuals of an
    inexact model are coloured, and under white weights small differences look significant: the two solutions are therefore
    compared under the noise that fits each best.
    """
    for effect in problem.layout.effects:
        equivalent = equivalent_solution(problem, x, effect)
        place = problem.layout.names.index(effect.coefficients[0].name)
        if equivalent is None or equivalent[place] >= x[place]:
            continue
        other = _refined(problem, equivalent, floor)
        if other[place] >= x[place]:
            continue
        if negative_log_likelihood(problem, other) <= negative_log_likelihood(problem, x) or (
            coloured_log_likelihood(problem, other) + SMALLER_EFFECT_LOG_ODDS >= coloured_log_likelihood(problem, x)
        ):
            x = other
    return x


def coloured_log_likelihood(problem: Problem, x: FloatArray) -> float:
    """Return the log likelihood, up to its constant, of the minimum near x under the noise selected for its residuals."""
    part = problem.first(MAX_NOISE_SAMPLES // len(problem.records))
    noise = select_noise(part, x, white_weights(part, x))[1]
    found = levenberg_marquardt(part, x, noise, max_iterations=MAX_BUILD_ITERATIONS, tolerance=RELATIVE_COST_TOLERANCE)
    products, log_determinant = whitened_products(linearise_runs(part, found.x), len(part.layout.parameters), noise_vector(noise))
    return -0.5 * (log_determinant + float(products[0, 0]))


def _best(problem: Problem, candidates: Sequence[FloatArray]) -> FloatArray:
    return min(candidates, key=lambda x: negative_log_likelihood(problem, x))


def _refined(problem: Problem, start: FloatArray, noise: Noise) -> FloatArray:
    """Return the output-error solution from a start, reweighted once by its residuals."""
    found = levenberg_marquardt(problem, start, noise, max_iterations=MAX_BUILD_ITERATIONS, tolerance=RELATIVE_COST_TOLERANCE).x
    return levenberg_marquardt(
        problem, found, white_weights(problem, found), max_iterations=MAX_BUILD_ITERATIONS, tolerance=RELATIVE_COST_TOLERANCE
    ).x
