"""The grid points of a nuisance, one for each run, at which one common step of the shared parameters costs least."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import numpy.typing as npt

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.gram_least_squares import SINGULAR_EIGENVALUE_SHARE, solve_normal_equations
from fieldsid.rounding import nine_digits

MAX_GRID_ITERATIONS = 8

COST_ROUNDING_SHARE = 1e-9
"""Share of a cost within which two costs are equal: the order of summation, which depends on the processor, changes it that
much."""


def joint_grid_search(square: FloatArray, low: FloatArray, high: FloatArray) -> npt.NDArray[np.intp]:
    """Return the grid points (R,) with the least total cost after one common step, within its bounds (k,).

    square (R, G, 1 + k + S, 1 + k + S) are the products of each run at each grid point, with the parent's shared parameters last.
    The search has three stages:
    1. From the step that each run alone would take at each point, with the parent's shared parameters projected out, the common
       step and the grid points of the runs are improved in turn.
    2. From each result this is repeated with the parent's shared parameters common to all runs. An event that persists from the
       start of a run is, in that run alone, equivalent to another trim.
    3. From each result the grid point of one run after another is moved to where the total cost is least after the common step
       has been solved for again. The single-run steps of stage 1 may be far from the common step, and an alternation with a fixed
       step ends near the step it started from.
    The result of the least cost is returned: runs with an event throughout and runs without any are exchanged at little cost, so
    that there are several local minima.
    """
    alone, runs = _schur_complement(square, 1 + low.size), np.arange(square.shape[0])
    starts = _distinct(_first_least(_costs(alone, step)) for step in _single_run_steps(alone, low, high))
    own = _distinct(_alternate_grid_and_step(alone, start, low, high) for start in starts)
    ends = _distinct(_alternate_grid_and_step(square, start, low, high) for start in own)

    def cost(chosen: npt.NDArray[np.intp]) -> float:
        step = _bounded_step(square[runs, chosen].sum(axis=0), low, high)
        return nine_digits(float(_costs(square, step)[runs, chosen].sum()))

    return min((_descend_run_by_run(square, end, low, high) for end in ends), key=cost)


def _descend_run_by_run(
    square: FloatArray, chosen: npt.NDArray[np.intp], low: FloatArray, high: FloatArray
) -> npt.NDArray[np.intp]:  # fmt: skip
    """Return grid points (R,) at which no change of one run's point lowers the total cost after the common step."""
    runs, chosen = np.arange(square.shape[0]), chosen.copy()
    for _ in range(MAX_GRID_ITERATIONS):
        before = chosen.copy()
        for run in runs:
            others = square[runs, chosen].sum(axis=0) - square[run, chosen[run]]
            least = _first_least(_least_costs(others + square[run], low, high)[None])[0]
            chosen[run] = least
        if (chosen == before).all():
            break
    return chosen


def _least_costs(square: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the costs (G,) of products (G, 1 + K, 1 + K), each after its best step; its first k numbers are within bounds."""
    gram, right = square[:, 1:, 1:], square[:, 1:, 0]
    size = np.sqrt(np.einsum("gii->gi", gram))
    size[size == 0.0] = 1.0
    ridge = SINGULAR_EIGENVALUE_SHARE * np.eye(right.shape[1])
    steps = np.linalg.solve(gram / size[:, None] / size[..., None] + ridge, (right / size)[..., None])[..., 0] / size
    steps[:, : low.size] = np.clip(steps[:, : low.size], low, high)
    rows = np.concatenate([np.ones((len(steps), 1)), -steps], axis=1)
    return np.asarray(np.einsum("gi,gij,gj->g", rows, square, rows))


def _distinct(points: Iterable[npt.NDArray[np.intp]]) -> list[npt.NDArray[np.intp]]:
    """Return the distinct grid points (R,), in order of first occurrence."""
    return list({tuple(p.tolist()): p for p in points}.values())


def _schur_complement(square: FloatArray, first: int) -> FloatArray:
    """Return products (..., first, first) with the columns from `first` on projected out."""
    scale = np.sqrt(np.maximum(np.einsum("...ii->...i", square)[..., first:], 1e-300))
    rest = square[..., first:, first:] / scale[..., :, None] / scale[..., None, :]
    cross = square[..., :first, first:] / scale[..., None, :]
    inverse = np.linalg.pinv(rest, rcond=SINGULAR_EIGENVALUE_SHARE, hermitian=True)
    return np.asarray(square[..., :first, :first] - cross @ inverse @ cross.swapaxes(-1, -2))


def _costs(square: FloatArray, step: FloatArray) -> FloatArray:
    """Return each run's cost at each grid point after a step, (R, G)."""
    row = np.concatenate([[1.0], -step])
    return np.asarray(np.einsum("i,rgij,j->rg", row, square, row))


def _bounded_step(one: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the Gauss-Newton step of products (1 + K, 1 + K); its first k numbers are within bounds (k,)."""
    step = solve_normal_equations(one[1:, 1:], one[1:, 0])
    step[: low.size] = np.clip(step[: low.size], low, high)
    return step


def _single_run_steps(square: FloatArray, low: FloatArray, high: FloatArray) -> Iterator[FloatArray]:
    """Yield the steps that single runs would take at each grid point, ordered by their cost to all runs."""
    steps = [_bounded_step(one, low, high) for one in square.reshape(-1, *square.shape[2:])]
    yield from sorted(steps, key=lambda step: nine_digits(float(_costs(square, step).min(axis=1).sum())))


def _first_least(costs: FloatArray) -> npt.NDArray[np.intp]:
    """Return the first grid point of least cost in each row (R,): while the fin is at rest, many points have the same cost."""
    return np.asarray((costs <= (1.0 + COST_ROUNDING_SHARE) * costs.min(axis=1, keepdims=True)).argmax(axis=1))


def _alternate_grid_and_step(
    square: FloatArray, chosen: npt.NDArray[np.intp], low: FloatArray, high: FloatArray
) -> npt.NDArray[np.intp]:  # fmt: skip
    """Return grid points (R,) that are each run's best after the common step that is the best at these points."""
    runs = np.arange(square.shape[0])
    for _ in range(MAX_GRID_ITERATIONS):
        again = _first_least(_costs(square, _bounded_step(square[runs, chosen].sum(axis=0), low, high)))
        if (again == chosen).all():
            break
        chosen = again
    return chosen
