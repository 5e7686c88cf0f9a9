"""The base of a search from a model in a file, whose optimum is used where a new search would not find it."""

from __future__ import annotations

import numpy as np

from fieldsid.diagnosis.evidence.likelihood_fit import FittedProblem, fit_output_error
from fieldsid.diagnosis.evidence.scored_model import ScoredModel
from fieldsid.diagnosis.moves.grounds import Grounds
from fieldsid.fitting.initial.effect_screen import carry_parameters
from fieldsid.fitting.problem.parameters import group_name
from fieldsid.models.axis import NAMES
from fieldsid.models.effect import as_fitted
from fieldsid.models.model import Model


def refitted_from(given: Model, h: ScoredModel, grounds: Grounds) -> ScoredModel:
    """Return a model of the same effects refitted from a given model's values, in its forms, where that has more evidence.

    The given values are a better start for effects whose cost is not smooth; and an optimum that a search reached by adding
    effects may not be found again from the base.
    """
    start = _output_error_of(given, h)
    if start is None:
        return h
    return grounds.better(h, grounds.fit(start.problem, start.x, h.likelihood_fit.noise)).evaluate_errors()


def _output_error_of(given: Model, h: ScoredModel) -> FittedProblem | None:
    """Return the output-error fit that starts at a given model's values, in its forms; None where it holds no start."""
    fitted = h.likelihood_fit.fitted
    groups = fitted.problem.layout.groups
    authority = NAMES[given.axis].authority
    speeds = enumerate(groups.speeds)
    of_groups = {group_name(authority, groups, i): given.law.authority(u, given.values[authority]) for i, u in speeds}
    values = {**given.values, **given.at_speed(groups.speeds[groups.reference]), **of_groups}
    if not given.effects or not all(np.isfinite(v) for v in values.values()):
        return None
    problem = fitted.problem.with_effects([as_fitted(e.textbook or e, given.values) for e in h.effects])
    x = carry_parameters(problem.layout, fitted.vector)
    for i, name in enumerate(problem.layout.names):
        x[i] = values.get(name, x[i])
    return fit_output_error(problem, x, fitted.weights)
