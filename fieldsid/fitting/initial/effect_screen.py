"""The screen of effects: the first-order prediction of how far the cost falls if one effect is added, at each scan point.

At a scan point the residual e and the sensitivities C to the effect's coefficients are computed; both are projected off the span
of the parent's sensitivities, and C is solved for. There is no descent: screening the catalogue costs as much as one refit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from types import MappingProxyType

import numpy as np

from fieldsid.fitting.initial.event_times import event_times
from fieldsid.fitting.initial.joint_grid_search import joint_grid_search
from fieldsid.fitting.optimise.levenberg_marquardt import cost_of, levenberg_marquardt
from fieldsid.fitting.problem.parameters import ParameterLayout, SpeedGroups, group_name, layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.axis import NAMES
from fieldsid.models.effect import Coefficient, Effect, Stage
from fieldsid.models.model import Noise
from fieldsid.noise.whiten import whiten
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.gram_least_squares import solve_normal_equations
from fieldsid.rounding import nine_digits

MAX_SCAN_POINTS = 12
MAX_BACKTRACKS = 4
MAX_SETTLING_ITERATIONS, SETTLED_COST_SHARE = 4, 1e-3
"""Iterations that fit all parameters except the times of events, and the share of the cost that each must gain."""
WEAK_START_SHARE = 0.03
"""Coefficients of either sign are also tried at this share of their scan value: those of a slow ship are far below those of a
small vehicle. So are lags and dead times: with a dead band, no first-order step from a long lag reaches one shorter than a
sample."""
EVENT_REFINEMENT = 7
"""Points of the refined grid between the neighbours of an event's best grid point."""
MIN_COLUMN_NORM, MIN_INDEPENDENT_SHARE = 1e-9, 1e-8
MIN_HULL_RATE_1_S = 1e-3
"""Least hull rate in 1/s: a base model that lacks an effect may have almost no damping."""


@dataclass(frozen=True, slots=True)
class ScreenResult:
    """The prediction for one effect: cost (weighted sum of squares), scan point, start after a full step, and its problem."""

    effect: Effect
    predicted_cost: float
    point: FloatArray
    start: FloatArray
    problem: Problem


@dataclass(frozen=True, slots=True)
class Linearisation:
    """A model linearised at x: its residuals (2, n), and an orthonormal basis (rows, rank) of its whitened sensitivities.

    For each run it also has a basis of the sensitivities to its nuisances, and the sensitivities to the shared parameters (S,
    rows).
    """

    problem: Problem
    x: FloatArray
    noise: Noise
    basis: FloatArray
    nuisance_basis: tuple[FloatArray, ...]
    shared: tuple[FloatArray, ...]
    residuals: tuple[FloatArray, ...]
    cost: float


def with_effect(parent: Problem, x: FloatArray, effect: Effect, values: Mapping[str, float]) -> tuple[Problem, FloatArray]:
    """Return the problem with one effect more, and the parent's x with the effect's coefficients at the given values."""
    problem = parent.with_effects((*parent.layout.effects, effect))
    layout = problem.layout
    start = carry_parameters(layout, (parent.layout, x), otherwise=values)
    if effect.extra_states and "damping_exponent" in layout.names:
        # a model without the hidden state has an unphysical exponent, from which a descent does not return
        place = layout.names.index("damping_exponent")
        start[place] = np.clip(start[place], 0.0, 1.2)
    return problem, start


def carry_parameters(
    to: ParameterLayout, *of: tuple[ParameterLayout, FloatArray], otherwise: Mapping[str, float] = MappingProxyType({})
) -> FloatArray:
    """Return the vector of layout `to`, each parameter taken from the first of the layouts and vectors `of` that has it.

    A parameter that none of them has takes its value from `otherwise`, else its start value.
    """
    known = {(s.name, s.run): v for layout, x in reversed(of) for s, v in zip(layout.parameters, x, strict=True)}
    return np.array([known.get((s.name, s.run), otherwise.get(s.name, s.start)) for s in to.parameters])


def under_other_speed_law(problem: Problem, x: FloatArray) -> tuple[Problem, FloatArray]:
    """Return a problem under the other speed law, and x transferred to it.

    At several speeds: one authority for all groups, or one for each. At a single one: damping that scales with the runs' slightly
    different speeds, or not.
    """
    old = problem.layout.groups
    several = len(old.speeds) > 1
    return under_speed_groups(
        problem, x, replace(old, by_law=not old.by_law) if several else replace(old, exponent=1.0 - old.exponent)
    )


