"""A run as the maneuvering model uses it: fin, thrust and the measured motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.dynamics.assemble import fin_path
from fieldsid.dynamics.free_run import effects_of
from fieldsid.logs.doctor.pair_findings import SLOWEST
from fieldsid.logs.run import Run
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.model import Model
from fieldsid.models.record import Record, knows_speed, record_of
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.block_means import block_means
from fieldsid.numerics.ljung_box import inflation
from fieldsid.turning.measured.measured_turn import LEAST_TURN_RAD_S
from fieldsid.turning.steady.speed_loss import LEAST_SAMPLES, RPM, at_start, thrust_ratio

OWN_EFFECTS = frozenset({"servo_lag", "rate_limit"})
"""Actuator effects that are part of the maneuvering model."""
UNKNOWN_BIAS_RAD_S = 0.002
"""Standard deviation of a gyro bias that no heading shows."""
LEAST_BIAS_SD_RAD_S = 1e-5
DISCREPANCY = 0.03
"""Model error of the equations, as a share of the motion."""
DISCREPANCY_LENGTH_M = 2.0
STATE_SD = 0.3
"""Standard deviation of a straight speed (m/s) and of a segment's initial state (m/s, rad/s) about the measured ones."""
SPEED_OF_RPM_SHARE = 0.03
"""Relative error of a speed from the rpm: the slip on a straight course hardly depends on speed (Fossen 2011, section 9.4)."""
SURGE, SWAY, RATE, HEADING = range(4)


@dataclass(frozen=True, slots=True)
class FlownRun:
    """One run: time (n,) s, fin (n-1, 2) rad ahead of the servo, thrust (n,) over that of the straight run.

    `measured` (4, n) are surge, sway, rate and heading, NaN where not measured; heading only if the rate was not measured. The
    rate is corrected for its bias against the heading, which has the standard deviation `rate_bias_sd` (rad/s). `speed` (m/s),
    with the standard deviation `speed_sd`, is that of the straight part: measured, or from the rpm of the propeller.
    `discrepancy` (4,) is the standard deviation of the model error.
    """

    name: str
    time: FloatArray
    fin: FloatArray
    thrust: FloatArray
    measured: FloatArray
    rate_bias_sd: float
    discrepancy: FloatArray
    speed: float
    speed_sd: float

    @property
    def rate(self) -> FloatArray:
        """The yaw rate (n,) rad/s: that measured, else the heading's slope."""
        rate = self.measured[RATE]
        return rate if np.isfinite(rate).any() else np.asarray(np.gradient(self.measured[HEADING], self.time))

    @property
    def turns(self) -> bool:
        """Whether its yaw rate exceeds LEAST_TURN_RAD_S for 2 % of the time."""
        return float(np.nanpercentile(np.abs(self.rate), 98)) > LEAST_TURN_RAD_S

    def begins(self, segment_s: float) -> npt.NDArray[np.int64]:
        """Return the samples (m,) at which segments of about `segment_s` begin."""
        count = max(1, round(float(self.time[-1] - self.time[0]) / segment_s))
        return np.unique(np.searchsorted(self.time, np.linspace(self.time[0], self.time[-1], count + 1)[:-1]))


def flown_run(run: Run, model: Model | None, speed_per_rpm: float | None = None) -> FlownRun | None:
    """Return a run for the maneuvering model, None where it lacks fin, yaw or speed; the fin passes the model's actuator effects.

    Without a measured speed the straight speed comes from the propeller's rpm, where `speed_per_rpm` (m/s per 1/min) is known;
    the surge is then a state without measurement.
    """
    steered = run.has("rudder_rad") or run.has("rudder_measured_rad")
    if not steered or not (run.has("yaw_rate_rad_s") or run.has("yaw_rad")):
        return None
    surge = run["surge_m_s"] if knows_speed(run) else np.full(len(run), np.nan)
    speed, speed_sd = float(np.nanpercentile(surge, 90)) if knows_speed(run) else float("nan"), STATE_SD
    if not np.isfinite(speed) and speed_per_rpm is not None and run.has(RPM):
        speed = speed_per_rpm * _rpm_at_start(run)
        speed_sd = SPEED_OF_RPM_SHARE * speed
    if not speed > 0.0:
        return None
    record = record_of(run, Axis.YAW)
    if len(record) < LEAST_SAMPLES:
        return None
    path = record.commanded
    if model is not None and not record.fin_is_measured:
        acting = [e for e in effects_of(model) if e.fin is not None and e.name not in OWN_EFFECTS]
        path = fin_path(record, acting, {c.name: c.start for e in acting for c in e.nuisance} | dict(model.values))
    none = np.full(len(record), np.nan)
    rate = np.where(record.rate_ok, record.rate, np.nan)
    has_rate = bool(record.rate_ok.any())
    heading = none if has_rate else np.where(record.angle_ok, record.angle - record.angle[record.angle_ok][0], np.nan)
    bias, bias_sd = _rate_bias(record)
    rate = rate - bias
    sway = run["sway_m_s"] if run.has("sway_m_s") else none
    measured = np.stack([surge, sway, rate if has_rate else none, heading])
    fin = np.stack([path.start, path.end], axis=1)
    if model is not None and model.base[NAMES[model.axis].authority] > 0.0:
        fin = -fin  # a positive rudder of the equations turns to port
    discrepancy = _discrepancy(record.time, measured, speed)
    return FlownRun(run.name, record.time, fin, thrust_ratio(record), measured, bias_sd, discrepancy, speed, speed_sd)


