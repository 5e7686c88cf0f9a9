"""State variable filter and block least squares: the paper's method on the whole record at once.

Phi Theta = Q with Phi = [-p_f, -y_f, delta_f, 1_f] from the filter's states; the initial values have columns as well. The command
is a zero-order hold. The measurement is linear between samples at first, then parabolic with the curvature of the last estimate.
The speed law of a joint fit is a(u) ~ u. Source: the paper, estimator 2 (block least squares).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldsid.errors import DataError
from fieldsid.estimators.output_error import residual_noise
from fieldsid.fitting.optimise.unbounded_motion import refuse_unbounded_motion
from fieldsid.fitting.predict.predict import refit_nuisances
from fieldsid.fitting.problem.estimator import Estimator, History, Options, Solution
from fieldsid.fitting.problem.parameters import group_name
from fieldsid.fitting.problem.problem import Problem
from fieldsid.fitting.regression.bias_compensation import inverse_of_normal, noise_can_go, noise_share, transfer_of
from fieldsid.fitting.regression.residual_colour_covariance import Series, coloured_covariance
from fieldsid.fitting.regression.svf_equation import Equation, Measured, RegressionParameters, filtered_equation, measured_signals
from fieldsid.logs.run import Note
from fieldsid.models.axis import NAMES
from fieldsid.models.record import Record
from fieldsid.noise.white_floor import white_noise_floor
from fieldsid.numerics.arrays import FloatArray

BIAS_CORRECTION_PASSES = 3
MAX_ANGLE_ONLY_BANDWIDTH_RAD_S = 4.0
"""Filter bandwidth (rad/s) above which the noise of an angle alone biases the damping."""


def solve(problem: Problem, options: Options) -> Solution:
    """Return the block least-squares solution of a joint problem; raises DataError where the data do not determine it."""
    x, covariance, signals = regress(problem, options.bandwidth)
    return finished(problem, x, covariance, ESTIMATOR.name, bandwidth_notes(signals, options.bandwidth))


def regress(problem: Problem, bandwidth: float) -> tuple[FloatArray, FloatArray, list[Measured]]:
    """Return the parameter vector (N,), the covariance of base parameters and start terms, and the signals of each run."""
    signals = [measured_signals(r, bandwidth) for r in problem.records]
    slots = base_slots(problem)
    theta: list[RegressionParameters] | None = None
    for _ in range(BIAS_CORRECTION_PASSES):
        blocks = [
            filtered_equation(r, s, bandwidth, None if theta is None else theta[i])
            for i, (r, s) in enumerate(zip(problem.records, signals, strict=True))
        ]
        rows = Stacked.of(problem, blocks, slots)
        found = least_squares(rows, len(slots))
        found, inverse = without_noise_bias(problem, rows, found, signals, bandwidth)
        x = problem.start()
        x[list(slots.values())] = found[: len(slots)]
        theta = [parameters_of(problem, x, run) for run in range(len(problem.records))]
    residual = rows.target - rows.matrix @ found
    series = [
        Series(rows.matrix[part], residual[part], transfer_of(s.order, bandwidth, median_step(r), t), median_step(r))
        for part, s, r, t in zip(rows.parts, signals, problem.records, theta or [], strict=True)
    ]
    return x, coloured_covariance(series, inverse), signals


def median_step(record: Record) -> float:
    """Return the median sampling interval in s."""
    return float(np.median(record.steps))


@dataclass(frozen=True, slots=True)
class Stacked:
    """The regression rows of all runs: matrix (m, P) of base parameters and start terms, target (m,), rows of each run.

    `maps`, one (4, P) for each run, express the four base parameters of the run by those of the stack.
    """

    matrix: FloatArray
    target: FloatArray
    parts: tuple[slice, ...]
    maps: tuple[FloatArray, ...]

    @classmethod
    def of(cls, problem: Problem, blocks: list[Equation], slots: dict[str, int]) -> Stacked:
        """Stack the regressions of a joint problem's runs."""
        width = len(slots) + sum(b.start.shape[1] for b in blocks)
        matrix = np.zeros((sum(b.target.size for b in blocks), width))
        parts, maps, top, left = [], [], 0, len(slots)
        for run, block in enumerate(blocks):
            part = slice(top, top + block.target.size)
            own = column_map(problem, run, slots, width)
            matrix[part] = block.columns @ own
            matrix[part, left : left + block.start.shape[1]] = block.start
            parts.append(part)
            maps.append(own)
            top, left = part.stop, left + block.start.shape[1]
        return cls(matrix, np.concatenate([b.target for b in blocks]), tuple(parts), tuple(maps))


def column_map(problem: Problem, run: int, slots: dict[str, int], width: int) -> FloatArray:
    """Return the matrix (4, width) from the shared parameters to a run's damping, stiffness, authority and trim."""
    names, groups = NAMES[problem.layout.axis], problem.layout.groups
    order, out = list(slots), np.zeros((4, width))
    ones = problem.start()
    ones[list(slots.values())] = 1.0
    unit = problem.base_of(ones, run)
    out[0, order.index(names.damping)] = unit.damping
    if names.stiffness is not None:
        out[1, order.index(names.stiffness)] = 1.0
    out[2, order.index(group_name(names.authority, groups, groups.of_run[run]))] = unit.authority
    out[3, order.index(names.trim)] = problem.scales[run][0] ** 2 if groups.trim_of_fin else 1.0
    return out


