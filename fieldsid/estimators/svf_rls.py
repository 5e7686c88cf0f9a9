"""State variable filter and recursive instrumental variables with forgetting: the paper's on-board estimator, over a record.

The rows are those of the block estimate, and so are the instruments. The history has the estimate after every sample with its
standard error, and the time from which each parameter stays near its last value. The standard errors are those under a white
residual, times one factor for each parameter: the ratio of the last error with and without allowance for coloured residuals.
Source: the paper, estimator 2 (recursive).
"""

from __future__ import annotations

import numpy as np

from fieldsid.errors import DataError
from fieldsid.estimators.svf_ls import Regression, bandwidth_notes, base_slots, feedback_notes, finished, regress
from fieldsid.fitting.problem.estimator import Estimator, History, Options, Solution
from fieldsid.fitting.problem.problem import Problem
from fieldsid.fitting.regression.instruments import instrumental_variables
from fieldsid.fitting.regression.recursive_iv import recursive_iv
from fieldsid.fitting.regression.residual_colour_covariance import Series, coloured_covariance
from fieldsid.logs.run import Note
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.settled import settled_band

LONGEST_HISTORY = 4000


def solve(problem: Problem, options: Options) -> Solution:
    """Return the last estimate of the recursion over the record, with its history; raises DataError."""
    if not 0.0 < options.forgetting <= 1.0:
        raise DataError(
            "the forgetting factor must be in (0, 1]", found=f"{options.forgetting:g}", hint="use `--forgetting 0.998`"
        )
    block = regress(problem, options.bandwidth)
    series = block.series(problem, options.bandwidth)
    covariance, history = recursion(problem, block, series[0], options.forgetting)
    x = problem.start()
    x[list(base_slots(problem).values())] = history.values[-1]
    notes = (*bandwidth_notes(block.signals, options.bandwidth), *feedback_notes(problem, series))
    notes = (*notes, *settle_notes(problem.records[0], history))
    return finished(problem, x, covariance, ESTIMATOR.name, notes, history)


def recursion(problem: Problem, block: Regression, series: Series, forgetting: float) -> tuple[FloatArray, History]:
    """Return the covariance (p, p) of the last estimate and the history; the start terms are those of the block estimate."""
    names = list(base_slots(problem))
    size, count, theta = len(names), series.residual.size, block.theta
    z, phi = block.instruments[:, :size], block.rows.matrix[:, :size]
    target = phi @ theta[:size] + series.residual
    keep = np.unique(np.linspace(0, count - 1, min(count, LONGEST_HISTORY)).round().astype(np.int64))
    values, spread, _ = recursive_iv(z, np.column_stack([phi, target]), forgetting, keep)
    if not np.isfinite(values[-1]).all():
        raise DataError(
            f"the last part of run {problem.records[0].name!r}, which is not forgotten, does not determine the parameters",
            found=f"a forgetting factor of {forgetting:g}",
            hint="take a larger `--forgetting`, or a run in which the fin moves to the end",
        )
    weighted = block.instruments * forgetting ** np.arange(count - 1.0, -1.0, -1.0)[:, None]
    last = Series(weighted, target - phi @ values[-1], series.transfer, series.step)
    # the start terms were estimated from the same rows: their errors are in those of the parameters
    _, inverse = instrumental_variables(weighted, block.rows.matrix, target)
    covariance = coloured_covariance([last], inverse)[:size, :size]
    errors = spread * (np.sqrt(np.diag(covariance)) / np.maximum(spread[-1], 1e-300))
    time = block.rows.time[keep]
    settled = {n: settle_time(time, values[:, j], errors[-1, j]) for j, n in enumerate(names)}
    return covariance, History(time, tuple(names), values, errors, settled)


def settle_time(time: FloatArray, values: FloatArray, last_error: float) -> float:
    """Return the seconds from the start of the record after which a parameter stays near its last value."""
    band = settled_band(float(values[-1]), 2.0 * last_error)
    outside = np.flatnonzero(~(np.abs(values - values[-1]) <= band))
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
    says="the paper's recursion with forgetting, by instruments that the fin makes: parameters over time, as on board",
    source="the paper, state variable filter and recursive least squares; Ljung 1999, sections 7.6 and 11.4",
    solve=solve,
    takes_effects=False,
    joint=False,
)
