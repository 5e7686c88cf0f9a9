"""The maximum a posteriori correction of a run's speed: it is measured to 0.3 %, and the authority changes by twice that.

The heading integrates the error: a turn of two radians that is half a percent short is off by five times the noise of a compass.
The speed of a predicted run is therefore a nuisance parameter, as its initial state is, with the measurement as prior. The
relative correction e minimises

    sum over channels |r - S e|^2 / (L s^2) + (e / MEASURED_SPEED_STD_ERROR)^2,   |e| <= MAX_STD_ERRORS MEASURED_SPEED_STD_ERROR,

r the residual and S its derivative by the speed, both with the initial state projected out, s the rms of r and L its correlation
length, so that the residual of a wrong model has little weight. A speed that was not measured is not corrected.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fieldsid.fitting.predict.command_timing import MAX_CORRELATION_LAG_S, correlation_length, residual_rms
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Note
from fieldsid.models.axis import NAMES
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.gram_least_squares import solve_normal_equations

MEASURED_SPEED_STD_ERROR, GUESSED_SPEED_STD_ERROR = 0.003, 0.01
"""Assumed relative standard error of the speed of a run, where it was measured and where it was not."""
MAX_STD_ERRORS = 3.0
"""Largest correction of a speed, in standard errors of its measurement."""
MAX_SPEED_ITERATIONS, CONVERGED_STD_ERRORS = 4, 0.02
"""Most iterations, each with weights of the previous residuals, and the change in standard errors of the speed that ends them."""
STEP_PARTS = (1.0, 0.5, 0.25)
"""Fractions of a step that are tried in turn until the cost falls."""
SURPRISING_STD_ERRORS = 2.0
"""Standard errors from which on the note says that the logged speed or the model's is probably wrong."""


def speed_sensitivity(problem: Problem, x: FloatArray, speed: float) -> FloatArray:
    """Return the change of a one-run problem's shared parameters (F,) with one standard error of the run's speed."""
    return (MEASURED_SPEED_STD_ERROR if np.isfinite(speed) else GUESSED_SPEED_STD_ERROR) * _speed_derivatives(problem, x)


def error_of_speed(problem: Problem, x: FloatArray) -> Noise:
    """Return the rms change of a problem's free runs with one standard error of the measured speeds, in rad and rad/s."""
    moved, squares, counts = _at_speed_share(problem, MEASURED_SPEED_STD_ERROR), np.zeros(2), np.zeros(2)
    for run, record in enumerate(problem.records):
        change = (moved.residual(x, run)[0] - problem.residual(x, run)[0]) * record.ok
        squares, counts = squares + (change**2).sum(axis=1), counts + record.ok.sum(axis=1)
    return Noise(*np.sqrt(squares / np.maximum(counts, 1)).tolist())


def correct_speed(problem: Problem, x: FloatArray, floor: Noise) -> tuple[Problem, FloatArray, float]:
    """Return a one-run problem at the corrected speed, x (N,) with refitted initial state, and the relative correction."""
    groups = problem.layout.groups
    if not (np.isfinite(groups.run_speeds[0]) and np.isfinite(groups.speeds[groups.reference])):
        return problem, x, 0.0
    moved, own, faster = problem, x, 0.0
    for _ in range(MAX_SPEED_ITERATIONS):
        step = _step(moved, own, faster, floor)
        if step is None:
            return problem, x, 0.0
        better = _step_that_gains(moved, own, faster, step)
        if better is None:
            break
        change, (moved, own, faster) = abs(better[2] - faster), better
        if change < CONVERGED_STD_ERRORS * MEASURED_SPEED_STD_ERROR:
            break
    return moved, own, faster


def is_worth_reporting(faster: float) -> bool:
    """Whether a share is worth telling of: within one error of its measurement a speed is as measured."""
    return abs(faster) > MEASURED_SPEED_STD_ERROR


