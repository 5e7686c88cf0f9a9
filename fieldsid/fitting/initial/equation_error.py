"""Start values without simulation (equation error): the equation of motion integrated over short windows, by least squares.

A hidden cross state is the measured rate through a first-order lag, so at each damping of a grid its moment is one more column:
    x' = -d f x - k f^2 p,  x(0) = -(k/d) f p(0)     =>     x = -k f^2 [p through 1/(s + d f), from its steady state at p(0)]
(effects/_cross_state.py). Without the column, the estimated damping is a mixture of both modes, far from either where the cross
flow is strong.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from fieldsid.dynamics.assemble import fin_path
from fieldsid.fitting.problem.parameters import ParameterLayout, group_name
from fieldsid.fitting.regression.state_variable_filter import filtered
from fieldsid.models.axis import NAMES
from fieldsid.models.fin_path import FinPath
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import BoolArray, FloatArray
from fieldsid.rounding import nine_digits

INTEGRATION_WINDOW_S = 0.6
FALLBACK_DAMPING, FALLBACK_STIFFNESS = 0.3, 0.0
"""Damping in 1/s and stiffness in 1/s^2 of the start where equation error gives an unstable vehicle."""
MAX_GROWTH = 1e6
"""Largest growth of the initial state within a record: no sensor resolves it to a millionth, so a free run that grows more
diverges."""
CROSS_STATE, CROSS_DAMPINGS = ("cross_damping", "cross_rate"), 13
"""The coefficients of a cross state whose moment is the state itself, and the number of grid points of its damping: its bounds
are a factor of a hundred apart, neighbours a factor of about 1.5."""


@dataclass(frozen=True, slots=True)
class _Windows:
    """The windows of all runs: columns (m, k) of the base parameters `names`, targets (m,), and the declared start values."""

    matrix: FloatArray
    target: FloatArray
    names: tuple[str, ...]
    declared: FloatArray


def equation_error_start(
    records: Sequence[Record], layout: ParameterLayout, values: Mapping[str, float] = MappingProxyType({})
) -> FloatArray:
    """Return a start vector with the base parameters from windowed equation error, with the fin as the actuator effects move it.

    All other parameters have their value in `values`, otherwise the start value of the layout.
    """
    windows = _windows_of(records, layout, values)
    return windows.declared if _unusable(windows) else _base_start(records, layout, windows)


def equation_error_starts(records: Sequence[Record], layout: ParameterLayout) -> tuple[FloatArray, ...]:
    """Return the start vectors of equation error: without a cross state, and with one where the layout has a cross state.

    Noise of the rate and missing effects bias the second more than the first; it may be far from any real hull.
    """
    windows = _windows_of(records, layout, {})
    if _unusable(windows):
        return (windows.declared,)
    return (_base_start(records, layout, windows), *_with_cross_state(records, layout, windows))


def _windows_of(records: Sequence[Record], layout: ParameterLayout, values: Mapping[str, float]) -> _Windows:
    x = np.array([values.get(s.name, s.start) for s in layout.parameters])
    names, groups = NAMES[layout.axis], layout.groups
    base = [names.damping, *([] if names.stiffness is None else [names.stiffness])]
    base += [*dict.fromkeys(group_name(names.authority, groups, i) for i in range(len(groups.speeds))), names.trim]
    rows, targets = [], []
    for run, record in enumerate(records):
        own = [i for i, s in enumerate(layout.parameters) if s.run in (-1, run)]
        path = fin_path(record, layout.effects, {layout.every[i]: float(x[i]) for i in own})
        block, target = integrated_windows(record, path, stiff=names.stiffness is not None)
        full = np.zeros((len(target), len(base)))
        share = _speed_ratio(groups.run_speeds[run], groups.speeds[groups.reference])
        full[:, 0] = block[:, 0] * share
        if names.stiffness is not None:
            full[:, 1] = block[:, 1]
        lift = share**2 if groups.by_law else 1.0
        full[:, base.index(group_name(names.authority, groups, groups.of_run[run]))] = block[:, 2] * lift
        full[:, -1] = block[:, 3] * (share**2 if groups.trim_of_fin else 1.0)
        rows.append(full)
        targets.append(target)
    return _Windows(np.concatenate(rows), np.concatenate(targets), tuple(base), x)


def _unusable(windows: _Windows) -> bool:
    """Return whether least squares is impossible: too few windows, or values in a log whose squares overflow."""
    with np.errstate(over="ignore", invalid="ignore"):
        length = float(np.linalg.norm(windows.matrix) + np.linalg.norm(windows.target))
    return len(windows.target) < len(windows.names) or not np.isfinite(length)


def _base_start(records: Sequence[Record], layout: ParameterLayout, windows: _Windows) -> FloatArray:
    longest = max(float(r.time[-1] - r.time[0]) for r in records)
    solution = _stable(windows.matrix, windows.target, longest, stiff=NAMES[layout.axis].stiffness is not None)
    return _start_with(layout, windows, dict(zip(windows.names, solution.tolist(), strict=True)))


def _start_with(layout: ParameterLayout, windows: _Windows, found: Mapping[str, float]) -> FloatArray:
    """Return the declared start with the numbers found, within their bounds."""
    x, columns = windows.declared.copy(), [s.name for s in layout.parameters[: layout.shared]]
    for name, value in found.items():
        slot = layout.parameters[columns.index(name)]
        x[columns.index(name)] = float(np.clip(value, slot.low, slot.high))
    return x


def _with_cross_state(records: Sequence[Record], layout: ParameterLayout, windows: _Windows) -> list[FloatArray]:
    """Return the start whose base parameters and cross state jointly fit the windows best; empty without a cross state.

    Hull and cross flow may each be unstable alone, so that neither damping is constrained.
    """
    columns = [s.name for s in layout.parameters[: layout.shared]]
    if not {*CROSS_STATE} <= {*columns} or "strip_munk" in columns:
        return []
    slot = layout.parameters[columns.index(CROSS_STATE[0])]
    best, least = dict[str, float](), np.inf
    for damping in np.geomspace(slot.low, slot.high, CROSS_DAMPINGS):
        column = [_cross_windows(r, layout, run, float(damping)) for run, r in enumerate(records)]
        full = np.column_stack([windows.matrix, np.concatenate(column)])
        solution = _scaled_least_squares(full, windows.target)
        cost = nine_digits(float(np.sum((windows.target - full @ solution) ** 2)))
        if cost < least:
            least = cost
            best = dict(zip((*windows.names, CROSS_STATE[1]), solution.tolist(), strict=True)) | {CROSS_STATE[0]: float(damping)}
    return [_start_with(layout, windows, best)]


def _cross_windows(record: Record, layout: ParameterLayout, run: int, damping: float) -> FloatArray:
    """Return the column (m,) of a unit cross rate over the windows of a run."""
    groups = layout.groups
    share = _speed_ratio(groups.run_speeds[run], groups.speeds[groups.reference])
    rate, ok = _rate(record)
    h, pace = record.steps, damping * share
    lagged = filtered(h, rate[:-1], rate[1:], pace)[:, 0] + rate[0] / pace * np.exp(-pace * (record.time - record.time[0]))
    sums = _integral(0.5 * (lagged[:-1] + lagged[1:]) * h)
    count = _window_length(record)
    if len(record) <= count + 2:
        return np.zeros(0)
    return np.asarray(-(share**2) * (sums[count:] - sums[:-count])[_mostly_measured(ok, count)])


def _stable(matrix: FloatArray, target: FloatArray, length: float, *, stiff: bool) -> FloatArray:
    """Return the least-squares solution (k,), with damping or stiffness fixed where the motion would grow within `length` s.

    Measurements that are late or early make a stable vehicle look unstable, and a descent from an unstable start diverges.
    """
    fixed: dict[int, float] = {}
    while True:
        rest = [i for i in range(matrix.shape[1]) if i not in fixed]
        solution = np.zeros(matrix.shape[1])
        solution[list(fixed)] = list(fixed.values())
        solution[rest] = _scaled_least_squares(matrix[:, rest], target - matrix @ solution)
        if 0 not in fixed and solution[0] <= 0.0:
            fixed[0] = FALLBACK_DAMPING
        elif stiff and 1 not in fixed and _growth_rate(solution[0], solution[1]) * length > np.log(MAX_GROWTH):
            fixed[1] = FALLBACK_STIFFNESS
        else:
            return solution


def _growth_rate(damping: float, stiffness: float) -> float:
    """Return the real part of the fastest growing motion of y'' = -damping y' - stiffness y, 1/s."""
    return 0.5 * (float(np.sqrt(max(damping**2 - 4.0 * stiffness, 0.0))) - damping)


