"""Findings on an angle and its rate: the change of the angle over a window equals the integral of the rate over it.

The slope of the regression of one on the other is then 1. A negative slope shows a wrong sign, a slope near 57.3 or 1/57.3
degrees taken for radians, and a time shift two different clocks. Where the two are uncorrelated, one of them is another signal.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable

import numpy as np
from scipy.special import fdtri

from fieldsid.errors import DataError
from fieldsid.logs.convert.clock import GAP_FACTOR
from fieldsid.logs.convert.faults.dropouts import MOST_CHANCE
from fieldsid.logs.convert.faults.spikes import DIGITS, SPREADS, last_digit
from fieldsid.logs.convert.heading_unwrap import ALIKE
from fieldsid.logs.convert.units import UNIT_LIMIT, UNITS, unit_of_ratio
from fieldsid.logs.doctor.stated import Stated
from fieldsid.logs.doctor.together import FEWEST, SURE, delay_of, over, together
from fieldsid.logs.run import RATE_OF, SIGNALS, Note, Run
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.shifted_correlation import shifted_correlations, slope_of
from fieldsid.numerics.trapezoid import trapezoid_integral
from fieldsid.numerics.white_noise import MEDIAN_OF_NORMAL, robust_white_noise_std

PAIR_WINDOW_S, LONG_WINDOW_S = 1.0, 4.0
"""Windows over which the changes are compared: the first, and a longer one for a motion that exceeds the noise only over that."""
TRUSTED = 0.8
"""Smallest correlation at which a slope is used."""
STRONG, WEAK = 0.9, 0.5
"""Smallest correlation of a signal with its rate, or mean cosine of two directions, that agree; and the correlation below which,
at every shift, two signals are unrelated."""
FASTER = 1.5
"""Allowed difference of an angle from its rate, in steps at the 90th percentile of the rate."""
JUMP_WIDTHS = (1, 2, 4)
"""Numbers of steps over which jumps are sought."""
FITS_BETTER = float(fdtri(FEWEST, FEWEST, 1.0 - MOST_CHANCE))
"""Significant ratio of two variances of the same steps, of which there are at least FEWEST: a quantile of F(50, 50), 2.4."""
DEGREES = 180.0 / math.pi
RATES = {u.name: u.factor for u in UNITS.values() if u.dimension == "angle rate"}
"""Units of rates, in rad/s."""
TIMES = {u.name: u.factor for u in UNITS.values() if u.dimension == "time"}
"""Units of time, in s."""
SUMMED = 10.0
"""Ratio of the distances of an angle from the trapezoidal integral of its rate and from its sum from which on it is the sum."""

CONTRADICTING = frozenset({"rate_sign", "unit", "swapped", "unrelated", "time_scale"})


def angle_findings(run: Run, stated: Stated, faulty: Container[str]) -> list[Note]:
    """Return the findings on each angle of a run and its rate; `faulty` are the signals with another known fault."""
    found: list[Note] = []
    for angle, rate in RATE_OF.items():
        if run.has(angle) and run.has(rate):
            notes = _swapped(run, angle, rate) or _angle_and_rate(run, angle, rate, stated)
            if not any(n.code in CONTRADICTING for n in notes):
                notes = [*notes, *_jumps(run, angle, rate), *_summed(run, angle, rate)]
            found += notes or ([] if angle in faulty or rate in faulty else _unrelated(run, angle, rate))
    return found


def _angle_and_rate(run: Run, angle: str, rate: str, stated: Stated) -> list[Note]:
    if in_time := _time_scale(run, angle, rate, stated):
        return in_time
    in_degrees = _unwrapped_degrees(run, angle, rate, stated) if angle == "yaw_rad" else []
    changes = changes_of(run, angle, rate)
    if changes is None or in_degrees:
        return in_degrees
    a, b, step = changes
    slope, trust = slope_of(a, b)
    if trust < TRUSTED:
        return []
    return [*_slope_findings(angle, rate, slope, stated), *_lag_findings(angle, rate, a, b, step, stated)]


def _time_scale(run: Run, angle: str, rate: str, stated: Stated) -> list[Note]:
    """Return the finding that the times are in another unit: the units of angle and rate are stated, and agree only then."""
    if stated.time is None or not {angle, rate} <= stated.units.keys():
        return []
    changes = changes_of(run, angle, rate) or _changes_as_logged(run, angle, rate)
    slope, trust = (0.0, 0.0) if changes is None else slope_of(*changes[:2])
    unit = unit_of_ratio(abs(slope) * TIMES[stated.time], TIMES) if trust >= TRUSTED else None
    if unit is None or unit == stated.time:
        return []
    advice = f"the time is in {unit}, and not in {stated.time}: set `unit: {unit}` at time"
    is_open = ALIKE[0] < abs(slope) / DEGREES < ALIKE[1]  # a minute has nearly as many seconds as a radian has degrees
    if is_open:
        advice += f"; or {rate} is not in `{stated.units[rate]}`"
    said = f"{angle} changes {abs(slope):.3g} times as fast as {rate} in `{stated.units[rate]}` says, correlation {trust:.2f}"
    data = {"signal": rate, "signals": [angle, rate], "value": slope, "limit": 1.0}
    return [Note("time_scale", f"{said}: {advice}", data | ({} if is_open else {"time_unit": unit}))]


def fastest_turn(run: Run) -> float:
    """Return the largest rate in rad/s of any angle of a run over any window, less its noise; zero without an angle."""
    fastest = 0.0
    for time, turned in (both for angle in RATE_OF if (both := together(run, angle)) is not None):
        floor = SURE * math.sqrt(2.0) * _noise(turned)
        for width in (1 << power for power in range((turned.size - 1).bit_length())):
            fastest = max(fastest, float(np.max((np.abs(over(turned, width)) - floor) / over(time, width))))
    return fastest


def agrees_with_rate(run: Run, angle: str, rate: str) -> bool:
    """Return whether the change of an angle equals the integral of its rate, in the units in which both were read."""
    changes = changes_of(run, angle, rate)
    return changes is not None and _is_rate_of(changes, TRUSTED)


def _swapped(run: Run, angle: str, rate: str) -> list[Note]:
    """Return the finding that two columns are swapped: angle and rate disagree, and one of them agrees with another signal."""
    own = changes_of(run, angle, rate)
    if own is not None and _is_rate_of(own, WEAK):
        return []
    others = [s for s, unit in SIGNALS.items() if s not in (angle, rate) and unit in ("rad", "rad/s") and run.has(s)]
    candidates = [(rate, angle), *((angle, s) for s in others), *((s, rate) for s in others)]
    pairs = ((one, of) for one, of in candidates if (c := changes_of(run, one, of)) is not None and _is_rate_of(c, STRONG))
    one, of = next(pairs, ("", ""))
    if not one:
        return []
    slope, trust = (0.0, 0.0) if own is None else slope_of(*own[:2])
    if one == rate:
        statement = f"{rate} changes as {angle} says, in place of the other way round"
    elif one == angle:
        statement = f"{angle} changes as {of} says, and not as {rate}"
    else:
        statement = f"{one} changes as {rate} says, and {angle} does not"
    seen = "it hardly moves" if own is None else f"correlation {trust:.2f}, slope {slope:.3g}, should be 1"
    message = f"{statement} ({seen}): two columns are swapped"
    signals = list(dict.fromkeys((angle, rate, one, of)))
    return [Note("swapped", message, {"signal": angle, "signals": signals, "value": trust, "limit": STRONG})]


def refuse_contradiction(run: Run, angle: str, rate: str) -> None:
    """Raise DataError where a note of a run states a contradiction of an angle and its rate, which no model can follow."""
    if not (run.has(angle) and run.has(rate)):
        return
    found = [n for n in run.notes if n.code in CONTRADICTING and {angle, rate} & set(n.data.get("signals", ()))]
    if found:
        raise DataError(
            f"no model follows `{angle}` and `{rate}` of run {run.name!r} as they are",
            found=found[0].message,
            hint="import the log again with a right mapping, see `sysid inspect LOG --write-mapping mapping.yaml`; or leave "
            "the wrong one of the two out of it: one is enough",
        )


def contradiction(run: Run, angle: str, rate: str) -> str:
    """Return the contradiction of an angle and its rate in a part of a run, in words; empty where there is none.

    A wrong sign or unit and a swap show in any part with motion. That the two are unrelated shows only in a complete run.
    """
    found = _swapped(run, angle, rate) or _angle_and_rate(run, angle, rate, Stated())
    return next((n.message for n in found if n.code in CONTRADICTING), "")


def _is_rate_of(changes: tuple[FloatArray, FloatArray, float], least: float) -> bool:
    """Return whether the changes of a signal equal the integral of another: slope 1, and a correlation above `least`."""
    slope, trust = slope_of(*changes[:2])
    return trust > least and abs(slope - 1.0) <= UNIT_LIMIT


def _unrelated(run: Run, angle: str, rate: str) -> list[Note]:
    """Return the finding that an angle and a rate are uncorrelated at every shift, also by Euler's kinematics."""
    tried = [changes_of(run, angle, rate)]
    if (turning := _euler_rate(run, angle)) is not None:
        tried.append(changes_of(Run(run.name, run.time, {**run.signals, rate: turning}), angle, rate))
    elif angle == "pitch_rad" and run.has("yaw_rate_rad_s") and np.nanstd(run["yaw_rate_rad_s"]) > np.nanstd(run[rate]):
        return []  # at an unknown roll, the yaw rate r changes the pitch angle
    if any(c is None for c in tried):
        return []
    peak = max(float(np.max(np.abs(shifted_correlations(c[0], c[1], c[0].size // 4)))) for c in tried if c is not None)
    if peak >= WEAK:
        return []
    message = (
        f"{angle} and {rate} are not of one motion (their changes have a correlation of {peak:.2f} at most, at any shift; limit "
        f"{WEAK:g}): check which columns they are, or leave out the one that is wrong"
    )
    return [Note("unrelated", message, {"signal": angle, "signals": [angle, rate], "value": peak, "limit": WEAK})]


def _euler_rate(run: Run, angle: str) -> FloatArray | None:
    """Return the derivative of an Euler angle from q and r (Fossen 2021, eq. 2.39); None where a signal is missing."""
    signals = ("roll_rad", "pitch_rad", "pitch_rate_rad_s", "yaw_rate_rad_s")
    if angle == "roll_rad" or not all(run.has(s) for s in signals):
        return None
    roll, pitch, q, r = (run[s] for s in signals)
    return q * np.cos(roll) - r * np.sin(roll) if angle == "pitch_rad" else (q * np.sin(roll) + r * np.cos(roll)) / np.cos(pitch)


def _unwrapped_degrees(run: Run, angle: str, rate: str, stated: Stated) -> list[Note]:
    """Return the finding that a heading in degrees was unwrapped as rad: modulo 2 pi it changes by 57.3 times its rate.

    The circular variances 1 - |mean exp(i (step - k turn))| for k = 1 and k = 57.3 are compared (Mardia and Jupp 2000, 2.3.1).
    """
    both = together(run, angle, rate)
    if both is None:
        return []
    made, turned = np.diff(both[1]), np.diff(trapezoid_integral(both[0], both[2]))
    least = float(np.finfo(np.float64).eps)
    as_rad, as_deg = (max(1.0 - abs(complex(np.mean(np.exp(1j * (made - k * turned))))), least) for k in (1.0, DEGREES))
    if not as_deg < as_rad / FITS_BETTER:
        return []
    advice, unit = _in_degrees(angle, "deg", rate, stated)
    message = (
        f"{angle} goes with {rate} as degrees, not as rad (circular variances of the steps {as_deg:.3g} and {as_rad:.3g}, limit "
        f"{FITS_BETTER:.2g} times): {advice}"
    )
    return [
        Note("unit", message, {"signal": angle, "signals": [angle, rate], "value": as_rad / as_deg, "limit": FITS_BETTER, **unit})
    ]


def _jumps(run: Run, angle: str, rate: str) -> list[Note]:
    """Return the finding of jumps: changes of an angle that differ from the integral of its rate by more than the noise.

    A rate that is wrong for a few samples stays within the noise of the angle in each step, so changes over a few steps are used.
    """
    both = _moving(run, angle, rate)
    if both is None:
        return []
    time, turned, swept, turning = both
    fastest = FASTER * float(np.percentile(np.abs(turning), 90))
    found = [f for width in JUMP_WIDTHS if (f := _jumps_over(width, time, turned, swept, fastest)) is not None]
    if not found:
        return []
    count, size, limit, at = max(found, key=lambda f: f[1] / f[2])
    message = (
        f"{angle} and {rate} disagree at {count} places of {time.size} samples, by up to {size:.3g} rad at {at:.2f} s (limit "
        f"{limit:.3g} rad, {SPREADS:g} standard deviations): one of them jumps where the other does not"
    )
    return [Note("disagree", message, {"signal": angle, "value": size, "limit": limit, "count": count})]


def _jumps_over(
    width: int, time: FloatArray, turned: FloatArray, swept: FloatArray, fastest: float
) -> tuple[int, float, float, float] | None:
    """Return the number of jumps over some steps, the largest in rad, the limit and its time in s; None where there are few.

    `fastest` is the rate in rad/s by which angle and rate may differ in a step.
    """
    off = over(turned - swept, width)
    off = np.abs(off - np.median(off))
    usual = float(np.median(off)) / MEDIAN_OF_NORMAL
    limit = max(SPREADS * usual, DIGITS * last_digit(turned))
    jumping = np.flatnonzero(off > np.maximum(limit, fastest * np.diff(time)[width - 1 :]))
    places = 1 + int(np.count_nonzero(np.diff(jumping) > width)) if jumping.size else 0
    if places < 2 or usual == 0.0:
        return None
    at = int(np.argmax(off))
    return places, float(off[at]), limit, float(time[at])


def _summed(run: Run, angle: str, rate: str) -> list[Note]:
    """Return the finding that an angle is the sum of its rate, as Euler's rule has it, and what that does to a time constant."""
    both = together(run, angle, rate)
    if both is None:
        return []
    time, turned, turning = both
    off, half = np.diff(turned) - np.diff(trapezoid_integral(time, turning)), 0.5 * np.diff(turning) * np.diff(time)
    trapezoid, before, after = (float(np.sqrt(np.mean(x**2))) for x in (off, off + half, off - half))
    step = float(np.median(np.diff(time)))
    if SUMMED * min(before, after) >= trapezoid or step >= 1.0:
        return []
    shown, exact = -step / math.log1p(-step), min(before, after)
    message = (
        f"{angle} is the sum of {rate} times the step, to {exact:.2g} rad, as Euler's rule of a simulator makes it: at "
        f"{step:.3g} s a time constant of 1 s in its equations shows as {shown:.4g} s in the log, and damping "
        "and authority as larger than theirs; log a simulation with smaller steps"
    )
    return [Note("euler", message, {"signal": angle, "value": exact / trapezoid, "limit": 1.0 / SUMMED})]


def changes_of(run: Run, angle: str, rate: str) -> tuple[FloatArray, FloatArray, float] | None:
    """Return the changes (n,) of an angle and of the integral of its rate over a window, and the step in s.

    Returns None where the log is too short, or where one of the two does not exceed its noise clearly.
    """
    both = _moving(run, angle, rate)
    if both is None:
        return None
    step = float(np.median(np.diff(both[0])))
    return _changes_over(both, [max(1, round(window_s / step)) for window_s in (PAIR_WINDOW_S, LONG_WINDOW_S)], step)


def _changes_as_logged(run: Run, angle: str, rate: str) -> tuple[FloatArray, FloatArray, float] | None:
    """Return the same over the first window that exceeds the noise; windows count samples, and need no unit of time."""
    both = _moving(run, angle, rate)
    if both is None:
        return None
    return _changes_over(both, [1 << power for power in range(both[0].size.bit_length())], float(np.median(np.diff(both[0]))))


def _changes_over(
    both: tuple[FloatArray, FloatArray, FloatArray, FloatArray], widths: Iterable[int], step: float
) -> tuple[FloatArray, FloatArray, float] | None:
    time, turned, swept, turning = both
    floor, noise = SURE * math.sqrt(2.0) * _noise(turned), _noise(turning)
    for width in widths:
        if time.size <= 3 * width:
            return None
        a, b = over(turned, width), over(swept, width)
        if float(np.std(a)) > floor and float(np.std(b)) > SURE * noise * math.sqrt(width) * step:
            return a, b, step
    return None


def _moving(run: Run, angle: str, rate: str) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray] | None:
    """Return times (n,), an angle, the integral of its rate, and the rate; None where a run has too few samples of both.

    How far a vehicle turns in a gap of the log, or while its gyro stays at an end of its range, is not known: neither changes
    there.
    """
    both = together(run, angle, rate)
    if both is None:
        return None
    time, turned, turning = both
    steps = np.diff(time)
    at_end = (turning == turning.min()) | (turning == turning.max())
    unknown = (steps > GAP_FACTOR * float(np.median(steps))) | (at_end[1:] & (turning[1:] == turning[:-1]))
    swept = trapezoid_integral(time, turning)
    if unknown.any():
        turned, swept = (np.concatenate([[0.0], np.cumsum(np.where(unknown, 0.0, np.diff(v)))]) for v in (turned, swept))
    return time, turned, swept, turning


def _noise(values: FloatArray) -> float:
    """Return the noise standard deviation of a signal, at least that of rounding to its last digit."""
    return max(robust_white_noise_std(np.diff(values, 2), 2), last_digit(values) / math.sqrt(12.0))


def _slope_findings(angle: str, rate: str, slope: float, stated: Stated) -> list[Note]:
    data = {"signal": rate, "signals": [angle, rate], "value": slope, "limit": 1.0}
    found = []
    if slope < 0.0:
        message = f"{rate} runs against {angle} (slope {slope:.3g}, should be 1): {stated.flip(angle, rate)}, or set the frame"
        found.append(Note("rate_sign", message, data))
    size = abs(slope)
    if ALIKE[0] < size / DEGREES < ALIKE[1]:
        advice, unit = _in_degrees(angle, "deg", rate, stated)
        found.append(
            Note("unit", f"{angle} changes {size:.3g} times as fast as {rate} says: {advice}", {**data, "signal": angle, **unit})
        )
    elif goes_as := _unit_of_rate(rate, size, stated):
        advice, unit = _in_degrees(rate, goes_as, angle, stated)
        message = f"{rate} is {1 / size:.3g} times the change of {angle}, as numbers in {goes_as} are: {advice}"
        found.append(Note("unit", message, {**data, "goes_as": goes_as, **unit}))
    elif abs(size - 1.0) > UNIT_LIMIT:
        said = f"{angle} changes {size:.3g} times as fast as {rate} says (limit 1 +/- {UNIT_LIMIT:g})"
        read = f"{angle} is read at {size:.3g} times its true size, or {rate} or the time at {1.0 / size:.3g} times"
        message = f"{said}: {read}; leave the wrong one of the two signals out, or set `unit` or `rate` at time"
        found.append(Note("rate_scale", message, {**data, "limit": UNIT_LIMIT}))
    return found


def _unit_of_rate(rate: str, size: float, stated: Stated) -> str | None:
    """Return the unit in which a rate agrees with its angle, which changes `size` times as fast; None where it has that unit."""
    own = SIGNALS[rate] if stated.is_si(rate) else stated.units[rate]
    unit = unit_of_ratio(size * RATES[own], RATES) if size > 0.0 and own in RATES else None
    return None if unit == own else unit


def _in_degrees(large: str, unit: str, small: str, stated: Stated) -> tuple[str, dict[str, str]]:
    """Return the advice on a signal that is too large against another by the ratio of two units, and the unit to set if any."""
    wrong = [] if stated.is_si(small) else [f"{small} is not in `{stated.units[small]}`"]
    if not stated.is_si(large):
        return " or ".join(wrong) or f"taken as `{stated.units[large]}` already: check which ones they are", {}
    statement = " or ".join([f"{large} is probably in {unit}: set `unit: {unit}`", *wrong])
    return statement, {} if wrong else {"unit": unit}


def _lag_findings(angle: str, rate: str, a: FloatArray, b: FloatArray, step: float, stated: Stated) -> list[Note]:
    lag, limit = delay_of(a, b, step), max(1.5 * step, 0.05)
    if abs(lag) <= limit:
        return []
    message = (
        f"{angle} is {lag:+.3f} s late against {rate} (limit {limit:.3g} s): their clocks differ{stated.stamps(angle, rate)}"
    )
    return [Note("clock_offset", message, {"signal": angle, "value": lag, "limit": limit})]
