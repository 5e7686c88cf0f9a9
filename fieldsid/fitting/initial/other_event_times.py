"""Starts with one run's event, or the phase of its wave, in another basin of the cost, and other parameters a step along."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fieldsid.errors import EffectError
from fieldsid.fitting.initial.event_times import event_times
from fieldsid.fitting.optimise.levenberg_marquardt import gram_products
from fieldsid.fitting.problem.parameters import Parameter
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.model import Noise
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.bounded_lm_step import bounded_step
from fieldsid.numerics.gram_least_squares import SINGULAR_EIGENVALUE_SHARE
from fieldsid.rounding import nine_digits

SAME_COST_SHARE = 1e-7
"""Share of the cost within which two predictions are of one basin: while the fin rests, an event's time changes nothing."""


def starts_at_other_times(
    problem: Problem, x: FloatArray, noise: Noise, most: int, free: Sequence[int] | None = None
) -> list[FloatArray]:
    """Return up to `most` starts (N,), each with one event's time where a minimum is predicted, the least predicted cost first.

    From each point of a grid a Gauss-Newton step of the `free` parameters (all by default) is taken, the time among them, under
    `noise`. A minimum is predicted where the time stays between the grid's neighbours of its point, and where it would go beyond
    from two neighbours towards each other: beside an edge of the fin it is narrower than the grid.
    """
    layout, runs = problem.layout, range(len(problem.records))
    low, high = x.copy(), x.copy()
    index = list(range(x.size) if free is None else free)
    low[index], high[index] = layout.low[index], layout.high[index]
    grids = {c.name: c.scan for e in layout.effects for c in e.nuisance if c.scan}
    events = [i for i in index if layout.parameters[i].name in grids]
    products = [p for run in runs if events and (p := _products(problem, x, run, noise, index)) is not None]
    if len(products) < len(runs):
        return []
    total, found = np.sum(products, axis=0), list[tuple[float, int, FloatArray]]()
    for event in events:
        slot = layout.parameters[event]
        grid = event_times(problem.records[slot.run]) if slot.is_event else np.array(grids[slot.name])
        steps = []
        for before, time, after in zip([slot.low, *grid[:-1]], grid, [*grid[1:], slot.high], strict=True):
            trial = x.copy()
            trial[event], low[event], high[event] = time, before, after
            own = _products(problem, trial, slot.run, noise, index)
            if own is not None:
                cost, end = _stepped(trial, total - products[slot.run] + own, low, high)
                steps.append(_Step(nine_digits(cost), end, _side(end[event], before, after, slot)))
        low[event], high[event] = slot.low, slot.high
        basins = [s for s in steps if s.side == 0]
        basins += [min(a, b, key=lambda s: s.cost) for a, b in pairwise(steps) if a.side > 0 > b.side]
        found += [(b.cost, event, b.end) for b in _distinct(basins)]
    return [end for *_, end in sorted(found, key=lambda f: f[:2])[:most]]


@dataclass(frozen=True, slots=True)
class _Step:
    """Where a step from a point of a grid leads, its predicted cost, and to which side it would go beyond a neighbour, else 0."""

    cost: float
    end: FloatArray
    side: int


def _side(end: float, before: float, after: float, slot: Parameter) -> int:
    """Return the side to which a step went as far as it might, -1, 0 or 1; beyond a parameter's own bound there is none."""
    return int(end >= after and end < slot.high) - int(end <= before and end > slot.low)


def _distinct(basins: Sequence[_Step]) -> Iterator[_Step]:
    """Yield each basin once."""
    for i, one in enumerate(basins):
        if all(abs(one.cost - b.cost) > SAME_COST_SHARE * abs(b.cost) for b in basins[:i]):
            yield one


def _products(problem: Problem, x: FloatArray, run: int, noise: Noise, free: Sequence[int]) -> FloatArray | None:
    """Return the products (1 + N, 1 + N) of a run's whitened residual and sensitivities, None where the motion diverges."""
    try:
        result = problem.linearise(x, run, free)
    except EffectError:
        return None
    own = gram_products(problem.records[run], noise, result.base.damping, result.base.stiffness, result)
    if own is None:
        return None
    index = np.array([0, *(1 + c for c in result.columns)])
    whole = np.zeros((1 + x.size, 1 + x.size))
    whole[index[:, None], index] = own
    return whole


def _stepped(x: FloatArray, products: FloatArray, low: FloatArray, high: FloatArray) -> tuple[float, FloatArray]:
    """Return the predicted cost after a Gauss-Newton step within bounds (N,), and where it leads."""
    normal, gradient = products[1:, 1:], products[1:, 0]
    step = bounded_step(normal, gradient, SINGULAR_EIGENVALUE_SHARE, x, low, high)
    return float(products[0, 0] - 2.0 * gradient @ step + step @ normal @ step), np.clip(x + step, low, high)