def _scaled_least_squares(matrix: FloatArray, target: FloatArray) -> FloatArray:
    scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-12)
    return np.asarray(np.linalg.lstsq(matrix / scale, target, rcond=1e-10)[0] / scale)


def _speed_ratio(speed: float, reference: float) -> float:
    ok = np.isfinite(speed) and np.isfinite(reference)
    return float(speed / reference) if ok else 1.0


def integrated_windows(record: Record, path: FinPath, *, stiff: bool) -> tuple[FloatArray, FloatArray]:
    """Return columns (m, 4) [-int p, -int y, int delta, W] and targets (m,) of a run and its fin; no angle where not `stiff`."""
    h = record.steps
    rate, ok = _rate(record)
    angle = _angle(record, rate)
    count = _window_length(record)
    if len(record) <= count + 2:
        return np.zeros((0, 4)), np.zeros(0)
    sums = [_integral(0.5 * (v[:-1] + v[1:]) * h) for v in (rate, angle)]
    fin = _integral(path.mean * h)
    time = record.time - record.time[0]
    span = slice(count, None), slice(None, -count)
    parts = [s[span[0]] - s[span[1]] for s in (*sums, fin, time)]
    smooth = _smoothed(rate)
    target = smooth[span[0]] - smooth[span[1]]
    good = _mostly_measured(ok, count)
    block = np.column_stack([-parts[0], -parts[1] if stiff else 0 * parts[1], parts[2], parts[3]])
    return block[good], target[good]