def under_speed_groups(problem: Problem, x: FloatArray, groups: SpeedGroups) -> tuple[Problem, FloatArray]:
    """Return a problem with other speed groups, and x carried over."""
    old = problem.layout
    new = layout_of(problem.records, old.axis, old.effects, groups)
    authority = NAMES[old.axis].authority
    shared = float(x[old.names.index(authority)])
    authorities = {group_name(authority, groups, g): shared * groups.over_reference(g) ** 2 for g in range(len(groups.speeds))}
    return replace(problem, layout=new), carry_parameters(new, (old, x), otherwise=authorities)


def equivalent_solution(problem: Problem, x: FloatArray, effect: Effect) -> FloatArray | None:
    """Return x at the equivalent solution of an effect, which has the same response at one speed; None where there is none."""
    layout = problem.layout
    values = dict(zip(layout.names, x[: layout.shared].tolist(), strict=True))
    equivalent = None if effect.equivalent_solution is None else effect.equivalent_solution(values, layout.axis)
    if equivalent is None:
        return None
    names, start = NAMES[layout.axis], x.copy()
    for i, slot in enumerate(layout.parameters):
        if slot.name in equivalent:
            start[i] = np.clip(equivalent[slot.name], slot.low, slot.high)
        elif slot.name.startswith(f"{names.authority}@") and values[names.authority] != 0.0:
            start[i] *= equivalent.get(names.authority, values[names.authority]) / values[names.authority]
    return start


def linearise_at(problem: Problem, x: FloatArray, noise: Noise) -> Linearisation:
    """Return the linearisation of a model at x, of all runs and of each run alone."""
    columns, own, shared, residuals, total = [], [], [], [], 0.0
    first_own = problem.layout.shared
    for run, record in enumerate(problem.records):
        result = problem.linearise(x, run)
        residuals.append(result.residual)
        white, _ = whiten(record, noise, result.base.damping, result.base.stiffness, result.stack)
        flat = white.reshape(white.shape[0], -1)
        total += float(flat[0] @ flat[0])
        block = np.zeros((flat.shape[1], len(problem.layout.parameters)))
        block[:, list(result.columns)] = flat[1:].T
        columns.append(block)
        own.append(_orthonormal(block[:, first_own:]))
        shared.append(block[:, :first_own].T)
    return Linearisation(
        problem, x, noise, _orthonormal(np.concatenate(columns)), tuple(own), tuple(shared), tuple(residuals), total
    )


def _orthonormal(columns: FloatArray) -> FloatArray:
    """Return an orthonormal basis (rows, rank) of columns (rows, k), some of which may depend on others.

    For a dependent column the decomposition returns an arbitrary direction, which spoils the later ones: it is repeated without.
    """
    size = np.linalg.norm(columns, axis=0)
    scaled = columns[:, size > 0] / size[size > 0]
    while True:
        q, r = np.linalg.qr(scaled)
        independent = np.abs(np.diag(r)) > MIN_INDEPENDENT_SHARE
        if independent.all():
            return np.asarray(q)
        scaled = scaled[:, independent]


def screen_effect(linearisation: Linearisation, effect: Effect) -> ScreenResult:
    """Return the best screen result of an effect over its shared scan grid, its nuisance grids searched run by run."""
    return screen_points(linearisation, effect)[0]


def screen_points(linearisation: Linearisation, effect: Effect) -> list[ScreenResult]:
    """Return the screen results at every point of an effect's shared scan grid, the best first."""
    problem, initial = with_effect(linearisation.problem, linearisation.x, effect, {})
    variant = problem.layout.effects[-1]  # next to another effect with a cross state it is its variant without one
    new, screened_points = _new_slots(problem, variant), []
    low, high = problem.layout.low[new], problem.layout.high[new]
    for values in scan_points(linearisation, variant):
        x = initial.copy()
        x[new] = np.clip([values.get(problem.layout.every[i], x[i]) for i in new], low, high)
        for c in effect.nuisance:
            x = _best_per_run(linearisation, problem, x, new, c)
        screened_points.append(ScreenResult(effect, *_first_order(linearisation, problem, x, new), problem))
    return sorted(screened_points, key=lambda p: nine_digits(p.predicted_cost))


