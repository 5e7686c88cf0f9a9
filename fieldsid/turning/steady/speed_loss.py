"""Loss of speed and drift in a turn, identified from the measured surge and sway of the runs.

    u' = a_u (u0^2 - u^2) - k_r r^2 - k_d u^2 delta^2      (drag of hull; added resistance of the turn; drag of the fin)
In a settled turn u0^2 = u^2 (1 + (k_d/a_u) delta^2 + (k_r/a_u) (r/u)^2). Drift: v = -l_r r, so the path's speed is
hypot(u, l_r r). Source: Fossen 2011, section 7.1.3 (surge with loss term X_rr r^2); Prestero 2001, chapter 4 (axial drag).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from fieldsid.display import Brief
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import Record, knows_speed, record_of
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.block_means import block_means, block_width
from fieldsid.numerics.jit import jit
from fieldsid.numerics.ljung_box import inflation
from fieldsid.records.keys import Key, Number

RPM = "propeller_rpm"


def at_start(values: FloatArray) -> float:
    """Return the median of a signal (n,) over its first twentieth, of ten samples at least; NaN where it has none."""
    return float(np.median(values[: max(10, values.size // 20)])) if values.size else float("nan")


def thrust_ratio(record: Record) -> FloatArray:
    """Return the thrust (n,) over that at the run's start, one where it is not logged; from the rpm by its square."""
    thrust = record.signals.get("thrust")
    start = float("nan") if thrust is None else at_start(thrust)
    if thrust is None or not start > 0.0:
        return np.ones(len(record))
    ratio = np.maximum(thrust / start, 0.0)
    return np.asarray(ratio**2 if record.thrust_column == RPM else ratio)


BLOCK_S, BLOCK_SHARE = 0.2, 0.2
"""Length of a block: 0.2 s, or for a slow vehicle a fifth of the time to its largest rate; its speed changes more slowly."""
LEAST_BLOCKS = 200
"""Least number of blocks of a run, however slow the vehicle is."""
LEAST_SAMPLES = 40
LEAST_TURN_RAD_S = 0.03
TYPICAL_LOSS = 0.15
TYPICAL_LOSS_LOG_SD = 0.6
TYPICAL_DRIFT_RAD = 0.12
TYPICAL_DRIFT_LOG_SD = 0.5
"""Assumed without measurements: a loss of 15 % of the speed (95 %: 5 .. 50) and a drift angle of 7 deg (3 .. 18) in the turn.
In the ensemble of `model_error.py` the loss was 9 .. 38 % and the drift angle 2 .. 5 deg."""


@dataclass(frozen=True, slots=True, repr=False)
class SurgeModel(Brief):
    """a_u (1/m), k_r (m), k_d (1/m), l_r (m) with their covariance (4, 4); what was measured; the fit's scatter m/s."""

    drag: Annotated[float, Key("a_u.", "drag_per_m")]
    turn_loss: Annotated[float, Key("k_r.", "turn_loss_m")]
    fin_loss: Annotated[float, Key("k_d.", "fin_loss_per_m")]
    drift_per_rate: Annotated[float, Key("l_r.", "drift_per_rate_m")]
    covariance: FloatArray
    surge_measured: Annotated[bool, Key("Whether surge was measured.")]
    sway_measured: Annotated[bool, Key("Whether sway was measured.")]
    surge_rms: Annotated[Number, Key("Root mean square of what the fit to the surge leaves.", "rms_m_s")] = float("nan")


@dataclass(frozen=True, slots=True)
class SpeedLoss:
    """Draws (d, 1): turn loss k_r/a_u (m^2), fin loss k_d/a_u, drift per rate l_r (m), and drag a_u (1/m)."""

    turn: FloatArray
    fin: FloatArray
    drift_per_rate: FloatArray
    drag: FloatArray

    def factor(self, fin: FloatArray, rate_per_speed: FloatArray) -> FloatArray:
        """Return u0/u for a fin (d, 1) rad and r/u (d, s) 1/m."""
        return np.asarray(np.sqrt(1.0 + self.fin * fin**2 + self.turn * rate_per_speed**2))

    def one(self, index: int = 0) -> SpeedLoss:
        """Return a single draw."""
        keep = slice(index, index + 1)
        return SpeedLoss(self.turn[keep], self.fin[keep], self.drift_per_rate[keep], self.drag[keep])


