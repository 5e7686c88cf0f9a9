"""What the maneuvering model takes of a run: fin, thrust and the motion that was measured, cut into segments."""

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
from fieldsid.turning.steady.speed_loss import LEAST_SAMPLES, RPM, at_start, thrust_ratio

OWN_EFFECTS = frozenset({"servo_lag", "rate_limit"})
"""Effects of the actuator that the maneuvering model has itself."""
LEAST_TURN_RAD_S = 0.005
UNKNOWN_BIAS_RAD_S = 0.002
"""What a gyro may be off by, where no heading shows it."""
LEAST_BIAS_SD_RAD_S = 1e-5
DISCREPANCY = 0.03
"""Share of the motion that the equations themselves are off by."""
DISCREPANCY_LENGTH_M = 2.0
STATE_SD = 0.3
"""Of a straight speed, and of a segment's first state, about that measured: m/s, and rad/s."""
SPEED_OF_RPM_SHARE = 0.03
"""A propeller's slip on a straight course is alike at every speed to within a few hundredths (Fossen 2011, section 9.4)."""
SURGE, SWAY, RATE, HEADING = range(4)


@dataclass(frozen=True, slots=True)
class FlownRun:
    """One run: time (n,) s, fin (n-1, 2) rad before the servo's lag, thrust (n,) over the straight run's.

    `measured` (4, n) surge, sway, rate and heading, NaN where not measured; heading only where there is no rate. The rate is
    free of the bias that the heading shows, to within `rate_bias_sd` rad/s. `speed` is that of its straight part, m/s, known to
    `speed_sd`: measured, or that of the propeller's turns.
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
        """Whether it turns at all."""
        return float(np.nanpercentile(np.abs(self.rate), 98)) > LEAST_TURN_RAD_S

    def begins(self, segment_s: float) -> npt.NDArray[np.int64]:
        """Return the samples (m,) at which segments of about `segment_s` begin."""
        count = max(1, round(float(self.time[-1] - self.time[0]) / segment_s))
        return np.unique(np.searchsorted(self.time, np.linspace(self.time[0], self.time[-1], count + 1)[:-1]))


def flown_run(run: Run, model: Model | None, speed_per_rpm: float | None = None) -> FlownRun | None:
    """Return what a run says of a maneuver, None where it lacks fin, yaw or speed; a model's actuator effects shape the fin.

    A run without a speed has that of its propeller's turns on a straight course, where `speed_per_rpm` (m/s per 1/min) is known:
    the surge in its turns is then a state that nothing measures.
    """
    steered = run.has("rudder_rad") or run.has("rudder_measured_rad")
    if not steered or not (run.has("yaw_rate_rad_s") or run.has("yaw_rad")):
        return None
    surge = run["surge_m_s"] if knows_speed(run) else np.full(len(run), np.nan)
    speed, speed_sd = float(np.nanpercentile(surge, 90)) if knows_speed(run) else float("nan"), STATE_SD
    if not np.isfinite(speed) and speed_per_rpm is not None and run.has(RPM):
        speed = speed_per_rpm * _turns_at_start(run)
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
        fin = -fin  # the equations' rudder turns to port
    off = _discrepancy(record.time, measured, speed)
    return FlownRun(run.name, record.time, fin, thrust_ratio(record), measured, bias_sd, off, speed, speed_sd)


def speed_per_rpm(runs: Sequence[Run]) -> float | None:
    """Return the straight speed (m/s) for each turn of the propeller in a minute, by runs that have both; None where none has."""
    both = [r for r in runs if knows_speed(r) and r.has(RPM)]
    known = [float(np.nanpercentile(r["surge_m_s"], 90)) / turns for r in both if (turns := _turns_at_start(r)) > 0.0]
    return float(np.median(known)) if known else None


def _turns_at_start(run: Run) -> float:
    return at_start(run[RPM][np.isfinite(run[RPM])])


def _discrepancy(time: FloatArray, measured: FloatArray, speed: float) -> FloatArray:
    """Standard deviation (4,) that the model's own error counts as in every sample: a share of what the run shows.

    It stays alike for the time that the hull takes over a few metres, and so counts as the more in single samples.
    """
    step = float(np.median(np.diff(time)))
    width = max(1, round(1.0 / step))
    straight = np.array([speed, 0.0, 0.0, 0.0])
    out = np.zeros(4)
    for i in range(4):
        values = measured[i][np.isfinite(measured[i])] - straight[i]
        if values.size >= width:
            whole = block_means(values, width)
            out[i] = np.sqrt(np.mean((whole - (whole.mean() if i == HEADING else 0.0)) ** 2))
    return np.asarray(DISCREPANCY * out * np.sqrt(max(2.0 * DISCREPANCY_LENGTH_M / speed / step, 1.0)))


def _rate_bias(record: Record) -> tuple[float, float]:
    """Return the bias of the rate gyro against the heading and its standard deviation, rad/s: the slope of what is between."""
    if not (record.rate_ok.any() and record.angle_ok.sum() > LEAST_SAMPLES):
        return 0.0, UNKNOWN_BIAS_RAD_S
    rate = np.interp(record.time, record.time[record.rate_ok], record.rate[record.rate_ok])
    turned = np.concatenate([[0.0], np.cumsum(0.5 * record.steps * (rate[1:] + rate[:-1]))])
    time, between = (record.time - record.time.mean())[record.angle_ok], (turned - record.angle)[record.angle_ok]
    power = float(time @ time)
    slope = float(time @ between) / power
    left = between - between.mean() - slope * time
    sd = float(np.sqrt(np.mean(left**2) / power * inflation([left])))
    return slope, min(max(sd, LEAST_BIAS_SD_RAD_S), UNKNOWN_BIAS_RAD_S)


def nearest_model(models: Sequence[Model], speed: float) -> Model:
    """Return the model whose own speed is nearest to a speed in m/s."""
    return min(models, key=lambda m: abs(np.log(m.law.reference / speed)) if m.law.reference > 0 else np.inf)


def usable_runs(runs: Sequence[Run], models: Sequence[Model]) -> tuple[FlownRun, ...]:
    """Return what runs say; the fin is shaped by the model of the nearest speed, the first where a run has none."""
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
