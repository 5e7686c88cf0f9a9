"""State variable filter over the whole record at once: the paper's regression, solved by instrumental variables.

Phi Theta = Q with Phi = [-p_f, -y_f, delta_f, 1_f] from the filter's states; the initial values have columns as well. The command
is a zero-order hold. The measurement is linear between samples at first, then parabolic with the curvature of the last estimate.
The paper's least squares is the first estimate; a disturbance biases it, by a quarter in a sea, and the instruments take that
out. The speed law of a joint fit is a(u) ~ u. Source: the paper, estimator 2 (block); Soederstroem and Stoica 1983.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fieldsid.errors import DataError
from fieldsid.fitting.checks.closed_loop import closed_loop_note
from fieldsid.fitting.optimise.residual_weights import residual_noise
from fieldsid.fitting.optimise.unbounded_motion import refuse_unbounded_motion
from fieldsid.fitting.predict.predict import refit_nuisances
from fieldsid.fitting.problem.estimator import Estimator, History, Options, Solution
from fieldsid.fitting.problem.parameters import group_name
from fieldsid.fitting.problem.problem import Problem
from fieldsid.fitting.regression.instruments import instrumental_variables, moved_by_fin
from fieldsid.fitting.regression.noise_transfer import transfer_of
from fieldsid.fitting.regression.residual_colour_covariance import Series, coloured_covariance, noise_colour
from fieldsid.fitting.regression.svf_equation import Equation, Measured, RegressionParameters, filtered_equation, measured_signals
from fieldsid.logs.run import Note
from fieldsid.models.axis import NAMES
from fieldsid.models.record import Record
from fieldsid.noise.white_floor import white_noise_floor
from fieldsid.numerics.arrays import FloatArray

REFINEMENTS = 3
"""Estimates in turn, each with the instruments of the one before; they start from that of least squares."""
MAX_ANGLE_ONLY_BANDWIDTH_RAD_S = 4.0
"""Filter bandwidth (rad/s) above which the noise of an angle alone, differentiated twice, scatters and biases the damping: with
noise of 0.3 deg by 4 % at 8 rad/s and by 11 % at 12."""


def solve(problem: Problem, options: Options) -> Solution:
    """Return the instrumental-variable solution of a joint problem; raises DataError where the data do not determine it."""
    found = regress(problem, options.bandwidth)
    series = found.series(problem, options.bandwidth)
    covariance = coloured_covariance(series, found.inverse)
    notes = (*bandwidth_notes(found.signals, options.bandwidth), *feedback_notes(problem, series))
    return finished(problem, found.x, covariance, ESTIMATOR.name, notes)


@dataclass(frozen=True, slots=True)
class Regression:
    """The estimate x (N,), and theta (P,) of base parameters and start terms with its rows and instruments (m, P).

    `inverse` (P, P) is that of rows times instruments, `signals` and `own` are the signals and base parameters of each run.
    """

    x: FloatArray
    theta: FloatArray
    rows: Stacked
    instruments: FloatArray
    inverse: FloatArray
    signals: list[Measured]
    own: list[RegressionParameters]

    def series(self, problem: Problem, bandwidth: float) -> list[Series]:
        """Return the instruments and residuals of each run."""
        residual = self.rows.target - self.rows.matrix @ self.theta
        return [
            Series(self.instruments[part], residual[part], transfer_of(s.order, bandwidth, median_step(r), t), median_step(r))
            for part, s, r, t in zip(self.rows.parts, self.signals, problem.records, self.own, strict=True)
        ]

    @classmethod
    def of(cls, problem: Problem, signals: list[Measured], rows: Stacked, instruments: FloatArray) -> Regression:
        """Return the estimate of rows by instruments (m, P)."""
        slots, x = list(base_slots(problem).values()), problem.start()
        theta, inverse = instrumental_variables(instruments, rows.matrix, rows.target)
        x[slots] = theta[: len(slots)]
        own = [parameters_of(problem, x, run) for run in range(len(problem.records))]
        return cls(x, theta, rows, instruments, inverse, signals, own)


def regress(problem: Problem, bandwidth: float) -> Regression:
    """Return the estimate by instrumental variables; raises DataError where the data do not determine it."""
    signals = [measured_signals(r, bandwidth) for r in problem.records]
    rows = stacked(problem, signals, bandwidth)
    refuse_empty(rows, len(base_slots(problem)))
    found = Regression.of(problem, signals, rows, rows.matrix)
    for _ in range(REFINEMENTS):
        by_fin = [moved_by_fin(*run) for run in zip(problem.records, signals, found.own, strict=True)]
        rows, instruments = (stacked(problem, given, bandwidth, found.own) for given in (signals, by_fin))
        found = Regression.of(problem, signals, rows, instruments.matrix)
    return found


def stacked(
    problem: Problem, signals: list[Measured], bandwidth: float, own: list[RegressionParameters] | None = None
) -> Stacked:
    """Return the rows of signals of each run; `own`, where known, gives the curvature between samples."""
    known: Sequence[RegressionParameters | None] = own or [None] * len(signals)
    blocks = [filtered_equation(r, s, bandwidth, t) for r, s, t in zip(problem.records, signals, known, strict=True)]
    return Stacked.of(problem, blocks, base_slots(problem))


def median_step(record: Record) -> float:
    """Return the median sampling interval in s."""
    return float(np.median(record.steps))


@dataclass(frozen=True, slots=True)
class Stacked:
    """The regression rows of all runs: matrix (m, P) of base parameters and start terms, target and time (m,), parts by run."""

    matrix: FloatArray
    target: FloatArray
    time: FloatArray
    parts: tuple[slice, ...]

    @classmethod
    def of(cls, problem: Problem, blocks: list[Equation], slots: dict[str, int]) -> Stacked:
        """Stack the regressions of a joint problem's runs."""
        width = len(slots) + sum(b.start.shape[1] for b in blocks)
        matrix = np.zeros((sum(b.target.size for b in blocks), width))
        parts, top, left = [], 0, len(slots)
        for run, block in enumerate(blocks):
            part = slice(top, top + block.target.size)
            matrix[part] = block.columns @ column_map(problem, run, slots, width)
            matrix[part, left : left + block.start.shape[1]] = block.start
            parts.append(part)
            top, left = part.stop, left + block.start.shape[1]
        target, time = np.concatenate([b.target for b in blocks]), np.concatenate([b.time for b in blocks])
        return cls(matrix, target, time, tuple(parts))


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