def no_speed_loss(count: int) -> SpeedLoss:
    """Return draws (count, 1) without loss of speed and drift, for the formulas."""
    zero = np.zeros((count, 1))
    return SpeedLoss(zero, zero, zero, np.full((count, 1), 0.1))


def draw_speed_loss(model: SurgeModel | None, typical_curvature: float, count: int, rng: np.random.Generator) -> SpeedLoss:
    """Return draws of the loss of speed and the drift, the first the estimate; typical values where they were not measured.

    `typical_curvature` (1/m) is that of the turn in question: it converts the typical loss of speed to a coefficient.
    """
    z = rng.standard_normal((count, 4))
    z[0] = 0.0
    kr2 = typical_curvature**2
    loss = np.clip(TYPICAL_LOSS * np.exp(TYPICAL_LOSS_LOG_SD * z[:, 0]), 0.0, 0.6)
    turn = (1.0 / (1.0 - loss) ** 2 - 1.0) / kr2
    fin = np.zeros(count)
    drag = np.full(count, 0.1)
    drift = np.tan(np.clip(TYPICAL_DRIFT_RAD * np.exp(TYPICAL_DRIFT_LOG_SD * z[:, 3]), 0.0, 0.6)) / typical_curvature
    if model is not None and model.surge_measured:
        spread = z[:, :3] @ _root(model.covariance[:3, :3]).T
        drag = np.maximum(model.drag + spread[:, 0], 0.2 * model.drag)
        turn = np.maximum(model.turn_loss + spread[:, 1], 0.0) / drag
        fin = np.maximum(model.fin_loss + spread[:, 2], 0.0) / drag
    if model is not None and model.sway_measured:
        drift = model.drift_per_rate + z[:, 3] * np.sqrt(model.covariance[3, 3])
    return SpeedLoss(turn[:, None], fin[:, None], drift[:, None], drag[:, None])


def _root(covariance: FloatArray) -> FloatArray:
    """Return the lower triangular root (n, n) of a covariance, also of one that is indefinite by rounding."""
    diagonal = np.diag(covariance)
    scale = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))  # the variance of a coefficient that is known exactly is zero
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T) / np.outer(scale, scale))
    upper = np.asarray(np.linalg.qr((vectors * np.sqrt(np.maximum(values, 0.0))).T, mode="r"))
    return np.asarray(scale[:, None] * (upper * np.where(np.diag(upper) < 0.0, -1.0, 1.0)[:, None]).T)


def fit_surge(runs: Sequence[Run]) -> SurgeModel | None:
    """Fit the loss of speed and the drift jointly to all runs with measured surge or sway and a yaw rate; None without any.

    Runs whose yaw rate stays below LEAST_TURN_RAD_S are left out.
    """
    cases = [c for c in (_case(run) for run in runs) if c is not None]
    if not cases:
        return None
    with_surge = [c for c in cases if np.isfinite(c.surge).all()]
    with_sway = [c for c in cases if np.isfinite(c.sway).all()]
    covariance = np.zeros((4, 4))
    drag, turn, fin, rms = 0.1, 0.0, 0.0, float("nan")
    if with_surge:
        (drag, turn, fin), covariance[:3, :3], rms = _fit_loss(with_surge)
    drift, drift_variance = _fit_drift(with_sway) if with_sway else (0.0, 0.0)
    covariance[3, 3] = drift_variance
    if not with_surge and not with_sway:
        return None
    return SurgeModel(drag, turn, fin, drift, covariance, bool(with_surge), bool(with_sway), rms)


@dataclass(frozen=True, slots=True)
class _Case:
    """One run in block means: time, surge, sway, rate, fin, thrust ratio, (n,) each; NaN where not measured."""

    time: FloatArray
    surge: FloatArray
    sway: FloatArray
    rate: FloatArray
    fin: FloatArray
    thrust: FloatArray


