"""The drift law: the measured sway or heave v as a lag behind rate r and fin delta, for start values of a fit.

    T v' + v = x r + y delta at the reference speed; at f times that speed T is divided by f and y multiplied by f
v in m/s, r in rad/s, delta in rad. T, x and y are common to all runs; the initial state and a constant offset of the sensor are
estimated for each run. Only measured samples count.
Source: Fossen 2011, section 7.1 (the linear sway mode of manoeuvring).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.first_order_lag import first_order_lag, held_first_order_lag

TIME_CONSTANTS_S = np.geomspace(0.1, 20.0, 24)


@dataclass(frozen=True, slots=True)
class DriftLaw:
    """T (s), x (m) and y (m/s per rad) at the reference speed."""

    time_constant: float
    per_rate: float
    per_fin: float


def reference_speed(records: Sequence[Record]) -> float:
    """Return the mean speed of some runs in m/s, NaN if the speed of one is not known."""
    return float(np.mean([r.speed for r in records]))


def drift_law(records: Sequence[Record], reference: float) -> DriftLaw | None:
    """Return the drift law of the runs with a measured cross speed, None where no run has one; `reference` in m/s or NaN."""
    from scipy.optimize import minimize_scalar

    seen = [r for r in records if r.cross_ok.any()]
    if not seen:
        return None
    lags = np.array([TIME_CONSTANTS_S[0], *TIME_CONSTANTS_S, TIME_CONSTANTS_S[-1]])
    residuals = [_fit_at_lag(seen, reference, lag)[2] for lag in TIME_CONSTANTS_S.tolist()]
    nearest = int(np.argmin(residuals)) + 1
    best = minimize_scalar(
        lambda log_lag: _fit_at_lag(seen, reference, float(np.exp(log_lag)))[2],
        bounds=(float(np.log(lags[nearest - 1])), float(np.log(lags[nearest + 1]))),
        method="bounded",
    )
    lag = float(np.exp(best.x)) if best.fun < residuals[nearest - 1] else float(lags[nearest])
    per_rate, per_fin, _ = _fit_at_lag(seen, reference, lag)
    return DriftLaw(lag, per_rate, per_fin)


def _fit_at_lag(records: Sequence[Record], reference: float, lag: float) -> tuple[float, float, float]:
    """Return x, y and the residual sum of squares of the least-squares fit for one T = `lag`."""
    columns, values = zip(*(_projected_columns(r, reference, lag) for r in records), strict=True)
    matrix, measured = np.concatenate(columns), np.concatenate(values)
    size = np.linalg.norm(matrix, axis=0)
    scale = np.where(size > 0.0, size, 1.0)
    best = np.linalg.lstsq(matrix / scale, measured, rcond=1e-9)[0] / scale
    return float(best[0]), float(best[1]), float(np.sum((measured - matrix @ best) ** 2))


def _projected_columns(record: Record, reference: float, lag: float) -> tuple[FloatArray, FloatArray]:
    """Return a run's columns of x and y (m, 2) and its measured cross speed (m,), offset and initial state projected out."""
    f = record.speed / reference if record.speed > 0.0 and reference > 0.0 else 1.0
    time, run_lag, seen = record.time, lag / f, record.cross_ok
    rate = (
        np.interp(time, time[record.rate_ok], record.rate[record.rate_ok])
        if record.rate_ok.any()
        else np.gradient(np.interp(time, time[record.angle_ok], record.angle[record.angle_ok]), time)
    )
    if record.fin_is_held:
        fin = held_first_order_lag(record.fin[:-1], np.exp(-record.steps / run_lag), float(record.fin[0]))
    else:
        fin = first_order_lag(record.steps, record.fin, run_lag)
    shared = np.column_stack([first_order_lag(record.steps, rate, run_lag), f * fin, record.cross])[seen]
    nuisance = np.linalg.qr(np.column_stack([np.ones(time.size), np.exp(-(time - time[0]) / run_lag)])[seen])[0]
    out = shared - nuisance @ (nuisance.T @ shared)
    return out[:, :2], out[:, 2]
