"""A hypothesis with one of its effects in another form than the textbook's, fitted from where the textbook's has led."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

from fieldsid.diagnosis.hypothesis import Hypothesis
from fieldsid.fitting.descent import descend
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.starts import carried
from fieldsid.logs.run import FloatArray
from fieldsid.models.effect import Effect, Form, in_form

ROUNDS, COARSE = 6, 1e-3
"""Rounds each start of a form is followed for before the best is judged, and the share of the cost a round must gain."""


def in_other_forms(h: Hypothesis) -> Iterator[tuple[Problem, FloatArray]]:
    """Yield a problem and a start for every form that an effect of the hypothesis has besides its own."""
    for effect in h.effects:
        for form in effect.forms:
            yield _begun(h, effect, form)


def _begun(h: Hypothesis, effect: Effect, form: Form) -> tuple[Problem, FloatArray]:
    """Return the form's problem and the best of its starts, each after a few rounds under the hypothesis' noise."""
    trial, noise = h.judged.trial, h.judged.noise
    old = trial.problem.layout
    problem = trial.problem.with_effects([in_form(e, form) if e is effect else e for e in h.effects])
    names = [c.name for c in form.coefficients]
    points = [dict(zip(names, p, strict=True)) for p in product(*(c.scan or (c.start,) for c in form.coefficients))]
    starts = [carried(old, trial.x, problem.layout, point) for point in points]
    found = [descend(problem, x, noise, rounds=ROUNDS, tolerance=COARSE) for x in starts]
    return problem, min(found, key=lambda d: d.cost).x