def speed_per_rpm(runs: Sequence[Run]) -> float | None:
    """Return the straight speed per rpm of the propeller (m/s per 1/min) from the runs that have both; None without any."""
    both = [r for r in runs if knows_speed(r) and r.has(RPM)]
    ratios = [float(np.nanpercentile(r["surge_m_s"], 90)) / rpm for r in both if (rpm := _rpm_at_start(r)) > 0.0]
    return float(np.median(ratios)) if ratios else None


def _rpm_at_start(run: Run) -> float:
    return at_start(run[RPM][np.isfinite(run[RPM])])


def _discrepancy(time: FloatArray, measured: FloatArray, speed: float) -> FloatArray:
    """Return the standard deviation (4,) per sample of the model error, a share of the run's motion.

    The error is correlated over the time in which the hull travels a few metres; as white noise it is larger by the root of the
    number of samples in that time.
    """
    step = float(np.median(np.diff(time)))
    width = max(1, round(1.0 / step))
    straight = np.array([speed, 0.0, 0.0, 0.0])
    out = np.zeros(4)
    for i in range(4):
        values = measured[i][np.isfinite(measured[i])] - straight[i]
        if values.size >= width:
            means = block_means(values, width)
            out[i] = np.sqrt(np.mean((means - (means.mean() if i == HEADING else 0.0)) ** 2))
    return np.asarray(DISCREPANCY * out * np.sqrt(max(2.0 * DISCREPANCY_LENGTH_M / speed / step, 1.0)))


def _rate_bias(record: Record) -> tuple[float, float]:
    """Return the bias of the rate gyro and its standard deviation, rad/s: the slope of integrated rate less heading over time."""
    if not (record.rate_ok.any() and record.angle_ok.sum() > LEAST_SAMPLES):
        return 0.0, UNKNOWN_BIAS_RAD_S
    rate = np.interp(record.time, record.time[record.rate_ok], record.rate[record.rate_ok])
    turned = np.concatenate([[0.0], np.cumsum(0.5 * record.steps * (rate[1:] + rate[:-1]))])
    time, between = (record.time - record.time.mean())[record.angle_ok], (turned - record.angle)[record.angle_ok]
    power = float(time @ time)
    slope = float(time @ between) / power
    residual = between - between.mean() - slope * time
    sd = float(np.sqrt(np.mean(residual**2) / power * inflation([residual])))
    return slope, min(max(sd, LEAST_BIAS_SD_RAD_S), UNKNOWN_BIAS_RAD_S)


def nearest_model(models: Sequence[Model], speed: float) -> Model:
    """Return the model whose reference speed is nearest to a speed in m/s."""
    return min(models, key=lambda m: abs(np.log(m.law.reference / speed)) if m.law.reference > 0 else np.inf)


def usable_runs(runs: Sequence[Run], models: Sequence[Model]) -> tuple[FlownRun, ...]:
    """Return the runs that can be used, empty if none of them turns; the fin passes the actuator effects of the nearest model.

    The nearest model is that of the nearest speed, the first one for a run without a speed.
    """
    found = []
    of_rpm = speed_per_rpm(runs)
    for run in runs:
        near = models[0] if models else None
        if models and knows_speed(run):
            near = nearest_model(models, max(float(np.nanmedian(run["surge_m_s"])), SLOWEST))
        flown = flown_run(run, near, of_rpm)
        if flown is not None:
            found.append(flown)
    return tuple(found) if any(f.turns for f in found) else ()
