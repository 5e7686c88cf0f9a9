"""The second start of a search: the whole hull, with the effects that every vehicle has.

Every real hull has a cross state (sway or heave), a servo lag, drag that grows with the square of the rate, and loses speed in a
turn. Single additions to the bare model mislead among the four, because each effect alone fits a part of the others. So all four
are added one after another, whatever each gains, from the few most promising scan points at the previous fit. Then the model is
fitted without each, which removes those that the data do not show.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldsid.diagnosis.evidence.likelihood_fit import LikelihoodFit
from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.moves.add_effect import likelihood_linearisation
from fieldsid.diagnosis.moves.archive import Archive
from fieldsid.diagnosis.moves.grounds import Grounds
from fieldsid.fitting.initial.effect_screen import ScreenResult, backtrack, screen_points
from fieldsid.models.effect import Effect

ADDED = ("sway_coupling", "heave_coupling", "servo_lag", "quadratic_damping", "speed_varying")
"""The effects of the whole hull in the order of addition: the cross state changes the other parameters most."""
HULLS_OWN = frozenset((*ADDED, "crossflow_drag"))
"""The effects that every hull has: quadratic damping stands for the drag along the hull in the whole hull."""
STARTS = 3
"""Number of scan points, the best to first order, from which each of them is fitted."""


def whole_hull(base: ScoredModel, effects: Sequence[Effect], tried: Archive, grounds: Grounds) -> ScoredModel:
    """Return the base with those of the given effects that are in ADDED; store every intermediate set in the archive."""
    h = base
    hull_effects = (e for e in effects if e.name in ADDED and e.name not in base.names)
    for effect in sorted(hull_effects, key=lambda e: ADDED.index(e.name)):
        fits = [fit for fit in _fits_with(h, effect, grounds) if np.isfinite(fit.log_likelihood)]
        if fits:
            key = frozenset((*h.names, effect.name))
            h = tried[key] = grounds.better(tried.get(key), max(fits, key=lambda fit: fit.log_likelihood))
    return h


def _fits_with(h: ScoredModel, effect: Effect, grounds: Grounds) -> list[LikelihoodFit]:
    """Return the fits of a model with one effect more, from each of its starts."""
    grounds.report("+".join((*h.names, effect.name)))
    at, noise = likelihood_linearisation(h), h.likelihood_fit.noise

    def fit(point: ScreenResult) -> LikelihoodFit:
        started = backtrack(at, point)
        return grounds.fit(started.problem, started.start, noise)

    return grounds.parallel.map(fit, screen_points(at, effect)[:STARTS])
