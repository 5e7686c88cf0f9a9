"""The move that drops an effect: a model without each of its effects, fitted from its parameters with them."""

from __future__ import annotations

import numpy as np

from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.moves.archive import Archive
from fieldsid.diagnosis.moves.grounds import Grounds
from fieldsid.fitting.initial.effect_screen import carry_parameters
from fieldsid.fitting.optimise.levenberg_marquardt import cost_of
from fieldsid.models.effect import Effect


def drop_each(h: ScoredModel, tried: Archive, grounds: Grounds) -> bool:
    """Fit a model without each of its effects, unless that was done; return whether any model was fitted.

    An effect added later may have made an earlier one superfluous. A smaller set may so far have been tried only in other
    variants, or its fit may have ended at a worse optimum than the one reached from the larger model.
    """
    if len(h.names) <= len(tried.known) + 1 or tried.is_thinned(h):
        return False
    tried.thinned[frozenset(h.names)] = h.log_evidence
    effects = [e for e in h.effects if e.name not in tried.known]
    less = grounds.parallel.map(lambda removed: _without(h, removed, tried, grounds), effects)
    tried.update({frozenset(w.names): w for w in less})
    return True


def _without(h: ScoredModel, removed: Effect, tried: Archive, grounds: Grounds) -> ScoredModel:
    """Return a model without one of its effects, fitted from its parameters with it, or from the base's where those diverge."""
    fitted, noise = h.likelihood_fit.fitted, h.likelihood_fit.noise
    problem = fitted.problem.with_effects([e for e in h.effects if e is not removed])
    starts = [carry_parameters(problem.layout, fitted.vector)]
    if not np.isfinite(cost_of(problem, starts[0], noise)):
        # a hull that is course-stable only by its sway diverges without it, so that no descent can start there
        starts = [carry_parameters(problem.layout, tried[tried.known].likelihood_fit.fitted.vector, fitted.vector)]
    before = tried.get(frozenset(e.name for e in problem.layout.effects))
    if before is not None and any(e not in before.effects for e in problem.layout.effects):
        # with the other variants of this model, the parameters may be far from those of the known fit
        starts.append(carry_parameters(problem.layout, before.likelihood_fit.fitted.vector, fitted.vector))
    found = grounds.better(before, grounds.fit(problem, starts[0], noise))
    for start in starts[1:]:
        found = grounds.better(found, grounds.fit(problem, start, noise))
    return found.evaluate_errors()
