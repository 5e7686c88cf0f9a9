"""Where a refit with one effect more should start: how far the error would fall, to first order, at each scan point.

At a point the new residual e and the effect's sensitivity columns C are taken; both are projected off the span of the
parent's sensitivities, and C is solved for. No descent, so that the whole catalogue costs what one refit does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from fieldsid.fitting.descent import cost_of
from fieldsid.fitting.layout import Groups, Layout, group_name, layout_of
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.products import SINGULAR, solved
from fieldsid.fitting.whitening import whiten
from fieldsid.logs.run import FloatArray
from fieldsid.models.axis import NAMES
from fieldsid.models.effect import Coefficient, Effect
from fieldsid.models.model import Noise
from fieldsid.rounding import nine_digits

MOST_POINTS = 12
SHORTENINGS = 4
ROUNDS_ALIKE = 8
GENTLE = 0.03
"""A coefficient of either sign is tried this much weaker too: a slow ship's are far below a small vehicle's."""
WORTHLESS, DEPENDENT = 1e-9, 1e-8
ROUNDED = 1e-9
"""Share of a cost within which two are alike: that much hangs on the order in which a processor adds up."""
SLOWEST_PACE = 1e-3
"""1/s; a base fitted without what is missing may show next to no damping."""


@dataclass(frozen=True, slots=True)
class Promise:
    """What an effect promises: predicted weighted sum of squares, the scan point, and where a whole step from it leads."""

    effect: Effect
    cost: float
    point: FloatArray
    start: FloatArray
    problem: Problem


@dataclass(frozen=True, slots=True)
class Ground:
    """The parent (problem and its x), its residuals (2, n), and an orthonormal basis (rows, rank) of its sensitivities.

    Of each run: an orthonormal basis of the sensitivities to its own slots, and those to the shared ones (S, rows).
    """

    problem: Problem
    x: FloatArray
    noise: Noise
    basis: FloatArray
    own_basis: tuple[FloatArray, ...]
    shared: tuple[FloatArray, ...]
    residuals: tuple[FloatArray, ...]
    cost: float


def grown(parent: Problem, x: FloatArray, effect: Effect, values: Mapping[str, float]) -> tuple[Problem, FloatArray]:
    """Return the problem with one effect more, and the parent's x with the effect's slots at the given values."""
    problem = parent.with_effects((*parent.layout.effects, effect))
    layout = problem.layout
    start = carried(parent.layout, x, layout, values)
    if effect.extra_states and "damping_exponent" in layout.names:
        # a hidden state that is missing drives the exponent far from physics, and a descent does not come back
        place = layout.names.index("damping_exponent")
        start[place] = np.clip(start[place], 0.0, 1.2)
    return problem, start


def carried(old: Layout, x: FloatArray, new: Layout, values: Mapping[str, float] = MappingProxyType({})) -> FloatArray:
    """Return x of one layout in another's order; slots the first lacks take the given values, else their own start."""
    known = {(s.name, s.run): v for s, v in zip(old.slots, x, strict=True)}
    return np.array([known.get((s.name, s.run), values.get(s.name, s.start)) for s in new.slots])


def by_other_law(problem: Problem, x: FloatArray) -> tuple[Problem, FloatArray]:
    """Return a problem under the other law of the speed, and x carried over.

    At several speeds the groups share one authority, or have one each. At one, of which the runs are a little off, the
    damping goes with it or stays.
    """
    old = problem.layout.groups
    several = len(old.speeds) > 1
    return under_groups(problem, x, replace(old, by_law=not old.by_law) if several else replace(old, exponent=1.0 - old.exponent))


def under_groups(problem: Problem, x: FloatArray, groups: Groups) -> tuple[Problem, FloatArray]:
    """Return a problem with its runs' speeds taken in another way, and x carried over."""
    old = problem.layout
    new = layout_of(problem.records, old.axis, old.effects, groups)
    authority = NAMES[old.axis].authority
    shared = float(x[old.names.index(authority)])
    lifted = {group_name(authority, groups, g): shared * groups.over_reference(g) ** 2 for g in range(len(groups.speeds))}
    return Problem(problem.records, new), carried(old, x, new, lifted)


def overlaid(old: Layout, x: FloatArray, new: Layout, own: FloatArray) -> FloatArray:
    """Return a layout's own vector with the numbers of another layout's wherever that has them."""
    known = {(s.name, s.run): v for s, v in zip(old.slots, x, strict=True)}
    return np.array([known.get((s.name, s.run), v) for s, v in zip(new.slots, own, strict=True)])