def scan_points(linearisation: Linearisation, effect: Effect) -> list[dict[str, float]]:
    """Return the scan points of an effect's shared coefficients: its initial guesses, then the points of its grids if any."""
    suggested = (
        [] if effect.initial_guesses is None else effect.initial_guesses(linearisation.problem.records, linearisation.residuals)
    )
    if suggested and not any(c.scan for c in effect.shared):
        return suggested
    rate = hull_rate(linearisation.problem, linearisation.x)
    scans = [[np.clip(v * rate**c.rate_exponent, c.low, c.high) for v in c.scan] or [_screen_value(c)] for c in effect.shared]
    grids = [tuple(dict.fromkeys(scan)) for scan in scans]
    points = [dict(zip([c.name for c in effect.shared], p, strict=True)) for p in product(*grids)]
    step = -(-len(points) // MAX_SCAN_POINTS)
    points = points[::step]
    weak = {c.name for c in effect.shared if c.scan and (c.low < 0.0 < c.high or (c.low == 0.0 and shifts_time(effect)))}
    return (
        suggested + points + [{n: WEAK_START_SHARE * v if n in weak else v for n, v in point.items()} for point in points if weak]
    )


def shifts_time(effect: Effect) -> bool:
    """Whether an effect shifts the command against the measurement: outside the hull, with a scanned coefficient in s."""
    return effect.stage is not Stage.HYDRODYNAMICS and any(c.unit == "s" and c.scan for c in effect.shared)


def _screen_value(c: Coefficient) -> float:
    """Return the value at which a coefficient without a grid is screened: zero for one of either sign, else its start value.

    The declared start is typical of a small vehicle; on a slow ship it would dominate the moments.
    """
    return 0.0 if c.low < 0.0 < c.high else c.start


def hull_rate(problem: Problem, x: FloatArray) -> float:
    """Return the characteristic rate of the hull at the reference speed, 1/s, from its damping and stiffness.

    With nonlinear drag the linear damping may be near zero: then the ratio of the fin's moment to the rate is a lower bound.
    """
    layout = problem.layout
    names, values = NAMES[layout.axis], dict(zip(layout.names, x[: layout.shared].tolist(), strict=True))
    stiffness = 0.0 if names.stiffness is None else values[names.stiffness]
    fin = np.concatenate([r.fin[r.rate_ok] for r in problem.records])
    rate = np.concatenate([r.rate[r.rate_ok] for r in problem.records])
    swing = float(np.std(rate)) if rate.size else 0.0
    sustained = abs(values[names.authority]) * float(np.std(fin)) / swing if swing > 0.0 else 0.0
    return float(max(abs(values[names.damping]) + np.sqrt(abs(stiffness)), sustained, MIN_HULL_RATE_1_S))


def _new_slots(problem: Problem, effect: Effect) -> list[int]:
    names = {c.name for c in effect.coefficients} | ({"rate_before"} if effect.extra_states else set())
    return [i for i, s in enumerate(problem.layout.parameters) if s.name in names]


def whitened_rows_of_run(
    linearisation: Linearisation, problem: Problem, x: FloatArray, run: int, new: Sequence[int]
) -> FloatArray:
    """Return one run's whitened residual and its derivatives by the new parameters, (1 + k, m)."""
    record = problem.records[run]
    result = problem.linearise(x, run, new)
    if not np.isfinite(result.stack).all():
        rows = np.zeros((1 + len(new), 2 * len(record)))
        rows[0] = 1e6
        return rows
    white, _ = whiten(record, linearisation.noise, result.base.damping, result.base.stiffness, result.stack)
    flat = white.reshape(white.shape[0], -1)
    if result.columns == tuple(new):
        return flat
    rows = np.zeros((1 + len(new), flat.shape[1]))
    rows[[0, *(1 + list(new).index(slot) for slot in result.columns)]] = flat
    return rows


def whitened_rows(linearisation: Linearisation, problem: Problem, x: FloatArray, new: Sequence[int]) -> FloatArray:
    """Return the whitened residual of all runs and its derivatives by the new parameters, (1 + k, rows)."""
    return np.concatenate(
        [whitened_rows_of_run(linearisation, problem, x, run, new) for run in range(len(problem.records))], axis=1
    )


def _first_order(
    linearisation: Linearisation, problem: Problem, x: FloatArray, new: Sequence[int]
) -> tuple[float, FloatArray, FloatArray]:
    """Return the predicted cost after one step in the new parameters, the point the step starts from, and its bounded end."""
    rows, index = whitened_rows(linearisation, problem, x, new), list(new)
    left = project_out(linearisation.basis, rows)
    step = _gauss_newton_step(left, np.einsum("ij,ij->i", rows, rows)[1:])
    low, high = problem.layout.low[index], problem.layout.high[index]
    start = x.copy()
    unbounded = x[index] + step
    start[index] = np.clip(unbounded, low + 1e-3 * (x[index] - low), high - 1e-3 * (high - x[index]))
    if np.any((unbounded < low) | (unbounded > high)):
        step = start[index] - x[index]
    after = left[0] - step @ left[1:]
    return float(after @ after), x, start


def _gauss_newton_step(left: FloatArray, before: FloatArray) -> FloatArray:
    """Return the Gauss-Newton step (k,) of projected rows (1 + k, rows), their squares (k,) before the projection `before`."""
    gram = left @ left.T
    useful = np.diag(gram)[1:] > 1e-12 * np.maximum(before, MIN_COLUMN_NORM**2)
    step, places = np.zeros(before.size), 1 + np.flatnonzero(useful)
    if places.size:
        step[useful] = solve_normal_equations(gram[places[:, None], places], gram[places, 0])
    return step


def backtrack(linearisation: Linearisation, screened: ScreenResult) -> ScreenResult:
    """Return a screen result with its start moved back towards the scan point until its cost is no higher than there.

    The times of events then stay fixed while all other parameters are fitted: the parameters of the parent are biased as it lacks
    the effect, and a step of an event's time from there may end at another event or at none.
    """
    problem, x, start = screened.problem, screened.point, screened.start
    limit = cost_of(problem, x, linearisation.noise)
    for _ in range(MAX_BACKTRACKS):
        if cost_of(problem, start, linearisation.noise) <= limit:
            break
        start = 0.6 * x + 0.4 * start
    else:
        start = x
    events = {c.name for c in screened.effect.nuisance}
    free = [i for i, slot in enumerate(problem.layout.parameters) if not (slot.is_event and slot.name in events)]
    if len(free) < start.size:
        start = levenberg_marquardt(
            problem, start, linearisation.noise, free=free, max_iterations=MAX_SETTLING_ITERATIONS, tolerance=SETTLED_COST_SHARE
        ).x
    return replace(screened, start=start)


def project_out(basis: FloatArray, rows: FloatArray) -> FloatArray:
    """Return rows (k, m) with the orthonormal columns of a basis (m, r) projected out."""
    return np.asarray(rows - (rows @ basis) @ basis.T)


def _best_per_run(
    linearisation: Linearisation, problem: Problem, x: FloatArray, new: Sequence[int], c: Coefficient
) -> FloatArray:
    """Return x with one nuisance at the best grid point of each run, for shared parameters that are common to all runs.

    With shared parameters of its own, each run would choose an event of another size, and a run without an event would find one.
    The time of an event is then refined between its neighbours on the grid, as a pulse of the fin may be shorter than their
    distance.
    """
    grid = c.scan or (c.start,)
    runs = range(len(linearisation.problem.records))
    slots = problem.layout.parameters
    places = [next(i for i in problem.layout.nuisances_of(run) if slots[i].name == c.name) for run in runs]
    x = _at_best_points(linearisation, problem, x, new, places, np.tile(grid, (len(places), 1)))
    if not slots[places[0]].is_event or len(grid) < 2:
        return x
    spacing = grid[1] - grid[0]
    refined = [
        event_times(record, EVENT_REFINEMENT, max(t - spacing, c.low), min(t + spacing, c.high))
        for record, t in zip(problem.records, x[places], strict=True)
    ]
    return _at_best_points(linearisation, problem, x, new, places, np.array(refined))


def _at_best_points(
    linearisation: Linearisation, problem: Problem, x: FloatArray, new: Sequence[int], places: Sequence[int], grids: FloatArray
) -> FloatArray:
    """Return x with the nuisance at `places`, one for each run, at the best of the run's grid points (R, G)."""
    x = x.copy()
    shared, squares = [i for i in new if problem.layout.parameters[i].run < 0], []
    for run, (slot, grid) in enumerate(zip(places, grids, strict=True)):
        own = [i for i in new if i != slot and problem.layout.parameters[i].run == run]
        basis = linearisation.nuisance_basis[run]
        parent = project_out(basis, linearisation.shared[run])
        of_parent = parent @ parent.T
        for value in grid:
            x[slot] = value
            rows = project_out(basis, whitened_rows_of_run(linearisation, problem, x, run, [*shared, *own]))
            first, of_nuisances = rows[: 1 + len(shared)], rows[1 + len(shared) :]
            if of_nuisances.any():
                left = project_out(_orthonormal(of_nuisances.T), np.concatenate([first, parent]))
                squares.append(left @ left.T)
            else:
                cross = first @ parent.T
                squares.append(np.concatenate([np.hstack([first @ first.T, cross]), np.hstack([cross.T, of_parent])]))
    square = np.array(squares).reshape(*grids.shape, *squares[0].shape)
    low, high = (bound[shared] - x[shared] for bound in (problem.layout.low, problem.layout.high))
    x[list(places)] = grids[np.arange(len(places)), joint_grid_search(square, low, high)]
    return x
