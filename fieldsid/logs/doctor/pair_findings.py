"""Findings on signals that must agree: an angle and its rate, a speed and the way made, a command and its fin.

The change of an angle over a second is set against the rate integrated over the same second: their slope is 1. A
slope below zero is a sign flip, one near 57.3 or 1/57.3 a degree taken for a radian, a shift a clock offset.
"""

from __future__ import annotations

import math

import numpy as np

from fieldsid.logs.convert.units import KNOT
from fieldsid.logs.doctor.spikes import DIGITS, last_digit
from fieldsid.logs.doctor.stated import Stated
from fieldsid.logs.run import Note, Run
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.shifted_correlation import shifted_correlations
from fieldsid.numerics.trapezoid import trapezoid_integral
from fieldsid.numerics.white_noise import MEDIAN_OF_NORMAL, robust_white_noise_std

PAIR_WINDOW_S, LONG_WINDOW_S = 1.0, 4.0
"""Time over which an angle's change is set against its rate's, and that for a motion which shows above its noise only then."""
TRUSTED = 0.8
"""Correlation from which a slope is taken as real."""
STRONG, WEAK = 0.9, 0.5
"""Correlations with the other axis's rate and with its own that make an angle look swapped."""
MIN_NOISE_RATIO = 4.0
"""How many times its noise a change must be to be judged."""
SLOPE_LIMIT = 0.15
JUMP_SPREADS, FASTER, FEWEST_JUMPS = 8.0, 1.5, 2
"""Standard deviations, and times a step at the rate of a fast tenth of the log, by which an angle and its rate may differ."""
JUMP_WIDTHS = (1, 2, 4)
"""Steps over which they are compared."""
FITS_BETTER = 2.5
"""Ratio of two variances of the same steps, 50 at least, that chance does not make: 2.4 is the one per mille of F(50, 50)."""
ROUNDING = 1e-12
"""Circular variance below which there is none."""
DEGREES = 180.0 / math.pi
LAG_S = 1.0
"""Longest clock offset looked for."""

_PAIRS = (("yaw_rad", "yaw_rate_rad_s"), ("pitch_rad", "pitch_rate_rad_s"), ("roll_rad", "roll_rate_rad_s"))
_FINS = (("rudder_rad", "rudder_measured_rad"), ("elevator_rad", "elevator_measured_rad"))


def pair_findings(run: Run, stated: Stated) -> list[Note]:
    """Return the findings on pairs of signals of a run."""
    found: list[Note] = []
    for angle, rate in _PAIRS:
        if run.has(angle) and run.has(rate):
            found += _angle_and_rate(run, angle, rate, stated)
            found += _jumps(run, angle, rate)
    found += _swapped(run)
    if all(run.has(s) for s in ("surge_m_s", "x_m", "y_m")):
        found += _speed_and_way(run, stated)
    for command, fin in _FINS:
        if run.has(command) and run.has(fin):
            found += _command_and_fin(run, command, fin, stated)
    return found


def _angle_and_rate(run: Run, angle: str, rate: str, stated: Stated) -> list[Note]:
    in_degrees = _turned_in_degrees(run, angle, rate, stated) if angle == "yaw_rad" else []
    changes = _changes(run, angle, rate)
    if changes is None or in_degrees:
        return in_degrees
    a, b, step = changes
    slope, trust = _slope(a, b)
    if trust < TRUSTED:
        return []
    return [*_of_slope(angle, rate, slope, stated), *_of_lag(angle, rate, a, b, step, stated)]