def twin_of(problem: Problem, x: FloatArray, effect: Effect) -> FloatArray | None:
    """Return the other start that has the same response at one speed, None where the effect has none."""
    layout = problem.layout
    values = dict(zip(layout.names, x[: layout.shared].tolist(), strict=True))
    twin = None if effect.twin is None else effect.twin(values, layout.axis)
    if twin is None:
        return None
    names, start = NAMES[layout.axis], x.copy()
    for i, slot in enumerate(layout.slots):
        if slot.name in twin:
            start[i] = np.clip(twin[slot.name], slot.low, slot.high)
        elif slot.name.startswith(f"{names.authority}@") and values[names.authority] != 0.0:
            start[i] *= twin.get(names.authority, values[names.authority]) / values[names.authority]
    return start


def ground_of(problem: Problem, x: FloatArray, noise: Noise) -> Ground:
    """Return the parent's sensitivities, joint and of each run alone."""
    columns, own, shared, residuals, total = [], [], [], [], 0.0
    first_own = problem.layout.shared
    for run, record in enumerate(problem.records):
        result = problem.linearise(x, run)
        residuals.append(result.residual)
        white, _ = whiten(record, noise, result.base.damping, result.base.stiffness, result.stack)
        flat = white.reshape(white.shape[0], -1)
        total += float(flat[0] @ flat[0])
        block = np.zeros((flat.shape[1], len(problem.layout.slots)))
        block[:, list(result.slots)] = flat[1:].T
        columns.append(block)
        own.append(_orthonormal(block[:, first_own:]))
        shared.append(block[:, :first_own].T)
    return Ground(problem, x, noise, _orthonormal(np.concatenate(columns)), tuple(own), tuple(shared), tuple(residuals), total)


def _orthonormal(columns: FloatArray) -> FloatArray:
    """Return an orthonormal basis (rows, rank) of columns (rows, k), some of which may depend on others.

    Where one does, the decomposition makes up a direction for it and keeps those after it from that: it is done again without.
    """
    size = np.linalg.norm(columns, axis=0)
    kept = columns[:, size > 0] / size[size > 0]
    while True:
        q, r = np.linalg.qr(kept)
        independent = np.abs(np.diag(r)) > DEPENDENT
        if independent.all():
            return np.asarray(q)
        kept = kept[:, independent]


def promise_of(ground: Ground, effect: Effect) -> Promise:
    """Return the best scan point of an effect over its shared grid, its per-run grids chosen run by run."""
    return promises_of(ground, effect)[0]


def promises_of(ground: Ground, effect: Effect) -> list[Promise]:
    """Return every scan point of an effect over its shared grid, the best first, their starts a whole step away."""
    problem, begun = grown(ground.problem, ground.x, effect, {})
    new, promises = _new_slots(problem, effect), []
    for values in shared_points(ground, effect):
        x = begun.copy()
        x[new] = [values.get(problem.layout.every[i], x[i]) for i in new]
        for c in effect.nuisance:
            x = _best_per_run(ground, problem, x, new, c)
        promises.append(Promise(effect, *_first_order(ground, problem, x, new), problem))
    return sorted(promises, key=lambda p: nine_digits(p.cost))