def without_noise_bias(
    problem: Problem, rows: Stacked, found: FloatArray, signals: list[Measured], bandwidth: float
) -> tuple[FloatArray, FloatArray]:
    """Return the estimate (P,) corrected for the bias of white sensor noise, and its inverse normal matrix (P, P).

    Where noise makes up more than half of the information in a direction, the estimate is returned uncorrected.
    """
    normal = rows.matrix.T @ rows.matrix
    gram, cross = np.zeros_like(normal), np.zeros(normal.shape[0])
    for record, s, part, own in zip(problem.records, signals, rows.parts, rows.maps, strict=True):
        floor = white_noise_floor([record])
        share = noise_share(s.order, bandwidth, median_step(record), floor.angle, floor.rate)
        count = part.stop - part.start
        gram += count * own.T @ share.gram @ own
        cross += count * own.T @ share.cross
    inverse = inverse_of_normal(normal, gram)
    return np.asarray(found + inverse @ (gram @ found - cross)) if noise_can_go(normal, gram) else found, inverse


def base_slots(problem: Problem) -> dict[str, int]:
    """Return the position of every base parameter that is estimated, in the order of the regression's columns."""
    names, layout = NAMES[problem.layout.axis], problem.layout
    wanted = [names.damping, *([] if names.stiffness is None else [names.stiffness])]
    wanted += [group_name(names.authority, layout.groups, g) for g in range(len(layout.groups.speeds))] + [names.trim]
    return {n: layout.names.index(n) for n in wanted}


def least_squares(rows: Stacked, wanted: int) -> FloatArray:
    """Return the solution (P,); raises DataError where one of the first `wanted` columns is zero or there are too few rows."""
    matrix, target = rows.matrix, rows.target
    scale = np.linalg.norm(matrix, axis=0)
    dead = np.flatnonzero(scale[:wanted] == 0.0)
    if target.size < matrix.shape[1] or dead.size:
        raise DataError(
            "the filtered data cannot carry a least squares",
            found=f"{target.size} usable samples, {dead.size} parameters without any signal",
            hint="take a run, or a part of one, in which the fin moves",
        )
    solution: FloatArray = np.linalg.lstsq(matrix / np.maximum(scale, 1e-300), target, rcond=1e-12)[0]
    return np.asarray(solution / np.maximum(scale, 1e-300))


def parameters_of(problem: Problem, x: FloatArray, run: int) -> RegressionParameters:
    """Return a run's own base parameters."""
    base = problem.base_of(x, run)
    return RegressionParameters(base.damping, base.stiffness, base.authority, base.trim)


def finished(
    problem: Problem,
    x: FloatArray,
    known: FloatArray,
    method: str,
    notes: tuple[Note, ...],
    history: History | None = None,
) -> Solution:
    """Return the solution with the initial state of every run fitted, and with the noise of the free run.

    `known` is a covariance whose first rows are those of the base parameters; further rows are ignored.

    Raises DivergenceError where the motion of the solution grows without bound.
    """
    layout, slots = problem.layout, list(base_slots(problem).values())
    covariance = np.zeros((layout.shared, layout.shared))
    covariance[np.ix_(slots, slots)] = known[: len(slots), : len(slots)]
    x = np.clip(x, layout.low, layout.high)
    for run, record in enumerate(problem.records):
        x = refit_nuisances(problem, x, run, white_noise_floor([record]))
    refuse_unbounded_motion(problem, x, method, instead="use `--method output_error`, which keeps to motions that stay bounded")
    noise = residual_noise(problem, x, len(slots))
    return Solution(x, covariance, noise, method, notes, history=history)


def bandwidth_notes(signals: list[Measured], bandwidth: float) -> tuple[Note, ...]:
    """Return the note on a filter bandwidth that is too large for a log without a rate."""
    if bandwidth <= MAX_ANGLE_ONLY_BANDWIDTH_RAD_S or all(s.order == 1 for s in signals):
        return ()
    message = (
        f"no rate was measured and the filter is wide (lambda = {bandwidth:g}, limit {MAX_ANGLE_ONLY_BANDWIDTH_RAD_S:g} rad/s): "
        "noise of the angle biases the damping; use `--method srivc` or a smaller lambda"
    )
    return (Note("wide_filter_angle_only", message, {"lambda": bandwidth, "limit": MAX_ANGLE_ONLY_BANDWIDTH_RAD_S}),)


ESTIMATOR = Estimator(
    name="svf_ls",
    says="the paper's state variable filter with least squares over the whole record; no simulation, biased by a disturbance",
    source="the paper, state variable filter and block least squares; Garnier and Wang 2008, chapter 1",
    solve=solve,
    takes_effects=False,
)