def _turned_in_degrees(run: Run, angle: str, rate: str, stated: Stated) -> list[Note]:
    """A heading in degrees that was unwrapped as rad: whole turns are lost, but on the circle it goes with 57.3 of its rate.

    The circular variances 1 - |mean exp(i (step - k turn))| of k = 1 and k = 57.3 are compared (Mardia and Jupp 2000, 2.3.1).
    """
    both = np.isfinite(run[angle]) & np.isfinite(run[rate])
    if both.sum() < 50:
        return []
    made, turned = np.diff(run[angle][both]), np.diff(trapezoid_integral(run.time[both], run[rate][both]))
    as_rad, as_deg = (max(1.0 - abs(complex(np.mean(np.exp(1j * (made - k * turned))))), ROUNDING) for k in (1.0, DEGREES))
    if not as_deg < as_rad / FITS_BETTER:
        return []
    advice, unit = _in_degrees(angle, "deg", rate, stated)
    message = (
        f"{angle} goes with {rate} as degrees, not as rad (circular variances of the steps {as_deg:.3g} and {as_rad:.3g}, limit "
        f"{FITS_BETTER:g} times): {advice}"
    )
    return [Note("unit", message, {"signal": angle, "value": as_rad / as_deg, "limit": FITS_BETTER, **unit})]


def _jumps(run: Run, angle: str, rate: str) -> list[Note]:
    """Changes of an angle that its rate does not make, or rates that the angle does not follow, beyond the noise of both.

    A rate that is wrong for a few samples moves the angle's noise out of no single step, so that changes over a few are taken.
    """
    both = np.isfinite(run[angle]) & np.isfinite(run[rate])
    if both.sum() < 50:
        return []
    time, turned, swept = run.time[both], run[angle][both], trapezoid_integral(run.time[both], run[rate][both])
    fastest = FASTER * float(np.percentile(np.abs(run[rate][both]), 90))
    found = [f for width in JUMP_WIDTHS if (f := _off_over(width, time, turned, swept, fastest)) is not None]
    if not found:
        return []
    count, size, limit, at = max(found, key=lambda f: f[1] / f[2])
    message = (
        f"{angle} and {rate} disagree at {count} places of {time.size} samples, by up to {size:.3g} rad at {at:.2f} s (limit "
        f"{limit:.3g} rad, {JUMP_SPREADS:g} standard deviations): one of them jumps where the other does not"
    )
    return [Note("disagree", message, {"signal": angle, "value": size, "limit": limit, "count": count})]


def _off_over(
    width: int, time: FloatArray, turned: FloatArray, swept: FloatArray, fastest: float
) -> tuple[int, float, float, float] | None:
    """Return at how many places an angle is off its rate over some steps, by how much, the limit and when; None where at few.

    `fastest` is the rate by which they may be a step apart.
    """
    off = (turned[width:] - turned[:-width]) - (swept[width:] - swept[:-width])
    off = np.abs(off - np.median(off))
    usual = float(np.median(off)) / MEDIAN_OF_NORMAL
    limit = max(JUMP_SPREADS * usual, DIGITS * last_digit(turned))
    odd = np.flatnonzero(off > np.maximum(limit, fastest * np.diff(time)[width - 1 :]))
    places = 1 + int(np.count_nonzero(np.diff(odd) > width)) if odd.size else 0
    if places < FEWEST_JUMPS or usual == 0.0:
        return None
    at = int(np.argmax(off))
    return places, float(off[at]), limit, float(time[at])


def _changes(run: Run, angle: str, rate: str) -> tuple[FloatArray, FloatArray, float] | None:
    """Return the changes of an angle and of an integrated rate over the window (n,), and the step.

    None when the log is too short, or neither moves clearly more than its noise.
    """
    both = np.isfinite(run[angle]) & np.isfinite(run[rate])
    if both.sum() < 50:
        return None
    time, turned, swept = run.time[both], run[angle][both], trapezoid_integral(run.time[both], run[rate][both])
    step = float(np.median(np.diff(time)))
    floor = MIN_NOISE_RATIO * math.sqrt(2.0) * robust_white_noise_std(np.diff(turned, 2), 2)
    noise = robust_white_noise_std(np.diff(run[rate][both], 2), 2)
    for window_s in (PAIR_WINDOW_S, LONG_WINDOW_S):
        width = max(1, round(window_s / step))
        if time.size <= 3 * width:
            return None
        a, b = turned[width:] - turned[:-width], swept[width:] - swept[:-width]
        if float(np.std(a)) > floor and float(np.std(b)) > MIN_NOISE_RATIO * noise * math.sqrt(window_s * step):
            return a, b, step
    return None


