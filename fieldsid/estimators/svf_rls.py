"""State variable filter and recursive least squares with forgetting: the paper's on-board estimator, over a record.

The history has the estimate after every sample with its standard error, and the time from which each parameter stays near its
last value. The standard errors are those of the recursion, times one factor for each parameter: the ratio of the last error with
and without allowance for coloured residuals. Every estimate is corrected for the bias of white sensor noise. Source: the paper,
estimator 2 (recursive).
"""

from __future__ import annotations

import numpy as np

from fieldsid.errors import DataError
from fieldsid.estimators.svf_ls import (
    bandwidth_notes,
    base_slots,
    finished,
    median_step,
    parameters_of,
    regress,
)
from fieldsid.fitting.problem.estimator import Estimator, History, Options, Solution
from fieldsid.fitting.problem.problem import Problem
from fieldsid.fitting.regression.bias_compensation import NoiseShare, inverse_of_normal, noise_share, transfer_of
from fieldsid.fitting.regression.recursive_ls import MEMORY, A, B, C, K, initial_memory, noise_of, sweep
from fieldsid.fitting.regression.residual_colour_covariance import Series, coloured_covariance
from fieldsid.fitting.regression.svf_equation import Measured, RegressionParameters, measured_signals
from fieldsid.logs.run import Note
from fieldsid.models.record import Record
from fieldsid.noise.white_floor import white_noise_floor
from fieldsid.numerics.arrays import FloatArray
from fieldsid.settled import settled_band

LONGEST_HISTORY = 4000


def solve(problem: Problem, options: Options) -> Solution:
    """Return the last estimate of the recursion over the record, with its history; raises DataError."""
    record, slots = problem.records[0], base_slots(problem)
    if not 0.0 < options.forgetting <= 1.0:
        raise DataError(
            "the forgetting factor must be in (0, 1]", found=f"{options.forgetting:g}", hint="use `--forgetting 0.998`"
        )
    signals = measured_signals(record, options.bandwidth)
    block, _, _ = regress(problem, options.bandwidth)
    values, spread, rows = run(record, signals, options, parameters_of(problem, block, 0), stiff=len(slots) == 4)
    used = np.isfinite(rows[:, -1])
    if used.sum() <= 2 * len(slots):
        raise DataError(
            f"run {record.name!r} is too short for the recursion",
            found=f"{int(used.sum())} samples after the filter has forgotten its start",
            hint="take a longer part, or a larger `--lambda`",
        )
    x = problem.start()
    x[list(slots.values())] = values[-1]
    small, plain = errors_of(problem, x, rows[used], signals, options)
    wider = np.sqrt(np.diag(small) / np.maximum(np.diag(plain), 1e-300))
    history = history_of(record, list(slots), values, spread * wider)
    notes = (*bandwidth_notes([signals], options.bandwidth), *settle_notes(record, history))
    return finished(problem, x, small, ESTIMATOR.name, notes, history)


def share_of(record: Record, signals: Measured, bandwidth: float) -> NoiseShare:
    """Return the contribution of the record's white noise to the products of one row."""
    floor = white_noise_floor([record])
    return noise_share(signals.order, bandwidth, median_step(record), floor.angle, floor.rate)


def run(
    record: Record, signals: Measured, options: Options, theta: RegressionParameters, *, stiff: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return estimates and uncorrected standard errors after every sample (n, p), and rows of phi and target (n, p + 1).

    theta gives the curvature between samples until the estimate of the recursion does.
    """
    count, path = len(record), record.commanded
    samples = np.zeros((count, 6))
    samples[:, 0] = record.time
    samples[1:, 1], samples[1:, 2] = path.start, path.end
    samples[:, 3], samples[:, 4], samples[:, 5] = signals.angle, signals.rate, signals.use
    values, spread, rows = np.empty((count, 4)), np.empty((count, 4)), np.empty((count, 5))
    noise = noise_of(share_of(record, signals, options.bandwidth))
    settings = (options.bandwidth, options.forgetting, signals.order)
    memory = np.zeros(MEMORY)
    memory[[A, K, B, C]] = theta.damping, theta.stiffness, theta.authority, theta.trim
    sweep(memory, initial_memory(stiff=stiff), *settings, 4 if stiff else 3, noise, samples, values, spread, rows)
    keep = [0, 1, 2, 3] if stiff else [0, 2, 3]
    return values[:, keep], spread[:, keep], rows[:, [*keep, 4]]


def errors_of(
    problem: Problem, x: FloatArray, rows: FloatArray, signals: Measured, options: Options
) -> tuple[FloatArray, FloatArray]:
    """Return the covariance (p, p) of the last estimate with and without allowance for colour, both with forgetting."""
    record, theta = problem.records[0], x[list(base_slots(problem).values())]
    weight = np.array(options.forgetting ** np.arange(rows.shape[0] - 1.0, -1.0, -1.0), dtype=np.float64)
    columns, residual = rows[:, :-1], rows[:, -1] - rows[:, :-1] @ theta
    weighted, h = columns * weight[:, None], median_step(record)
    keep = [0, 1, 2, 3] if theta.size == 4 else [0, 2, 3]
    gram = share_of(record, signals, options.bandwidth).gram[np.ix_(keep, keep)] * weight.sum()
    plain_inverse, inverse = inverse_of_normal(weighted.T @ columns, 0.0 * gram), inverse_of_normal(weighted.T @ columns, gram)
    transfer = transfer_of(signals.order, options.bandwidth, h, parameters_of(problem, x, 0))
    power = float(weight @ residual**2) / max(float(weight.sum()) - theta.size, 1.0)
    plain = plain_inverse * (power * float((weight**2).sum() / weight.sum()))
    return coloured_covariance([Series(weighted, residual, transfer, h)], inverse), plain


def history_of(record: Record, names: list[str], values: FloatArray, errors: FloatArray) -> History:
    """Return the history of the recursion, thinned to a few thousand samples, with the settling time of each parameter."""
    keep = np.unique(np.linspace(0, len(record) - 1, min(len(record), LONGEST_HISTORY)).round().astype(int))
    settled = {n: settle_time(record.time, values[:, j], errors[-1, j]) for j, n in enumerate(names)}
    return History(record.time[keep], tuple(names), values[keep], errors[keep], settled)


def settle_time(time: FloatArray, values: FloatArray, last_error: float) -> float:
    """Return the seconds from the start of the record after which a parameter stays near its last value."""
    band = settled_band(float(values[-1]), 2.0 * last_error)
    outside = np.flatnonzero(np.abs(values - values[-1]) > band)
    first = int(outside[-1]) + 1 if outside.size else 0
    return float(time[min(first, time.size - 1)] - time[0])


def settle_notes(record: Record, history: History) -> tuple[Note, ...]:
    """Return the note on parameters that had not settled before the last fifth of the record."""
    length = float(record.time[-1] - record.time[0])
    late = {n: s for n, s in history.settled_s.items() if s > 0.8 * length}
    if not late:
        return ()
    which = ", ".join(f"{n} at {s:.1f} s" for n, s in late.items())
    message = f"not settled before the last fifth of the {length:.0f} s: {which}; fly longer, or let less be forgotten"
    return (Note("not_settled", message, {"settled_s": late, "length_s": length}),)


ESTIMATOR = Estimator(
    name="svf_rls",
    says="the paper's recursive least squares with forgetting: parameters over time, as on board; biased by a disturbance",
    source="the paper, state variable filter and recursive least squares; Ljung 1999, section 11.2",
    solve=solve,
    takes_effects=False,
    joint=False,
)
