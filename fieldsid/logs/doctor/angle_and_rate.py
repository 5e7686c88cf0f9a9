"""Findings on an angle and its rate: the change of the one over a second is the other integrated over the same second.

Their slope is 1. One below zero is a sign turned, one near 57.3 or 1/57.3 a degree taken for a radian, a shift a clock of its
own; where they do not go together at all, one of them is another signal.
"""

from __future__ import annotations

import math
from collections.abc import Container

import numpy as np

from fieldsid.errors import DataError
from fieldsid.logs.convert.faults.spikes import DIGITS, SPREADS, last_digit
from fieldsid.logs.convert.units import UNIT_LIMIT, UNITS, unit_of_ratio
from fieldsid.logs.doctor.stated import Stated
from fieldsid.logs.doctor.together import over, together
from fieldsid.logs.run import SIGNALS, Note, Run
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.shifted_correlation import lag_of, shifted_correlations, slope_of
from fieldsid.numerics.trapezoid import trapezoid_integral
from fieldsid.numerics.white_noise import MEDIAN_OF_NORMAL, robust_white_noise_std

PAIR_WINDOW_S, LONG_WINDOW_S = 1.0, 4.0
"""Time over which an angle's change is set against its rate's, and that for a motion which shows above its noise only then."""
TRUSTED = 0.8
"""Correlation from which a slope is taken as real."""
STRONG, WEAK = 0.9, 0.5
"""Correlation of two signals of which one is the other's rate, and the one below which, at every shift, neither is."""
MIN_NOISE_RATIO = 4.0
"""How many times its noise a change must be to be judged."""
FASTER, FEWEST_JUMPS = 1.5, 2
"""Times a step at the rate of a fast tenth of the log by which an angle and its rate may differ, and places that are jumps."""
JUMP_WIDTHS = (1, 2, 4)
"""Steps over which they are compared."""
FITS_BETTER = 2.5
"""Ratio of two variances of the same steps, 50 at least, that chance does not make: 2.4 is the one per mille of F(50, 50)."""
ROUNDING = 1e-12
"""Circular variance below which there is none."""
DEGREES = 180.0 / math.pi
RATES = {u.name: u.factor for u in UNITS.values() if u.dimension == "angle rate"}
"""Units in which a rate is logged, in rad/s."""
LAG_S = 1.0
"""Longest clock offset looked for."""

PAIRS = (("yaw_rad", "yaw_rate_rad_s"), ("pitch_rad", "pitch_rate_rad_s"), ("roll_rad", "roll_rate_rad_s"))
CONTRADICTING = frozenset({"rate_sign", "unit", "swapped", "unrelated"})


def angle_findings(run: Run, stated: Stated, faulty: Container[str]) -> list[Note]:
    """Return the findings on each angle of a run and its rate; `faulty` are the signals of which another fault is known."""
    found: list[Note] = []
    for angle, rate in PAIRS:
        if run.has(angle) and run.has(rate):
            told = _swapped(run, angle, rate) or _angle_and_rate(run, angle, rate, stated)
            if not any(n.code in CONTRADICTING for n in told):
                told = [*told, *_jumps(run, angle, rate)]
            found += told or ([] if angle in faulty or rate in faulty else _unrelated(run, angle, rate))
    return found


def _angle_and_rate(run: Run, angle: str, rate: str, stated: Stated) -> list[Note]:
    in_degrees = _turned_in_degrees(run, angle, rate, stated) if angle == "yaw_rad" else []
    changes = changes_of(run, angle, rate)
    if changes is None or in_degrees:
        return in_degrees
    a, b, step = changes
    slope, trust = slope_of(a, b)
    if trust < TRUSTED:
        return []
    return [*_of_slope(angle, rate, slope, stated), *_of_lag(angle, rate, a, b, step, stated)]


def agrees_with_rate(run: Run, angle: str, rate: str) -> bool:
    """Whether an angle changes as its rate says, in the units that both are taken in."""
    changes = changes_of(run, angle, rate)
    return changes is not None and _is_rate_of(changes, TRUSTED)


def _swapped(run: Run, angle: str, rate: str) -> list[Note]:
    """An angle and a rate that are not each other's, where another signal is the one's."""
    own = changes_of(run, angle, rate)
    if own is not None and _is_rate_of(own, WEAK):
        return []
    others = [s for s, unit in SIGNALS.items() if s not in (angle, rate) and unit in ("rad", "rad/s") and run.has(s)]
    asked = [(rate, angle), *((angle, s) for s in others), *((s, rate) for s in others)]
    pairs = ((one, of) for one, of in asked if (c := changes_of(run, one, of)) is not None and _is_rate_of(c, STRONG))
    one, of = next(pairs, ("", ""))
    if not one:
        return []
    slope, trust = (0.0, 0.0) if own is None else slope_of(*own[:2])
    if one == rate:
        said = f"{rate} changes as {angle} says, in place of the other way round"
    elif one == angle:
        said = f"{angle} changes as {of} says, and not as {rate}"
    else:
        said = f"{one} changes as {rate} says, and {angle} does not"
    seen = "it hardly moves" if own is None else f"correlation {trust:.2f}, slope {slope:.3g}, should be 1"
    message = f"{said} ({seen}): two columns are swapped"
    signals = list(dict.fromkeys((angle, rate, one, of)))
    return [Note("swapped", message, {"signal": angle, "signals": signals, "value": trust, "limit": STRONG})]


