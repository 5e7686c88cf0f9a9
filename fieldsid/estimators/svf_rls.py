"""State variable filter and recursive least squares with forgetting: the paper's on-board estimator, over a record.

The estimate of every sample is kept with its band, and the time from which each parameter stays near its last value.
Bands are those of the recursion, widened by what the colour of the residuals adds at the end.
Source: the paper, estimator 2 (recursive).
"""

from __future__ import annotations

import numpy as np

from fieldsid.errors import DataError
from fieldsid.estimators.svf_ls import bandwidth_notes, base_slots, finished, median_step, theta_of
from fieldsid.fitting.equation import Measured, measured_signals
from fieldsid.fitting.method import Estimator, History, Options, Solution
from fieldsid.fitting.noise import floor_of
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.recursive import INITIAL, MEMORY, sweep
from fieldsid.fitting.sample_noise import noise_share, transfer_of
from fieldsid.fitting.series_errors import Series, coloured_covariance
from fieldsid.logs.run import FloatArray, Note
from fieldsid.models.record import Record

SETTLED_SHARE = 0.05
"""A parameter is settled while it stays within this share of its last value, or within its last two standard errors."""
LONGEST_HISTORY = 4000


def solve(problem: Problem, options: Options) -> Solution:
    """Return the last estimate of the recursion over the record, with its history; raises DataError."""
    record, slots = problem.records[0], base_slots(problem)
    if not 0.0 < options.forgetting <= 1.0:
        raise DataError(
            "the forgetting factor must be in (0, 1]", found=f"{options.forgetting:g}", hint="use `--forgetting 0.998`"
        )
    signals = measured_signals(record, options.bandwidth)
    values, spread, rows = run(record, signals, options, stiff=len(slots) == 4)
    used = np.isfinite(rows[:, -1])
    if used.sum() <= 2 * len(slots):
        raise DataError(
            f"run {record.name!r} is too short for the recursion",
            found=f"{int(used.sum())} samples after the filter has forgotten its start",
            hint="widen `--from` and `--to`, or raise lambda",
        )
    x = problem.start()
    x[list(slots.values())] = values[-1]
    small, plain = errors_of(problem, x, rows[used], signals, options)
    wider = np.sqrt(np.diag(small) / np.maximum(np.diag(plain), 1e-300))
    history = history_of(record, list(slots), values, spread * wider)
    covariance = np.zeros((problem.layout.shared, problem.layout.shared))
    covariance[np.ix_(list(slots.values()), list(slots.values()))] = small
    notes = (*bandwidth_notes([signals], options.bandwidth), *bias_notes(problem, x, rows[used], signals, options, small))
    notes = (*notes, *settle_notes(record, history))
    done = finished(problem, x, covariance, ESTIMATOR.name, notes)
    return Solution(done.x, done.covariance, done.noise, done.method, done.notes, history=history)


def run(record: Record, signals: Measured, options: Options, *, stiff: bool) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return estimates and plain standard deviations after every sample (n, p), and rows of phi and target (n, p + 1)."""
    count, size = len(record), 4 if stiff else 3
    path = record.commanded
    samples = np.zeros((count, 6))
    samples[:, 0] = record.time
    samples[1:, 1], samples[1:, 2] = path.start, path.end
    samples[:, 3], samples[:, 4], samples[:, 5] = signals.angle, signals.rate, signals.use
    settings = np.array([options.bandwidth, options.forgetting, float(signals.order), float(stiff)])
    values, spread, rows = np.zeros((count, size)), np.full((count, size), np.nan), np.full((count, size + 1), np.nan)
    sweep(np.zeros(MEMORY), np.zeros(size), np.eye(size) * INITIAL, np.zeros((2, 4)), settings, samples, values, spread, rows)
    return values, spread, rows


def errors_of(
    problem: Problem, x: FloatArray, rows: FloatArray, signals: Measured, options: Options
) -> tuple[FloatArray, FloatArray]:
    """Return the last estimate's covariance (p, p) allowing for colour, and the plain one, both with forgetting."""
    record, theta = problem.records[0], x[list(base_slots(problem).values())]
    weight = np.array(options.forgetting ** np.arange(rows.shape[0] - 1.0, -1.0, -1.0), dtype=np.float64)
    columns, residual = rows[:, :-1], rows[:, -1] - rows[:, :-1] @ theta
    inverse = np.asarray(np.linalg.pinv((columns * weight[:, None]).T @ columns, rcond=1e-13, hermitian=True), dtype=np.float64)
    h = median_step(record)
    transfer = transfer_of(signals.order, options.bandwidth, h, theta_of(problem, x, 0))
    small = coloured_covariance([Series(columns * weight[:, None], residual, transfer, h)], inverse)
    power = float(weight @ residual**2) / max(float(weight.sum()) - theta.size, 1.0)
    return small, inverse * (power * float((weight**2).sum() / weight.sum()))


def bias_notes(
    problem: Problem, x: FloatArray, rows: FloatArray, signals: Measured, options: Options, covariance: FloatArray
) -> tuple[Note, ...]:
    """Return the remark on parameters that white sensor noise biases by more than a standard error."""
    record, slots = problem.records[0], base_slots(problem)
    floor, columns = floor_of([record]), rows[:, :-1]
    share = noise_share(signals.order, options.bandwidth, median_step(record), floor.angle, floor.rate)
    keep = [0, 1, 2, 3] if len(slots) == 4 else [0, 2, 3]
    theta = x[list(slots.values())]
    push = share.gram[np.ix_(keep, keep)] @ theta - share.cross[keep]
    bias = -np.linalg.pinv(columns.T @ columns, rcond=1e-13, hermitian=True) @ push * rows.shape[0]
    error = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    worst = {n: float(b) for n, b, e in zip(slots, bias, error, strict=True) if abs(b) > e}
    if not worst:
        return ()
    which = ", ".join(f"{n} by {b:+.2g}" for n, b in worst.items())
    message = (
        f"sensor noise biases the recursion by more than its standard error: {which}; use a smaller lambda or `--method svf_ls`"
    )
    return (Note("noise_bias", message, {"bias": worst, "lambda": options.bandwidth}),)


def history_of(record: Record, names: list[str], values: FloatArray, errors: FloatArray) -> History:
    """Return the record of the recursion, thinned to a few thousand samples, with the time each parameter settled."""
    keep = np.unique(np.linspace(0, len(record) - 1, min(len(record), LONGEST_HISTORY)).round().astype(int))
    settled = {n: settle_time(record.time, values[:, j], errors[-1, j]) for j, n in enumerate(names)}
    return History(record.time[keep], tuple(names), values[keep], errors[keep], settled)


def settle_time(time: FloatArray, values: FloatArray, last_error: float) -> float:
    """Return the seconds from the start of the record after which a parameter stays near its last value."""
    band = max(SETTLED_SHARE * abs(float(values[-1])), 2.0 * last_error)
    outside = np.flatnonzero(np.abs(values - values[-1]) > band)
    first = int(outside[-1]) + 1 if outside.size else 0
    return float(time[min(first, time.size - 1)] - time[0])


def settle_notes(record: Record, history: History) -> tuple[Note, ...]:
    """Return the remark on parameters that were still moving in the last fifth of the record."""
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