def _swapped(run: Run) -> list[Note]:
    """An angle that follows the other axis's rate, and not its own."""
    found = []
    for (angle, own), (_, other) in ((_PAIRS[0], _PAIRS[1]), (_PAIRS[1], _PAIRS[0])):
        if not all(run.has(s) for s in (angle, own, other)):
            continue
        trust = {rate: _slope(c[0], c[1])[1] for rate in (own, other) if (c := _changes(run, angle, rate)) is not None}
        if trust.get(other, 0.0) > STRONG and trust.get(own, 0.0) < WEAK:
            mine = trust.get(own, 0.0)
            message = f"{angle} follows {other} (correlation {trust[other]:.2f}), not {own} ({mine:.2f}): two columns are swapped"
            found.append(Note("swapped", message, {"signal": angle, "value": trust.get(own, 0.0), "limit": WEAK}))
    return found


def _slope(a: FloatArray, b: FloatArray) -> tuple[float, float]:
    """Return the slope of a on b and the size of their correlation; zeros when one of them does not move."""
    a, b = _centred(a), _centred(b)
    power = math.sqrt(float(a @ a) * float(b @ b))
    if power == 0.0:
        return 0.0, 0.0
    correlation = float(a @ b) / power
    # The geometric mean of both regressions, so that noise in either signal does not pull the slope one way.
    return math.copysign(math.sqrt(float(a @ a) / float(b @ b)), correlation), abs(correlation)


def _of_slope(angle: str, rate: str, slope: float, stated: Stated) -> list[Note]:
    data = {"signal": rate, "value": slope, "limit": 1.0}
    found = []
    if slope < 0.0:
        message = f"{rate} runs against {angle} (slope {slope:.3g}, should be 1): {stated.flip(angle, rate)}, or set the frame"
        found.append(Note("rate_sign", message, data))
    size = abs(slope)
    if 0.7 < size / DEGREES < 1.4:
        advice, unit = _in_degrees(angle, "deg", rate, stated)
        found.append(
            Note("unit", f"{angle} changes {size:.3g} times as fast as {rate} says: {advice}", {**data, "signal": angle, **unit})
        )
    elif 0.7 < size * DEGREES < 1.4:
        advice, unit = _in_degrees(rate, "deg/s", angle, stated)
        found.append(Note("unit", f"{rate} is {1 / size:.3g} times the change of {angle}: {advice}", {**data, **unit}))
    elif abs(size - 1.0) > SLOPE_LIMIT:
        message = f"{angle} changes {size:.3g} times as fast as {rate} says (limit 1 +/- {SLOPE_LIMIT:g}): check both scales"
        found.append(Note("rate_scale", message, {**data, "limit": SLOPE_LIMIT}))
    return found


def _in_degrees(large: str, unit: str, small: str, stated: Stated) -> tuple[str, dict[str, str]]:
    """Return what to do about a signal that is larger than another by the degrees of a radian, and the unit to set if any."""
    wrong = [] if stated.is_si(small) else [f"{small} is not in `{stated.units[small]}`"]
    if not stated.is_si(large):
        return " or ".join(wrong) or f"taken as `{stated.units[large]}` already: check which ones they are", {}
    said = " or ".join([f"{large} is probably in {unit}: set `unit: {unit}`", *wrong])
    return said, {} if wrong else {"unit": unit}


def _of_lag(angle: str, rate: str, a: FloatArray, b: FloatArray, step: float, stated: Stated) -> list[Note]:
    lag, gain = _lag(a, b, step)
    limit = max(1.5 * step, 0.05)
    if abs(lag) <= limit or gain < 0.002:
        return []
    message = (
        f"{angle} is {lag:+.3f} s late against {rate} (limit {limit:.3g} s): their clocks differ{stated.stamps(angle, rate)}"
    )
    return [Note("clock_offset", message, {"signal": angle, "value": lag, "limit": limit})]


