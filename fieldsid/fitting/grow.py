"""The start of a fit with several effects: the base model first, then one effect after the other, the best first.

Every effect starts where the cheap test of fitting/starts.py finds it best, is refitted with what is there already, and
has its twin tried, so that a fit with effects does not end above the fit without them.
"""

from __future__ import annotations

from fieldsid.fitting.descent import Descent, cost_of, descend
from fieldsid.fitting.layout import layout_of
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.start import start_vector
from fieldsid.fitting.starts import carried, ground_of, promise_of, twin_of
from fieldsid.logs.run import FloatArray
from fieldsid.models.effect import Effect
from fieldsid.models.model import Noise

ROUNDS = 12
TOLERANCE = 1e-5


def grown_start(problem: Problem, noise: Noise) -> FloatArray:
    """Return the start vector of a problem's layout; the base parameters' own where it has no effects."""
    layout = problem.layout
    if not layout.effects:
        return start_vector(problem.records, layout)
    current = Problem(problem.records, layout_of(problem.records, layout.axis, (), layout.groups))
    x = descend(current, start_vector(current.records, current.layout), noise, rounds=ROUNDS, tolerance=TOLERANCE).x
    left = list(layout.effects)
    while left:
        ground = ground_of(current, x, noise)
        best = min((promise_of(ground, effect) for effect in left), key=lambda p: p.cost)
        current, x = best.problem, _refitted(best.problem, best.start, noise, best.effect)
        left.remove(best.effect)
    x = carried(current.layout, x, layout)
    declared = start_vector(problem.records, layout)
    return x if cost_of(problem, x, noise) <= cost_of(problem, declared, noise) else declared


def _refitted(problem: Problem, start: FloatArray, noise: Noise, effect: Effect) -> FloatArray:
    """Return where the better of a start and its twin leads."""
    found = _short(problem, start, noise)
    twin = twin_of(problem, found.x, effect)
    if twin is None:
        return found.x
    other = _short(problem, twin, noise)
    return other.x if other.cost < found.cost else found.x


def _short(problem: Problem, start: FloatArray, noise: Noise) -> Descent:
    return descend(problem, start, noise, rounds=ROUNDS, tolerance=TOLERANCE)