def _case(run: Run) -> _Case | None:
    if not (run.has("yaw_rate_rad_s") or run.has("yaw_rad")) or not (run.has("rudder_rad") or run.has("rudder_measured_rad")):
        return None
    # the raw surge is used below: the smoothing in a record takes longer than all else here
    record = record_of(replace(run, signals={n: v for n, v in run.signals.items() if n != "surge_m_s"}), Axis.YAW)
    angle_only = not record.rate_ok.any()
    rate = (
        np.gradient(record.angle, record.time)
        if angle_only
        else np.interp(record.time, record.time[record.rate_ok], record.rate[record.rate_ok])
    )
    width = block_width(record.steps, max(BLOCK_S, BLOCK_SHARE * _time_of_change(record.time, rate)))
    none = np.full(len(record), np.nan)
    surge = _filled(run, "surge_m_s", none) if knows_speed(run) else none
    columns = (record.time, surge, _filled(run, "sway_m_s", none), rate, record.fin, thrust_ratio(record))
    blocks = [block_means(c, width) for c in columns]
    if blocks[0].size < LEAST_SAMPLES or float(np.max(np.abs(blocks[3]))) < LEAST_TURN_RAD_S:
        return None
    return _Case(*blocks)


def _time_of_change(time: FloatArray, rate: FloatArray) -> float:
    """Return the largest rate over its largest derivative, in s, from block means; at most such that LEAST_BLOCKS remain."""
    width = block_width(np.diff(time), BLOCK_S)
    blocks, at = block_means(rate, width), block_means(time, width)
    if blocks.size < LEAST_SAMPLES:
        return 0.0
    change = float(np.max(np.abs(np.gradient(blocks, at))))
    longest = float(time[-1] - time[0]) / LEAST_BLOCKS / BLOCK_SHARE
    return min(float(np.max(np.abs(blocks))) / change, longest) if change > 0.0 else 0.0


def _filled(run: Run, name: str, none: FloatArray) -> FloatArray:
    if not run.has(name):
        return none
    values = run[name]
    ok = np.isfinite(values)
    return np.interp(run.time, run.time[ok], values[ok])


@jit
def simulated(steps: FloatArray, push: FloatArray, drag: FloatArray, loss: FloatArray, first: float) -> FloatArray:
    """Return the surge (n,) of u' = push - drag u^2 - loss by Heun's method; steps (n-1,) s, push, drag and loss (n,)."""
    u = np.empty(push.size)
    u[0] = first
    for i in range(steps.size):
        now, h = u[i], steps[i]
        slope = push[i] - drag[i] * now * now - loss[i]
        ahead = now + h * slope
        after = push[i + 1] - drag[i + 1] * ahead * ahead - loss[i + 1]
        u[i + 1] = min(max(now + 0.5 * h * (slope + after), 0.01), 50.0)
    return u


def _surge(case: _Case, drag: float, turn: float, fin: float, straight: float, first: float) -> FloatArray:
    push = drag * straight**2 * case.thrust
    return simulated(np.diff(case.time), push, drag + fin * case.fin**2, turn * case.rate**2, first)


def _fit_loss(cases: Sequence[_Case]) -> tuple[tuple[float, float, float], FloatArray, float]:
    from scipy.optimize import least_squares

    firsts = [float(np.median(c.surge[:10])) for c in cases]

    def residual(p: FloatArray) -> FloatArray:
        return np.concatenate([c.surge - _surge(c, *p[:3], *p[3 + 2 * i : 5 + 2 * i]) for i, c in enumerate(cases)])

    start = np.array([0.1, 0.2, 0.05, *[s for first in firsts for s in (first, first)]])
    low = np.array([1e-3, 0.0, 0.0] + [1e-3] * (2 * len(cases)))
    high = np.array([5.0, 50.0, 20.0] + [50.0] * (2 * len(cases)))
    fit = least_squares(residual, start, bounds=(low, high), x_scale=np.maximum(start, 0.05))
    jac = np.asarray(fit.jac, dtype=np.float64)
    variance = float(np.sum(fit.fun**2)) / max(fit.fun.size - start.size, 1)
    covariance = np.linalg.pinv(jac.T @ jac)[:3, :3] * variance * inflation([fit.fun - np.mean(fit.fun)])
    return (float(fit.x[0]), float(fit.x[1]), float(fit.x[2])), np.asarray(covariance), float(np.sqrt(variance))


def _fit_drift(cases: Sequence[_Case]) -> tuple[float, float]:
    """Return l_r of v = -l_r r + v_0 and its variance, with a separate v_0 for each run."""
    rate = np.concatenate([c.rate - c.rate.mean() for c in cases])
    sway = np.concatenate([c.sway - c.sway.mean() for c in cases])
    power = float(rate @ rate)
    slope = -float(rate @ sway) / power
    residual = sway + slope * rate
    return slope, float(np.mean(residual**2)) / power * inflation([residual - residual.mean()])