def _window_length(record: Record) -> int:
    """Return the samples of a window."""
    return max(2, round(INTEGRATION_WINDOW_S / float(np.median(record.steps))))


def _rate(record: Record) -> tuple[FloatArray, BoolArray]:
    """Return the measured rate, or the smoothed slope of the angle where there is none."""
    if record.rate_ok.any():
        known = record.rate_ok
        return np.interp(record.time, record.time[known], record.rate[known]), known
    known = record.angle_ok
    angle = _smoothed(np.interp(record.time, record.time[known], record.angle[known]), 9)
    return np.gradient(angle, record.time), known


def _angle(record: Record, rate: FloatArray) -> FloatArray:
    """Return the measured angle, or the integral of the rate where there is none: its unknown start is part of the trim."""
    if record.angle_ok.any():
        return np.interp(record.time, record.time[record.angle_ok], record.angle[record.angle_ok])
    return _integral(0.5 * (rate[:-1] + rate[1:]) * record.steps)


def _smoothed(values: FloatArray, width: int = 5) -> FloatArray:
    width = min(width, values.size)
    kernel = np.ones(width) / width
    weight = np.convolve(np.ones_like(values), kernel, mode="same")
    return np.asarray(np.convolve(values, kernel, mode="same") / weight)


def _mostly_measured(ok: BoolArray, count: int) -> BoolArray:
    missing = _integral((~ok).astype(float))[: ok.size]
    total = np.append(missing, missing[-1] + float(not ok[-1]))[: ok.size + 1]
    return np.asarray((total[count : ok.size] - total[: ok.size - count]) < 0.2 * count)


def _integral(values: FloatArray) -> FloatArray:
    return np.concatenate([[0.0], np.cumsum(values)])