def speed_note(record: Record, faster: float) -> Note | None:
    """Return the note on a run that was flown at another speed than its log has, None within an error of its measurement.

    One that is off by more than its measurement should be is a finding: of the log's scale, or of the model.
    """
    if not is_worth_reporting(faster):
        return None
    sense, errors = "faster" if faster > 0.0 else "slower", abs(faster) / MEASURED_SPEED_STD_ERROR
    message = (
        f"{record.name}: as the motion says, flown {100 * abs(faster):.2f} % {sense} than the {record.speed:.3f} m/s of its log, "
        f"{errors:.1f} x the standard error of {100 * MEASURED_SPEED_STD_ERROR:g} % that a measured speed is taken to have"
    )
    if errors >= SURPRISING_STD_ERRORS:
        most = (
            f" ({100 * MAX_STD_ERRORS * MEASURED_SPEED_STD_ERROR:g} % is the most it is moved by)"
            if errors > MAX_STD_ERRORS - CONVERGED_STD_ERRORS
            else ""
        )
        message += f"{most}: the scale of its speed is probably off, or the model is at this speed"
    return Note(
        "own_speed",
        message,
        {"run": record.name, "faster": faster, "speed_m_s": record.speed, "std_error": MEASURED_SPEED_STD_ERROR},
    )


def _at_speed_share(problem: Problem, share: float) -> Problem:
    return replace(problem, layout=replace(problem.layout, groups=replace(problem.layout.groups, faster=share)))


@dataclass(frozen=True, slots=True)
class _Step:
    """The change of a run's nuisances and, last, of the speed correction; the channels' weights (2, 1), the cost before."""

    change: FloatArray
    weight: FloatArray
    cost: float


def _step(problem: Problem, x: FloatArray, faster: float, floor: Noise) -> _Step | None:
    """Return the Gauss-Newton step of nuisances and speed correction; None where the motion diverges."""
    record, shared, moves = problem.records[0], problem.layout.shared, _speed_derivatives(problem, x)
    result = problem.linearise(x, 0, [*np.flatnonzero(moves).tolist(), *range(shared, x.size)])
    if not np.isfinite(result.stack).all():
        return None
    slopes = np.zeros((x.size, *result.residual.shape))
    slopes[list(result.columns)] = result.sensitivity * record.ok
    columns = np.concatenate([slopes[shared:], np.tensordot(moves, slopes[:shared], axes=1)[None]])
    weight = channel_weights(record, result.residual, floor)[:, None]
    flat, weighted = (columns * weight).reshape(columns.shape[0], -1), (result.residual * weight).ravel()
    gram, right = flat @ flat.T, flat @ weighted
    gram[-1, -1] += MEASURED_SPEED_STD_ERROR**-2
    right[-1] -= faster * MEASURED_SPEED_STD_ERROR**-2
    cost = float(weighted @ weighted) + (faster / MEASURED_SPEED_STD_ERROR) ** 2
    return _Step(solve_normal_equations(gram, right), weight, cost)


def _step_that_gains(problem: Problem, x: FloatArray, faster: float, step: _Step) -> tuple[Problem, FloatArray, float] | None:
    """Return problem, x and correction after the largest fraction of the step that lowers the cost; None where none does.

    The time of an event takes the same fraction of its Gauss-Newton step, which need not be small and may end at another event.
    """
    layout, most = problem.layout, MAX_STD_ERRORS * MEASURED_SPEED_STD_ERROR
    for part in STEP_PARTS:
        share = float(np.clip(faster + part * step.change[-1], -most, most))
        own = x.copy()
        own[layout.shared :] += part * step.change[:-1]
        own = np.clip(own, layout.low, layout.high)
        own[: layout.shared] = x[: layout.shared]
        moved = _at_speed_share(problem, share)
        weighted = moved.residual(own, 0)[0] * step.weight
        if float(np.vdot(weighted, weighted)) + (share / MEASURED_SPEED_STD_ERROR) ** 2 < step.cost:
            return moved, own, share
    return None


def channel_weights(record: Record, residual: FloatArray, floor: Noise) -> FloatArray:
    """Return the weight of each channel (2,): one over its rms residual and the root of its correlation length."""
    lags = round(MAX_CORRELATION_LAG_S / float(np.median(record.steps)))
    lengths = [correlation_length(e[ok], lags) if ok.any() else 1.0 for e, ok in zip(residual, record.ok, strict=True)]
    return 1.0 / (residual_rms(record, residual, floor) * np.sqrt(lengths))


def _speed_derivatives(problem: Problem, x: FloatArray) -> FloatArray:
    """Return the derivatives (F,) of a one-run problem's shared parameters by the relative speed correction."""
    layout, names = problem.layout, NAMES[problem.layout.axis]
    powers = {names.damping: layout.groups.exponent, names.authority: 2.0, names.trim: 2.0 * layout.groups.trim_of_fin}
    return np.array([powers.get(n, 0.0) * x[i] for i, n in enumerate(layout.names)])
