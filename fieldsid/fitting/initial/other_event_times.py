"""Starts with the time of one run's event, or the phase of its wave, in another basin of attraction of the cost."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fieldsid.errors import EffectError
from fieldsid.fitting.initial.event_times import event_times
from fieldsid.fitting.optimise.levenberg_marquardt import gram_products
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.model import Noise
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.bounded_lm_step import bounded_step
from fieldsid.numerics.gram_least_squares import SINGULAR_EIGENVALUE_SHARE
from fieldsid.rounding import nine_digits

SAME_COST_SHARE = 1e-7
"""Relative difference of predicted costs within which two minima count as one: while the fin is at rest, the time of an event
does not change the cost."""


def starts_at_other_times(
    problem: Problem, x: FloatArray, noise: Noise, most: int, free: Sequence[int] | None = None
) -> list[FloatArray]:
    """Return up to `most` starts (N,), each with the time of one event at a predicted minimum, the least predicted cost first.

    From each point of a grid of times a Gauss-Newton step of the `free` parameters (all by default), including the time, is taken
    under `noise`. A minimum is predicted where the time stays between the neighbouring grid points, and between two neighbours
    whose steps point at each other: near an edge of the fin a minimum is narrower than the grid.
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
                cost, end = _bounded_trial(trial, total - products[slot.run] + own, low, high)
                side = int(end[event] >= after and after < slot.high) - int(end[event] <= before and before > slot.low)
                steps.append(_Step(nine_digits(cost), trial, end, side))
        low[event], high[event] = slot.low, slot.high
        found += [(cost, event, start) for cost, start in _basins(steps)]
    return [end for *_, end in sorted(found, key=lambda f: f[:2])[:most]]


@dataclass(frozen=True, slots=True)
class _Step:
    """A step from a grid point: predicted cost, begin and end, and +1 or -1 where the time reaches the next neighbour, else 0."""

    cost: float
    begin: FloatArray
    end: FloatArray
    side: int


def _basins(steps: Sequence[_Step]) -> Iterator[tuple[float, FloatArray]]:
    """Yield predicted cost and start of each minimum: the end of a step, or halfway along the better of two opposed steps."""
    seen = list[float]()
    for one in steps:
        if one.side == 0 and all(abs(one.cost - cost) > SAME_COST_SHARE * cost for cost in seen):
            seen.append(one.cost)
            yield one.cost, one.end
    for a, b in pairwise(steps):
        if a.side > 0 > b.side:
            better = min(a, b, key=lambda s: s.cost)
            yield better.cost, 0.5 * (better.begin + better.end)


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
    embedded = np.zeros((1 + x.size, 1 + x.size))
    embedded[index[:, None], index] = own
    return embedded


def _bounded_trial(x: FloatArray, products: FloatArray, low: FloatArray, high: FloatArray) -> tuple[float, FloatArray]:
    """Return the predicted cost after a Gauss-Newton step within bounds (N,), and the end of the step."""
    normal, gradient = products[1:, 1:], products[1:, 0]
    step = bounded_step(normal, gradient, SINGULAR_EIGENVALUE_SHARE, x, low, high)
    return float(products[0, 0] - 2.0 * gradient @ step + step @ normal @ step), np.clip(x + step, low, high)
