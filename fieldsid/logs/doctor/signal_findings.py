"""Findings on single signals: constant, frozen, missing, coarse, with spikes, or in an impossible unit."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldsid.logs.convert.conditioning import FITTED, blocks_of
from fieldsid.logs.convert.faults.repeats import LEAST_CHANGE
from fieldsid.logs.convert.faults.spikes import DIGITS, last_digit, spikes_of
from fieldsid.logs.convert.servo_counts import servo_of
from fieldsid.logs.doctor.holes import usual_step
from fieldsid.logs.doctor.pair_findings import goes_with_way
from fieldsid.logs.doctor.stated import Stated
from fieldsid.logs.few_of import FEW
from fieldsid.logs.run import FINS, GOALS, MEASURED, MOTORS, RATE_OF, SIGNALS, Note, Run
from fieldsid.numerics.arrays import BoolArray, FloatArray

PLACE = frozenset({"x_m", "y_m"})
"""The coordinates of one sensor: neither is frozen while the other changes."""
FROZEN_S = 1.0
COARSE_LIMIT = 0.3
"""Largest share of samples equal to the one before; above it a signal is coarse, or is not examined for being frozen."""
STRAIGHT = 1e-4
"""Largest bend of a straight line, as a share of the largest bends of a signal."""

LARGEST = {
    "pitch_rad": (1.6, "deg"), "pitch_goal_rad": (1.6, "deg"),
    "roll_rad": (3.3, "deg"), "yaw_rate_rad_s": (4.0, "deg/s"), "pitch_rate_rad_s": (4.0, "deg/s"),
    "roll_rate_rad_s": (8.0, "deg/s"), "rudder_rad": (1.6, "deg"), "elevator_rad": (1.6, "deg"),
    "rudder_measured_rad": (1.6, "deg"), "elevator_measured_rad": (1.6, "deg"),
    "surge_m_s": (8.0, "kn"), "depth_m": (11000.0, "mm"),
}  # fmt: skip
"""Largest plausible magnitude of a signal, and its probable unit where it is larger."""


def signal_findings(run: Run, name: str, stated: Stated) -> list[Note]:
    """Return the findings on one signal of a run."""
    values = run[name]
    seen = np.isfinite(values)
    if not seen.any():
        return [Note("empty", f"{name} has no sample", {"signal": name})]
    present = values[seen] + 0.0  # a zero turned by a frame is -0
    found = [*_missing(name, seen), *_size(run, name, present, stated)]
    if present.size > 2 and float(np.ptp(present)) <= LEAST_CHANGE and name not in GOALS.union(MOTORS):
        message = f"{name} is constant at {present[0]:.6g} over {present.size} samples; check the sensor, or map another one"
        return [*found, Note("constant", message, {"signal": name, "value": float(present[0])})]
    if name in MEASURED and present.size > 20:
        still = np.diff(present) == 0.0
        for other in PLACE & run.signals.keys() - {name} if name in PLACE else ():
            still &= np.diff(run[other][seen]) == 0.0  # who goes due north has one east
        step, own_step = float(np.median(np.diff(run.time[seen]))), _own_step(run.time[seen], present)
        found += _frozen(run, name, run.time[seen], present, still, own_step)
        found += [*_coarse(name, present), *_spikes(name, run.time[seen], present)] if own_step == step else []
    return found


def _own_step(time: FloatArray, values: FloatArray) -> float:
    """Return the median step of a sensor in s: that of its samples (n,), or of the ends of the lines on which most of them lie.

    A sensor slower than the clock was interpolated to it. What lies between its measurements shows neither its digits nor its
    noise.
    """
    steps, bend = np.diff(values), np.abs(np.diff(values, 2))
    step, limit = float(np.median(np.diff(time))), STRAIGHT * float(np.percentile(bend, 99))
    if float(np.median(np.abs(steps))) == 0.0 or not float(np.median(bend)) < limit:
        return step
    apart = np.diff(time[1:-1][bend > limit])
    lines = apart[apart > 1.5 * step]  # a measurement between two samples of the clock bends the line at both
    return float(np.median(lines)) + step if lines.size else step


def _missing(name: str, seen: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> list[Note]:
    steps = np.diff(np.flatnonzero(seen)).astype(np.float64)
    apart = float(np.median(steps)) if steps.size else 1.0
    if name not in MEASURED and apart > 1.0 and usual_step(steps) is None:
        return []  # a command that is published when it changes
    # a sensor slower than the clock lacks samples only where its own are missing
    share = 1.0 - apart * float(seen.mean())
    if share <= FEW:
        return []
    message = f"{name}: {100 * share:.0f} % of the samples are missing (limit {100 * FEW:.0f} %)"
    return [Note("missing", message, {"signal": name, "value": share, "limit": FEW})]


def _size(run: Run, name: str, values: FloatArray, stated: Stated) -> list[Note]:
    if name not in LARGEST:
        return []
    limit, unit = LARGEST[name]
    largest = float(np.percentile(np.abs(values), 99))
    found = []
    if largest > limit and not (name == "surge_m_s" and goes_with_way(run)):
        servo = servo_of(values) if name in FINS and stated.is_si(name) else None
        advice, unit_data = stated.probable(name, unit, largest, limit)
        if servo is not None:
            advice = f"whole numbers about {servo.centre:g}, as a servo has: set `unit: counts` and `centre: {servo.centre:g}`"
            unit_data = {}
        message = f"{name} reaches {largest:.4g} {SIGNALS[name]} (limit {limit:g}): {advice}"
        found.append(Note("unit", message, {"signal": name, "value": largest, "limit": limit, **unit_data}))
    middle = float(np.median(values))
    if name == "surge_m_s" and middle < -0.1:
        message = f"surge_m_s is negative, {middle:.3g} m/s in the middle: {stated.flip(name)}, or set the frame"
        found.append(Note("speed_sign", message, {"signal": name, "value": middle, "limit": -0.1}))
    return found


def _frozen(run: Run, name: str, time: FloatArray, values: FloatArray, same: BoolArray, step: float) -> list[Note]:
    """Return the finding that a sensor repeats one value for long, by the `same` (n - 1,), among values that otherwise change.

    A vehicle that goes on evenly, as that of a simulator before its first pulse or in a settled turn, has still sensors; and what
    goes on by the last digit was steady. `step` is that of the sensor's own measurements in s.
    """
    if same.mean() > COARSE_LIMIT:
        return []
    starts, ends = blocks_of(same)
    limit = max(FROZEN_S, 5 * step)
    lengths = time[ends] - time[starts]
    long = np.flatnonzero(lengths > limit)
    if not long.size:
        return []
    goes_on = np.append(np.abs(np.diff(values)), np.inf)[ends[long]] <= DIGITS * last_digit(values)
    long = long[~goes_on]
    by_length = long[np.argsort(-lengths[long], kind="stable")].tolist()
    # once for all stretches, of which a long log may have thousands
    digits = {s: last_digit(run[s][np.isfinite(run[s])]) for s in run.signals if s in MEASURED - PLACE and run.has(s)}

    def is_even(k: int) -> bool:
        return name not in PLACE and _goes_on_evenly(run, digits, float(time[starts[k]]), float(time[ends[k]]))

    frozen = next((k for k in by_length if not is_even(k)), None)
    if frozen is None:
        return []
    start, end, value = float(time[starts[frozen]]), float(time[ends[frozen]]), values[starts[frozen]]
    before, after = (f"`--to {start:.2f}`",) if start > time[0] else (), (f"`--from {end:.2f}`",) if end < time[-1] else ()
    message = (
        f"{name} is frozen at {value:.6g} from {start:.2f} to {end:.2f} s (limit {limit:.3g} s); "
        f"leave it out: {' or '.join((*before, *after))}"
    )
    return [Note("frozen", message, {"signal": name, "value": end - start, "limit": limit})]


def _goes_on_evenly(run: Run, digits: Mapping[str, float], start: float, end: float) -> bool:
    """Return whether fins rest and measured signals go along lines from start to end (s), an angle by its rate.

    `digits` are the last digits of the signals that are looked at.
    """
    end -= min(FROZEN_S, 0.5 * (end - start))  # the answer to a fin comes later
    inside = slice(int(np.searchsorted(run.time, start)), int(np.searchsorted(run.time, end, "right")))
    if any(np.unique(fin[np.isfinite(fin)]).size > 1 for fin in (run[f][inside] for f in FINS if run.has(f))):
        return False
    slopes: dict[str, tuple[float, float]] = {}
    for name, digit in digits.items():
        seen = np.isfinite(run[name][inside])
        time, values = run.time[inside][seen], run[name][inside][seen]
        if time.size < 2:
            continue
        slope = (values[-1] - values[0]) / (time[-1] - time[0])
        if np.max(np.abs(values - values[0] - slope * (time - time[0]))) > DIGITS * digit:
            return False
        slopes[name] = float(slope) if name in RATE_OF else float(values[0]), DIGITS * digit
    pairs = ((slopes[a], slopes[r]) for a, r in RATE_OF.items() if a in slopes and r in slopes)
    return all(abs(slope - rate) * (end - start) <= off + off_rate * (end - start) for (slope, off), (rate, off_rate) in pairs)


def _coarse(name: str, values: FloatArray) -> list[Note]:
    steps = np.abs(np.diff(values))
    share = float(np.mean(steps == 0.0))
    moved = steps[steps > 0.0]
    levels = float(np.ptp(values)) / float(moved.min()) if moved.size else 0.0
    if share <= COARSE_LIMIT or levels > 1000:
        return []
    message = (
        f"{name} comes in steps of {moved.min():.3g} {SIGNALS[name]} and {100 * share:.0f} % of the samples repeat the last "
        f"one (limit {100 * COARSE_LIMIT:.0f} %); log it with more digits or at its own rate"
    )
    return [Note("coarse", message, {"signal": name, "value": share, "limit": COARSE_LIMIT, "step": float(moved.min())})]


def _spikes(name: str, time: FloatArray, values: FloatArray) -> list[Note]:
    found = spikes_of(values)
    if not found.places.size:
        return []
    worst = int(np.argmax(found.off))
    largest, limit, at = float(found.off[worst]), found.limit, float(time[found.places[worst]])
    count = int(found.places.size)
    left_out = f"; no fit uses {'it' if count == 1 else 'them'}" if name in FITTED else ""
    message = (
        f"{name} has {count} spike{'' if count == 1 else 's'}, the largest of {largest:.3g} {SIGNALS[name]} at {at:.2f} s "
        f"(limit {limit:.3g}){left_out}; check the sensor"
    )
    data = {"signal": name, "value": largest, "limit": limit, "count": count}
    return [Note("spikes", message, data)]