def base_slots(problem: Problem) -> dict[str, int]:
    """Return the position of every base parameter that is estimated, in the order of the regression's columns."""
    names, layout = NAMES[problem.layout.axis], problem.layout
    wanted = [names.damping, *([] if names.stiffness is None else [names.stiffness])]
    wanted += [group_name(names.authority, layout.groups, g) for g in range(len(layout.groups.speeds))] + [names.trim]
    return {n: layout.names.index(n) for n in wanted}


def refuse_empty(rows: Stacked, wanted: int) -> None:
    """Raise DataError where one of the first `wanted` columns is zero or there are too few rows."""
    dead = np.flatnonzero(~rows.matrix[:, :wanted].any(axis=0))
    if rows.target.size < rows.matrix.shape[1] or dead.size:
        raise DataError(
            "the filtered data cannot carry a least squares",
            found=f"{rows.target.size} usable samples, {dead.size} parameters without any signal",
            hint="take a run, or a part of one, in which the fin moves",
        )


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


def bandwidth_notes(signals: Sequence[Measured], bandwidth: float) -> tuple[Note, ...]:
    """Return the note on a filter bandwidth that is too large for a log without a rate."""
    if bandwidth <= MAX_ANGLE_ONLY_BANDWIDTH_RAD_S or all(s.order == 1 for s in signals):
        return ()
    message = (
        f"no rate was measured and the filter is wide (lambda = {bandwidth:g}, limit {MAX_ANGLE_ONLY_BANDWIDTH_RAD_S:g} rad/s): "
        "noise of the angle biases the damping; use `--method srivc` or a smaller lambda"
    )
    return (Note("wide_filter_angle_only", message, {"lambda": bandwidth, "limit": MAX_ANGLE_ONLY_BANDWIDTH_RAD_S}),)


def feedback_notes(problem: Problem, series: Sequence[Series]) -> Iterator[Note]:
    """Yield the note on runs whose fin follows a disturbance: under a controller, with more than a sensor's white noise."""
    flown = [run for run, record in enumerate(problem.records) if any(closed_loop_note(record))]
    runs = [problem.records[run].name for run in flown if noise_colour([series[run]]).denominator.size > 1]
    if runs:
        message = (
            f"run {', '.join(map(repr, runs))}: a controller moves the fin, and the residual is not the sensor's white noise: of "
            "what disturbs the hull the instruments then have a part, which biases the estimate; use `--method pem`"
        )
        yield Note("instruments_follow_disturbance", message, {"runs": runs})


ESTIMATOR = Estimator(
    name="svf_ls",
    says="the paper's state variable filter over the whole record, by instruments that the fin makes; no search",
    source="the paper, state variable filter; Soederstroem and Stoica 1983, Instrumental Variable Methods",
    solve=solve,
    takes_effects=False,
)
