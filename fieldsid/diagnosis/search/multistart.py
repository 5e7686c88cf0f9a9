"""Multistart: each effect of a model is fitted again from its scan grid, because the cost may have local minima."""

from __future__ import annotations

from collections.abc import Collection

from fieldsid.diagnosis.evidence.likelihood_fit import MIN_LIKELIHOOD_GAIN, fit_maximum_likelihood, fit_output_error
from fieldsid.diagnosis.evidence.scored_model import ScoredModel, prefer_output_error, score_model
from fieldsid.diagnosis.parallel_map import ParallelMap
from fieldsid.diagnosis.search.add_effect import iterate_points
from fieldsid.fitting.initial.effect_screen import carry_parameters, linearise_at, screen_points
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.effect import Effect
from fieldsid.models.model import Noise
from fieldsid.numerics.arrays import FloatArray

MAX_SCAN_POINTS, SCREEN_ITERATIONS = 6, 6
"""Scan points that are iterated, and the iterations of each."""


def multistart(
    h: ScoredModel, known: Collection[str], resolution_floor: Noise, noise_kind: str, floor: Noise, parallel: ParallelMap
) -> ScoredModel:
    """Return the best model over restarts of each of its effects from the scan grid, the other effects kept.

    `known` are the effects of the base, which are not restarted.
    """

    def restarted(of: tuple[Effect, bool]) -> ScoredModel:
        effect, plain = of
        problem, start = _start(h, effect, plain=plain)
        return score_model(
            fit_maximum_likelihood(problem, start, h.likelihood_fit.noise, resolution_floor, noise_kind), h.validation
        )

    ends = parallel.map(restarted, [(e, plain) for e in h.effects if e.name not in known for plain in (True, False)])
    best = max(ends, key=lambda end: end.log_evidence, default=h)
    return prefer_output_error(best, floor) if best.log_evidence > h.log_evidence + MIN_LIKELIHOOD_GAIN else h


def _start(h: ScoredModel, effect: Effect, *, plain: bool) -> tuple[Problem, FloatArray]:
    """Return the problem and start that the best scan points of an effect lead to, by output error or the model's noise."""
    fitted = h.likelihood_fit.fitted
    rest = fitted.problem.with_effects([e for e in h.effects if e is not effect])
    x = carry_parameters(rest.layout, fitted.vector)
    noise = h.likelihood_fit.noise
    if plain:
        free = fit_output_error(rest, x, fitted.weights)
        x, noise = free.x, free.weights
    linearisation = linearise_at(rest, x, noise)
    best = iterate_points(linearisation, screen_points(linearisation, effect)[:MAX_SCAN_POINTS], max_iterations=SCREEN_ITERATIONS)
    return best.problem, best.start
