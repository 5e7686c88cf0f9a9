"""A hypothesis with one of its effects in another form than the textbook's, fitted from where the textbook's has led."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

from fieldsid.diagnosis.hypothesis import Hypothesis, hypothesis_of, with_free_run
from fieldsid.diagnosis.trial import Trial, judge
from fieldsid.fitting.colour import residuals_of
from fieldsid.fitting.descent import descend
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.starts import carried
from fieldsid.logs.run import FloatArray
from fieldsid.models.effect import Effect, Form, in_form
from fieldsid.models.model import Noise

ROUNDS, COARSE = 6, 1e-3
"""Rounds each start of a form is followed for before the best is judged, and the share of the cost a round must gain."""


def in_other_forms(h: Hypothesis, floor: Noise, told: Noise, family: str) -> Iterator[Hypothesis]:
    """Yield a hypothesis with every form that one of its effects has besides its own, judged as in the search."""
    for effect in h.effects:
        for form in effect.forms:
            problem, start = _begun(h, effect, form)
            judged = judge(problem, start, h.judged.noise, told, family, rival=h.judged.likelihood)
            yield with_free_run(hypothesis_of(judged, h.validation), floor)


def _begun(h: Hypothesis, effect: Effect, form: Form) -> tuple[Problem, FloatArray]:
    """Return the form's problem and the best of its starts, each after a few rounds under the hypothesis' noise."""
    trial, noise = h.judged.trial, h.judged.noise
    old = trial.problem.layout
    problem = trial.problem.with_effects([in_form(e, form) if e is effect else e for e in h.effects])
    starts = [carried(old, trial.x, problem.layout, point) for point in _points(trial, form)]
    found = [descend(problem, x, noise, rounds=ROUNDS, tolerance=COARSE) for x in starts]
    return problem, min(found, key=lambda d: d.cost).x


def _points(trial: Trial, form: Form) -> list[dict[str, float]]:
    """Return the start values of a form's shared coefficients: what it suggests from what is left, else its grids' points."""
    if form.suggest is not None:
        return form.suggest(trial.problem.records, residuals_of(trial.problem, trial.x))
    grids = {c.name: c.scan or (c.start,) for c in form.coefficients}
    return [dict(zip(grids, point, strict=True)) for point in product(*grids.values())]