def _lag(a: FloatArray, b: FloatArray, step: float) -> tuple[float, float]:
    """Return how late a is against b in s, to a part of a sample, and how much the correlation gains by it."""
    reach = min(round(LAG_S / step), a.size // 4)
    if reach < 1:
        return 0.0, 0.0
    size = np.abs(shifted_correlations(a, b, reach))
    best = int(np.argmax(size))
    gain = float(size[best] - size[reach])
    shift = 0.0
    if 0 < best < len(size) - 1:
        left, middle, right = size[best - 1 : best + 2]
        bend = left - 2 * middle + right
        shift = float(0.5 * (left - right) / bend) if bend != 0.0 else 0.0
    return (best - reach + shift) * step, gain


def _centred(values: FloatArray) -> FloatArray:
    """Return values less their mean, zero where all are alike: what the mean of those is off by is rounding."""
    return np.zeros_like(values) if float(np.ptp(values)) == 0.0 else values - values.mean()


def _speed_and_way(run: Run, stated: Stated) -> list[Note]:
    """The way made over five seconds against the speed; a current may change it, a unit changes it more."""
    good = np.isfinite(run["x_m"]) & np.isfinite(run["y_m"]) & np.isfinite(run["surge_m_s"])
    if good.sum() < 50:
        return []
    time, x, y, surge = run.time[good], run["x_m"][good], run["y_m"][good], run["surge_m_s"][good]
    width = max(1, round(5.0 / float(np.median(np.diff(time)))))
    if time.size <= 2 * width:
        return []
    made = np.hypot(x[width:] - x[:-width], y[width:] - y[:-width]) / (time[width:] - time[:-width])
    said = trapezoid_integral(time, surge)
    said = np.abs(said[width:] - said[:-width]) / (time[width:] - time[:-width])
    # In a turn the straight way is shorter than the path, so the fastest windows decide.
    ratio = float(np.percentile(made, 90)) / max(float(np.percentile(said, 90)), 1e-9)
    if 0.6 < ratio < 1.5 or float(np.percentile(said, 90)) < 0.1:
        return []
    in_knots = stated.is_si("surge_m_s") and abs(ratio / KNOT - 1.0) < SLOPE_LIMIT
    advice = "a knot is 0.514 m/s: set `unit: kn` at surge_m_s" if in_knots else "check the unit of speed"
    message = f"the way made is {ratio:.3g} times what surge_m_s says (limits 0.6 and 1.5): {advice}"
    data = {"signal": "surge_m_s", "value": ratio, "limit": 1.5} | ({"unit": "kn"} if in_knots else {})
    return [Note("speed_unit", message, data)]


def _command_and_fin(run: Run, command: str, fin: str, stated: Stated) -> list[Note]:
    both = np.isfinite(run[command]) & np.isfinite(run[fin])
    if both.sum() < 50 or np.ptp(run[command][both]) == 0.0 or np.ptp(run[fin][both]) == 0.0:
        return []
    time, a, b = run.time[both], run[fin][both], run[command][both]
    step = float(np.median(np.diff(time)))
    slope, trust = _slope(a, b)
    found = []
    if trust > TRUSTED and slope < 0.0:
        message = f"{fin} moves against {command} (slope {slope:.3g}): {stated.flip(command, fin)}"
        found.append(Note("fin_sign", message, {"signal": fin, "value": slope, "limit": 0.0}))
    lag, gain = _lag(a, b, step)
    if lag < -1.5 * step and gain > 0.002:
        message = (
            f"{fin} moves {-lag:.3f} s before its command (limit {1.5 * step:.3g} s): their clocks differ"
            f"{stated.stamps(command, fin)}"
        )
        found.append(Note("clock_offset", message, {"signal": fin, "value": lag, "limit": -1.5 * step}))
    return found