def shared_points(ground: Ground, effect: Effect) -> list[dict[str, float]]:
    """Return the starts of an effect's shared coefficients: what it suggests itself, else the points of its grids."""
    if effect.suggest is not None and (suggested := effect.suggest(ground.problem.records, ground.residuals)):
        return suggested
    pace = pace_of(ground.problem, ground.x)
    scans = [[np.clip(v * pace**c.pace, c.low, c.high) for v in c.scan] or [_begun(c)] for c in effect.shared]
    grids = [tuple(dict.fromkeys(scan)) for scan in scans]
    points = [dict(zip([c.name for c in effect.shared], p, strict=True)) for p in product(*grids)]
    step = -(-len(points) // MOST_POINTS)
    points = points[::step]
    signed = {c.name for c in effect.shared if c.low < 0.0 < c.high and c.scan}
    return points + [{n: GENTLE * v if n in signed else v for n, v in point.items()} for point in points if signed]


def _begun(c: Coefficient) -> float:
    """Return where the screen takes a coefficient without a grid: of either sign at none of it, where its slope is exact.

    A typical size is a small vehicle's, and on a slow ship as far from the truth as a heading's worth of moment.
    """
    return 0.0 if c.low < 0.0 < c.high else c.start


def pace_of(problem: Problem, x: FloatArray) -> float:
    """Return how fast the hull itself is at the reference speed, 1/s: its damping, and what its stiffness swings it at.

    Drag that grows with the motion may leave the linear damping next to nothing: the rate the fin's moment keeps up tells.
    """
    layout = problem.layout
    names, values = NAMES[layout.axis], dict(zip(layout.names, x[: layout.shared].tolist(), strict=True))
    stiffness = 0.0 if names.stiffness is None else values[names.stiffness]
    fin = np.concatenate([r.fin[r.rate_ok] for r in problem.records])
    rate = np.concatenate([r.rate[r.rate_ok] for r in problem.records])
    swing = float(np.std(rate)) if rate.size else 0.0
    kept_up = abs(values[names.authority]) * float(np.std(fin)) / swing if swing > 0.0 else 0.0
    return float(max(abs(values[names.damping]) + np.sqrt(abs(stiffness)), kept_up, SLOWEST_PACE))


def _new_slots(problem: Problem, effect: Effect) -> list[int]:
    names = {c.name for c in effect.coefficients} | ({"rate_before"} if effect.extra_states else set())
    return [i for i, s in enumerate(problem.layout.slots) if s.name in names]


def run_rows(ground: Ground, problem: Problem, x: FloatArray, run: int, new: Sequence[int]) -> FloatArray:
    """Return one run's whitened residual, and what it is by each of the new slots, (1 + k, m)."""
    record = problem.records[run]
    result = problem.linearise(x, run, new)
    if not np.isfinite(result.stack).all():
        rows = np.zeros((1 + len(new), 2 * len(record)))
        rows[0] = 1e6
        return rows
    white, _ = whiten(record, ground.noise, result.base.damping, result.base.stiffness, result.stack)
    flat = white.reshape(white.shape[0], -1)
    if result.slots == tuple(new):
        return flat
    rows = np.zeros((1 + len(new), flat.shape[1]))
    rows[[0, *(1 + list(new).index(slot) for slot in result.slots)]] = flat
    return rows


def all_rows(ground: Ground, problem: Problem, x: FloatArray, new: Sequence[int]) -> FloatArray:
    """Return the whitened residual of all runs, and what it is by each of the new slots, (1 + k, rows)."""
    return np.concatenate([run_rows(ground, problem, x, run, new) for run in range(len(problem.records))], axis=1)


def _first_order(ground: Ground, problem: Problem, x: FloatArray, new: Sequence[int]) -> tuple[float, FloatArray, FloatArray]:
    """Return the predicted cost after one step in the new slots, where the step begins, and its bounded end."""
    rows, index = all_rows(ground, problem, x, new), list(new)
    left = projected(ground.basis, rows)
    step = _step_in(left, np.einsum("ij,ij->i", rows, rows)[1:])
    low, high = problem.layout.low[index], problem.layout.high[index]
    start = x.copy()
    wished = x[index] + step
    start[index] = np.clip(wished, low + 1e-3 * (x[index] - low), high - 1e-3 * (high - x[index]))
    if np.any((wished < low) | (wished > high)):
        step = start[index] - x[index]
    after = left[0] - step @ left[1:]
    return float(after @ after), x, start


def _step_in(left: FloatArray, before: FloatArray) -> FloatArray:
    """Return the step (k,) that lowers the first row most by the others, (1 + k, rows), their squares (k,) before projection."""
    gram = left @ left.T
    useful = np.diag(gram)[1:] > 1e-12 * np.maximum(before, WORTHLESS**2)
    step, places = np.zeros(before.size), 1 + np.flatnonzero(useful)
    if places.size:
        step[useful] = solved(gram[places[:, None], places], gram[places, 0])
    return step


def shortened(ground: Ground, promise: Promise) -> Promise:
    """Return a promise with its start drawn back towards the scan point until the free run is no worse than there."""
    problem, x, start = promise.problem, promise.point, promise.start
    limit = cost_of(problem, x, ground.noise)
    for _ in range(SHORTENINGS):
        if cost_of(problem, start, ground.noise) <= limit:
            return replace(promise, start=start)
        start = 0.6 * x + 0.4 * start
    return replace(promise, start=x)


def projected(basis: FloatArray, rows: FloatArray) -> FloatArray:
    """Return rows (k, m) once the orthonormal columns of a basis (m, r) are taken off."""
    return np.asarray(rows - (rows @ basis) @ basis.T)


def _best_per_run(ground: Ground, problem: Problem, x: FloatArray, new: Sequence[int], c: Coefficient) -> FloatArray:
    """Return x with one per-run nuisance at the grid point each run likes best, the effect's shared numbers alike for all.

    Each run alone would take the event of its own that suits it, large or small; a run without any would find one.
    """
    x = x.copy()
    shared = [i for i in new if problem.layout.slots[i].run < 0]
    grid = c.scan or (c.start,)
    places, squares = [], []
    for run in range(len(problem.records)):
        slot = next(i for i in problem.layout.of_run(run) if problem.layout.slots[i].name == c.name)
        own = [i for i in new if i != slot and problem.layout.slots[i].run == run]
        for value in grid:
            x[slot] = value
            rows = run_rows(ground, problem, x, run, [*shared, *own])
            basis = _orthonormal_beside(ground.own_basis[run], rows[1 + len(shared) :].T)
            left = projected(basis, np.concatenate([rows[: 1 + len(shared)], ground.shared[run]]))
            squares.append(left @ left.T)
        places.append(slot)
    square = np.array(squares).reshape(len(places), len(grid), *squares[0].shape)
    low, high = (bound[shared] - x[shared] for bound in (problem.layout.low, problem.layout.high))
    x[places] = np.array(grid)[_alike(square, low, high)]
    return x


def _orthonormal_beside(basis: FloatArray, columns: FloatArray) -> FloatArray:
    """Return an orthonormal basis (rows, rank) of a basis and the columns beside it."""
    if not columns.any():
        return basis
    return np.concatenate([basis, _orthonormal(columns - basis @ (basis.T @ columns))], axis=1)


def _alike(square: FloatArray, low: FloatArray, high: FloatArray) -> npt.NDArray[np.intp]:
    """Return the grid points (R,) whose costs sum to the least for one step, within its bounds (k,), that all runs take.

    square (R, G, 1 + k + S, 1 + k + S) are each run's products at each grid point, the parent's shared numbers last. The step
    is sought among those that a run alone would take at a grid point, whatever the shared numbers are there; then improved
    with what all runs have chosen, and at last with the shared numbers that all have in common: what comes at a run's start
    and stays is to a run alone as good as another trim.
    """
    alone = _without(square, 1 + low.size)
    chosen = _settled_alike(alone, _cheapest_alone(alone, low, high), low, high)
    return _settled_alike(square, chosen, low, high)


def _without(square: FloatArray, first: int) -> FloatArray:
    """Return products (..., first, first) once the columns from `first` on are projected off."""
    scale = np.sqrt(np.maximum(np.einsum("...ii->...i", square)[..., first:], 1e-300))
    rest = square[..., first:, first:] / scale[..., :, None] / scale[..., None, :]
    cross = square[..., :first, first:] / scale[..., None, :]
    inverse = np.linalg.pinv(rest, rcond=SINGULAR, hermitian=True)
    return np.asarray(square[..., :first, :first] - cross @ inverse @ cross.swapaxes(-1, -2))


def _costs(square: FloatArray, step: FloatArray) -> FloatArray:
    """Return each run's cost at each grid point after a step, (R, G)."""
    row = np.concatenate([[1.0], -step])
    return np.asarray(np.einsum("i,rgij,j->rg", row, square, row))


def _within(one: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the step of products (1 + K, 1 + K), its first numbers within their bounds (k,)."""
    step = solved(one[1:, 1:], one[1:, 0])
    step[: low.size] = np.clip(step[: low.size], low, high)
    return step


def _cheapest_alone(square: FloatArray, low: FloatArray, high: FloatArray) -> npt.NDArray[np.intp]:
    """Return the grid points (R,) for the best of the steps that a run alone would take at a grid point."""
    alone = (_costs(square, _within(one, low, high)) for one in square.reshape(-1, *square.shape[2:]))
    return _first_least(min(alone, key=lambda costs: nine_digits(float(costs.min(axis=1).sum()))))


def _first_least(costs: FloatArray) -> npt.NDArray[np.intp]:
    """Return the first of each row's grid points that cost the least (R,): while a fin rests, an event's time changes nothing."""
    return np.asarray((costs <= (1.0 + ROUNDED) * costs.min(axis=1, keepdims=True)).argmax(axis=1))


def _settled_alike(
    square: FloatArray, chosen: npt.NDArray[np.intp], low: FloatArray, high: FloatArray
) -> npt.NDArray[np.intp]:  # fmt: skip
    """Return the grid points (R,) at which the step that all runs take together and what each then chooses agree."""
    runs = np.arange(square.shape[0])
    for _ in range(ROUNDS_ALIKE):
        again = _first_least(_costs(square, _within(square[runs, chosen].sum(axis=0), low, high)))
        if (again == chosen).all():
            break
        chosen = again
    return chosen