def refuse_contradiction(run: Run, angle: str, rate: str) -> None:
    """Raise DataError where a finding on a run says that no model can follow both an angle and its rate."""
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
    """Return how an angle and its rate contradict each other in a part of a run, empty where they do not.

    A sign, a unit and a swap show in any stretch that moves. That the two are of two motions is told by a whole run alone.
    """
    found = _swapped(run, angle, rate) or _angle_and_rate(run, angle, rate, Stated())
    return next((n.message for n in found if n.code in CONTRADICTING), "")


def _is_rate_of(changes: tuple[FloatArray, FloatArray, float], least: float) -> bool:
    """Whether changes of a signal go with the integral of another, one to one and with a correlation above a least one."""
    slope, trust = slope_of(*changes[:2])
    return trust > least and abs(slope - 1.0) <= UNIT_LIMIT


def _unrelated(run: Run, angle: str, rate: str) -> list[Note]:
    """An angle and a rate that both move, and go together at no shift, nor by Euler's kinematics: one is another signal."""
    tried = [changes_of(run, angle, rate)]
    if (turning := _euler_rate(run, angle)) is not None:
        tried.append(changes_of(Run(run.name, run.time, {**run.signals, rate: turning}), angle, rate))
    elif angle == "pitch_rad" and run.has("yaw_rate_rad_s") and np.nanstd(run["yaw_rate_rad_s"]) > np.nanstd(run[rate]):
        return []  # at a roll that is not known, a turn pitches
    if any(c is None for c in tried):
        return []
    alike = max(float(np.max(np.abs(shifted_correlations(c[0], c[1], c[0].size // 4)))) for c in tried if c is not None)
    if alike >= WEAK:
        return []
    message = (
        f"{angle} and {rate} are not of one motion (their changes have a correlation of {alike:.2f} at most, at any shift; limit "
        f"{WEAK:g}): check which columns they are, or leave out the one that is wrong"
    )
    return [Note("unrelated", message, {"signal": angle, "signals": [angle, rate], "value": alike, "limit": WEAK})]


def _euler_rate(run: Run, angle: str) -> FloatArray | None:
    """Return how fast an Euler angle changes by the rates of the body (Fossen 2021, eq. 2.39); None where one is missing."""
    signals = ("roll_rad", "pitch_rad", "pitch_rate_rad_s", "yaw_rate_rad_s")
    if angle == "roll_rad" or not all(run.has(s) for s in signals):
        return None
    roll, pitch, q, r = (run[s] for s in signals)
    return q * np.cos(roll) - r * np.sin(roll) if angle == "pitch_rad" else (q * np.sin(roll) + r * np.cos(roll)) / np.cos(pitch)


def _turned_in_degrees(run: Run, angle: str, rate: str, stated: Stated) -> list[Note]:
    """A heading in degrees that was unwrapped as rad: whole turns are lost, but on the circle it goes with 57.3 of its rate.

    The circular variances 1 - |mean exp(i (step - k turn))| of k = 1 and k = 57.3 are compared (Mardia and Jupp 2000, 2.3.1).
    """
    both = together(run, angle, rate)
    if both is None:
        return []
    made, turned = np.diff(both[1]), np.diff(trapezoid_integral(both[0], both[2]))
    as_rad, as_deg = (max(1.0 - abs(complex(np.mean(np.exp(1j * (made - k * turned))))), ROUNDING) for k in (1.0, DEGREES))
    if not as_deg < as_rad / FITS_BETTER:
        return []
    advice, unit = _in_degrees(angle, "deg", rate, stated)
    message = (
        f"{angle} goes with {rate} as degrees, not as rad (circular variances of the steps {as_deg:.3g} and {as_rad:.3g}, limit "
        f"{FITS_BETTER:g} times): {advice}"
    )
    return [
        Note("unit", message, {"signal": angle, "signals": [angle, rate], "value": as_rad / as_deg, "limit": FITS_BETTER, **unit})
    ]


def _jumps(run: Run, angle: str, rate: str) -> list[Note]:
    """Changes of an angle that its rate does not make, or rates that the angle does not follow, beyond the noise of both.

    A rate that is wrong for a few samples moves the angle's noise out of no single step, so that changes over a few are taken.
    """
    both = together(run, angle, rate)
    if both is None:
        return []
    time, turned, turning = both
    swept = trapezoid_integral(time, turning)
    fastest = FASTER * float(np.percentile(np.abs(turning), 90))
    found = [f for width in JUMP_WIDTHS if (f := _off_over(width, time, turned, swept, fastest)) is not None]
    if not found:
        return []
    count, size, limit, at = max(found, key=lambda f: f[1] / f[2])
    message = (
        f"{angle} and {rate} disagree at {count} places of {time.size} samples, by up to {size:.3g} rad at {at:.2f} s (limit "
        f"{limit:.3g} rad, {SPREADS:g} standard deviations): one of them jumps where the other does not"
    )
    return [Note("disagree", message, {"signal": angle, "value": size, "limit": limit, "count": count})]


def _off_over(
    width: int, time: FloatArray, turned: FloatArray, swept: FloatArray, fastest: float
) -> tuple[int, float, float, float] | None:
    """Return at how many places an angle is off its rate over some steps, by how much, the limit and when; None where at few.

    `fastest` is the rate by which they may be a step apart.
    """
    off = over(turned - swept, width)
    off = np.abs(off - np.median(off))
    usual = float(np.median(off)) / MEDIAN_OF_NORMAL
    limit = max(SPREADS * usual, DIGITS * last_digit(turned))
    odd = np.flatnonzero(off > np.maximum(limit, fastest * np.diff(time)[width - 1 :]))
    places = 1 + int(np.count_nonzero(np.diff(odd) > width)) if odd.size else 0
    if places < FEWEST_JUMPS or usual == 0.0:
        return None
    at = int(np.argmax(off))
    return places, float(off[at]), limit, float(time[at])


def changes_of(run: Run, angle: str, rate: str) -> tuple[FloatArray, FloatArray, float] | None:
    """Return the changes of an angle and of an integrated rate over the window (n,), and the step.

    None when the log is too short, or neither moves clearly more than its noise.
    """
    both = together(run, angle, rate)
    if both is None:
        return None
    time, turned, turning = both
    swept, step = trapezoid_integral(time, turning), float(np.median(np.diff(time)))
    floor = MIN_NOISE_RATIO * math.sqrt(2.0) * _noise(turned)
    noise = _noise(turning)
    for window_s in (PAIR_WINDOW_S, LONG_WINDOW_S):
        width = max(1, round(window_s / step))
        if time.size <= 3 * width:
            return None
        a, b = over(turned, width), over(swept, width)
        if float(np.std(a)) > floor and float(np.std(b)) > MIN_NOISE_RATIO * noise * math.sqrt(window_s * step):
            return a, b, step
    return None


def _noise(values: FloatArray) -> float:
    """Return the noise of a signal; that of its last digit where it stands still in it, or moves by whole ones."""
    return max(robust_white_noise_std(np.diff(values, 2), 2), last_digit(values) / math.sqrt(12.0))


def _of_slope(angle: str, rate: str, slope: float, stated: Stated) -> list[Note]:
    data = {"signal": rate, "signals": [angle, rate], "value": slope, "limit": 1.0}
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
    elif goes_as := _unit_of_rate(rate, size, stated):
        advice, unit = _in_degrees(rate, goes_as, angle, stated)
        message = f"{rate} is {1 / size:.3g} times the change of {angle}, as numbers in {goes_as} are: {advice}"
        found.append(Note("unit", message, {**data, "goes_as": goes_as, **unit}))
    elif abs(size - 1.0) > UNIT_LIMIT:
        message = f"{angle} changes {size:.3g} times as fast as {rate} says (limit 1 +/- {UNIT_LIMIT:g}): check both scales"
        found.append(Note("rate_scale", message, {**data, "limit": UNIT_LIMIT}))
    return found


def _unit_of_rate(rate: str, size: float, stated: Stated) -> str | None:
    """Return the unit in which a rate goes with its angle, by how many times as fast that changes; None where it is its own."""
    own = SIGNALS[rate] if stated.is_si(rate) else stated.units[rate]
    unit = unit_of_ratio(size * RATES[own], RATES) if size > 0.0 and own in RATES else None
    return None if unit == own else unit


def _in_degrees(large: str, unit: str, small: str, stated: Stated) -> tuple[str, dict[str, str]]:
    """Return what to do about a signal that is larger than another by the degrees of a radian, and the unit to set if any."""
    wrong = [] if stated.is_si(small) else [f"{small} is not in `{stated.units[small]}`"]
    if not stated.is_si(large):
        return " or ".join(wrong) or f"taken as `{stated.units[large]}` already: check which ones they are", {}
    said = " or ".join([f"{large} is probably in {unit}: set `unit: {unit}`", *wrong])
    return said, {} if wrong else {"unit": unit}


def _of_lag(angle: str, rate: str, a: FloatArray, b: FloatArray, step: float, stated: Stated) -> list[Note]:
    late, gain = lag_of(a, b, min(round(LAG_S / step), a.size // 4))
    lag = late * step
    limit = max(1.5 * step, 0.05)
    if abs(lag) <= limit or gain < 0.002:
        return []
    message = (
        f"{angle} is {lag:+.3f} s late against {rate} (limit {limit:.3g} s): their clocks differ{stated.stamps(angle, rate)}"
    )
    return [Note("clock_offset", message, {"signal": angle, "value": lag, "limit": limit})]
