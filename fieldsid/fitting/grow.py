"""The start of a fit with several effects: the base model first, then one effect after the other, the best first.

Every effect starts at the two points where the cheap test of fitting/starts.py finds it best, is refitted with what is
there already, and has its twin tried, so that a fit with effects does not end above the fit without them. What the
effects' declared starts lead to at once is a candidate too.
"""

from __future__ import annotations

from collections.abc import Sequence

from fieldsid.fitting.descent import descend
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.start import start_vector
from fieldsid.fitting.starts import carried, ground_of, promises_of, shortened, twin_of
from fieldsid.fitting.weights import misfit, white_weights
from fieldsid.logs.run import FloatArray
from fieldsid.models.model import Noise

ROUNDS = 40
POINTS = 3
TOLERANCE = 1e-5
ALIKE = 1.0
"""Log likelihood within which two starts fit equally well."""


def grown_start(problem: Problem, floor: Noise) -> FloatArray:
    """Return the start vector of a problem's layout; the base parameters' own where it has no effects."""
    layout = problem.layout
    if not layout.effects:
        return start_vector(problem.records, layout)
    current = problem.with_effects(())
    x = _refined(current, start_vector(current.records, current.layout), floor)
    left = list(layout.effects)
    while left:
        ground = ground_of(current, x, white_weights(current, x))
        points = min((promises_of(ground, effect) for effect in left), key=lambda p: p[0].cost)[:POINTS]
        effect, current = points[0].effect, points[0].problem
        x = _best(current, [_refined(current, shortened(ground, p).start, ground.noise) for p in points])
        twin = twin_of(current, x, effect)
        if twin is not None:
            x = _best(current, [x, _refined(current, twin, ground.noise)])
        left.remove(effect)
    x = _best(problem, [carried(current.layout, x, layout), _refined(problem, start_vector(problem.records, layout), floor)])
    return plausible(problem, x, floor)


def plausible(problem: Problem, x: FloatArray, floor: Noise) -> FloatArray:
    """Return x, or a twin that fits as well and whose effect is the smaller: a servo is faster than its hull.

    At one speed the two cannot be told apart by any data; the larger lag with the faster hull is possible, not likely.
    """
    for effect in problem.layout.effects:
        twin = twin_of(problem, x, effect)
        place = problem.layout.names.index(effect.coefficients[0].name)
        if twin is None or twin[place] >= x[place]:
            continue
        other = _refined(problem, twin, floor)
        if misfit(problem, other) <= misfit(problem, x) + ALIKE and other[place] < x[place]:
            x = other
    return x


def _best(problem: Problem, candidates: Sequence[FloatArray]) -> FloatArray:
    return min(candidates, key=lambda x: misfit(problem, x))


def _refined(problem: Problem, start: FloatArray, noise: Noise) -> FloatArray:
    """Return where a start leads, weighted once more by what it leaves."""
    found = descend(problem, start, noise, rounds=ROUNDS, tolerance=TOLERANCE).x
    return descend(problem, found, white_weights(problem, found), rounds=ROUNDS, tolerance=TOLERANCE).x
