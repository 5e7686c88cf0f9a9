"""A hypothesis with one of its effects in another form than the textbook's, fitted from where the textbook's has led."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np

from fieldsid.diagnosis.beside import Beside
from fieldsid.diagnosis.hypothesis import Hypothesis, hypothesis_of, with_free_run
from fieldsid.diagnosis.trial import judge
from fieldsid.diagnosis.worth import asks_for_more, likelier, refines
from fieldsid.fitting.colour import residuals_of
from fieldsid.fitting.descent import Descent, cost_of, descend
from fieldsid.fitting.layout import Layout
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.starts import carried
from fieldsid.logs.run import FloatArray
from fieldsid.models.effect import Coefficient, Effect, Form, Stage, Suggest, in_form
from fieldsid.models.model import Noise
from fieldsid.models.record import Record

LIKELY, GLIMPSE, KEPT, ROUNDS, COARSE = 6, 2, 3, 6, 1e-3
"""Starts of a form that are followed, for how many rounds, how many of them go on, for how many more before the best is
judged; and the share of the cost a round must gain."""
TRIFLE = 0.4
"""Log likelihood under the hypothesis' own noise that a form must have gained by then to be judged: the rest of the way brings
no more, and what unseen runs say of numbers that are next to nothing is next to nothing."""


def reshaped(h: Hypothesis, told: Noise, family: str, floor: Noise, beside: Beside) -> Hypothesis:
    """Return a hypothesis with its effects in other forms, the best one first, as long as that pays and something is left."""
    while asks_for_more(h, floor):
        best = max(in_other_forms(h, told, family, beside), key=lambda other: other.score, default=h)
        if not likelier(h, best):
            break
        best = with_free_run(best, floor)
        if not refines(h, best):
            break
        h = best
    return h


def in_other_forms(h: Hypothesis, told: Noise, family: str, beside: Beside) -> list[Hypothesis]:
    """Return a hypothesis with every form that gains anything of those its effects have besides their own, judged."""
    trial, noise = h.judged.trial, h.judged.noise
    if not any(e.forms for e in h.effects):
        return []
    left, before = residuals_of(trial.problem, trial.x), cost_of(trial.problem, trial.x, noise)

    def judged_in(of: tuple[Effect, Form]) -> Hypothesis | None:
        problem, begun = _begun(h, *of, left)
        if 0.5 * (before - begun.cost) < TRIFLE:
            return None
        judged = judge(problem, begun.x, noise, told, family, rival=h.judged.likelihood)
        return hypothesis_of(judged, h.validation)

    tried = beside.each(judged_in, [(effect, form) for effect in h.effects for form in effect.forms])
    return [other for other in tried if other is not None]


def _begun(h: Hypothesis, effect: Effect, form: Form, left: Sequence[FloatArray]) -> tuple[Problem, Descent]:
    """Return the form's problem and the best of its starts after a few rounds under the hypothesis' noise.

    The edges of an actuator are sought again with the form's own numbers: a cost with edges has many ends.
    """
    trial, noise = h.judged.trial, h.judged.noise
    old = trial.problem.layout
    problem = trial.problem.with_effects([in_form(e, form) if e is effect else e for e in h.effects])
    records = trial.problem.records
    again = [{}, *_points(records, left, effect.suggest, effect.shared)] if effect.stage is Stage.ACTUATOR else [{}]
    points = [(point, edges) for point in _points(records, left, form.suggest, form.coefficients) for edges in again]
    starts = [_moved(problem.layout, carried(old, trial.x, problem.layout, point), edges) for point, edges in points]
    likely = sorted(starts, key=lambda x: cost_of(problem, x, noise))[:LIKELY]
    found = [descend(problem, x, noise, rounds=GLIMPSE, tolerance=COARSE) for x in likely]
    best = sorted(found, key=lambda d: d.cost)[:KEPT]
    return problem, min((descend(problem, d.x, noise, rounds=ROUNDS, tolerance=COARSE) for d in best), key=lambda d: d.cost)


def _points(
    records: Sequence[Record], left: Sequence[FloatArray], suggest: Suggest | None, coefficients: Sequence[Coefficient]
) -> list[dict[str, float]]:
    """Return the start values of shared coefficients: what is suggested by what is left, else the points of their grids."""
    if suggest is not None:
        return suggest(records, left)
    grids = {c.name: c.scan or (c.start,) for c in coefficients}
    return [dict(zip(grids, point, strict=True)) for point in product(*grids.values())]


def _moved(layout: Layout, x: FloatArray, values: Mapping[str, float]) -> FloatArray:
    """Return x with some shared slots at other values."""
    return np.array([values.get(s.name, v) for s, v in zip(layout.slots, x, strict=True)])
