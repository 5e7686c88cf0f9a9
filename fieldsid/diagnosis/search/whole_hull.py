"""The second start of a search: the whole hull, with the effects that every vehicle has.

Every real hull has a cross state (sway or heave), a servo lag, drag that grows with the square of the rate, and loses speed in a
turn. Single additions to the bare model mislead among the four, because each effect alone fits a part of the others. So all four
are added one after another, whatever each gains, from the few most promising scan points at the previous fit. Then the model is
fitted without each, which removes those that the data do not show.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from fieldsid.diagnosis.evidence.likelihood_fit import FittedProblem, LikelihoodFit, fit_output_error
from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.moves.add_effect import likelihood_linearisation
from fieldsid.diagnosis.moves.archive import Archive
from fieldsid.diagnosis.moves.grounds import Grounds
from fieldsid.diagnosis.parallel_map import ParallelMap
from fieldsid.fitting.initial.effect_screen import ScreenResult, backtrack, linearise_at, screen_points
from fieldsid.fitting.initial.equation_error import equation_error_starts
from fieldsid.models.effect import Effect
from fieldsid.models.model import Noise

ADDED = ("sway_coupling", "heave_coupling", "servo_lag", "quadratic_damping", "speed_varying")
"""The effects of the whole hull in the order of addition: the cross state changes the other parameters most."""
HULLS_OWN = frozenset((*ADDED, "crossflow_drag"))
"""The effects that every hull has: quadratic damping stands for the drag along the hull in the whole hull."""
STARTS = 3
"""Number of scan points, the best to first order, from which each of them is fitted."""


def whole_hull(base: ScoredModel, effects: Sequence[Effect], tried: Archive, grounds: Grounds) -> ScoredModel:
    """Return the base with those of the given effects that are in ADDED; store every intermediate set in the archive."""
    h = base
    for effect in _of_hull(effects, base.names):
        fits = [fit for fit in _fits_with(h, effect, grounds) if np.isfinite(fit.log_likelihood)]
        if fits:
            key = frozenset((*h.names, effect.name))
            h = tried[key] = grounds.better(tried.get(key), max(fits, key=lambda fit: fit.log_likelihood))
    return h


def whole_hull_error(base: FittedProblem, effects: Sequence[Effect], parallel: ParallelMap) -> Noise:
    """Return the rms errors (rad, rad/s) of the whole hull fitted by output error: the base with those of `effects` in ADDED."""
    best = base
    for effect in _of_hull(effects, base.names):
        at = linearise_at(best.problem, best.x, best.weights)
        points = [backtrack(at, point) for point in screen_points(at, effect)[:STARTS]]
        problem = points[0].problem
        starts = (*(p.start for p in points), *equation_error_starts(problem.records, problem.layout))
        fits = parallel.map(partial(fit_output_error, problem, weights=best.weights), starts)
        best = min((best, *fits), key=lambda fit: fit.weights.angle * fit.weights.rate)
    return best.weights


def _of_hull(effects: Sequence[Effect], known: Sequence[str]) -> list[Effect]:
    """Return those of the effects that are in ADDED and not known, in the order of addition."""
    return sorted((e for e in effects if e.name in ADDED and e.name not in known), key=lambda e: ADDED.index(e.name))


def _fits_with(h: ScoredModel, effect: Effect, grounds: Grounds) -> list[LikelihoodFit]:
    """Return the fits of a model with one effect more, from each of its starts."""
    grounds.report("+".join((*h.names, effect.name)))
    at, noise = likelihood_linearisation(h), h.likelihood_fit.noise

    def fit(point: ScreenResult) -> LikelihoodFit:
        started = backtrack(at, point)
        return grounds.fit(started.problem, started.start, noise)

    return grounds.parallel.map(fit, screen_points(at, effect)[:STARTS])
