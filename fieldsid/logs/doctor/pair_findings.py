"""Findings on signals that must agree: speed and position, course and heading, depth and pitch, command and fin.

With x north and y east the course atan2(dy, dx) increases with the heading; with x east and y north it is pi/2 minus that. The
depth follows the pitch: d(depth)/dt = -u sin(pitch) + w cos(pitch) (Fossen 2011, eq. 2.30, without roll).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fieldsid.logs.channels import AXES
from fieldsid.logs.convert.heading_unwrap import ALIKE
from fieldsid.logs.convert.units import UNIT_LIMIT, factor_to, unit_of_ratio
from fieldsid.logs.doctor.angle_and_rate import STRONG, TRUSTED
from fieldsid.logs.doctor.stated import Stated
from fieldsid.logs.doctor.together import FEWEST, SURE, agreement, delay_of, over, together, width_of
from fieldsid.logs.few_of import FEW
from fieldsid.logs.run import Note, Run
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.shifted_correlation import slope_of
from fieldsid.numerics.trapezoid import trapezoid_integral

SPEEDS = {unit: factor_to("surge_m_s", unit) for unit in ("kn", "mph", "km/h", "ft/s", "cm/s", "mm/s")}
"""Units of speeds, in m/s."""
MOST_WAY = 1.5
"""Largest ratio of the speed from positions and the logged speed, either way; currents and sideslip stay within."""
LEAST_WAY = 1.0 / MOST_WAY
SLOWEST = 0.1
"""Speed in m/s below which a distance is mostly sensor noise."""
SLOW_RPM = 30.0
MOST_ADVANCE_M = 4.0
"""Advance in m per turn of the propeller that no vehicle of this kind reaches."""


def pair_findings(run: Run, stated: Stated) -> list[Note]:
    """Return the findings on pairs of signals of a run."""
    of_fins = [note for _, (command, fin) in AXES for note in _command_and_fin(run, command, fin, stated)]
    return [
        *_speed_and_distance(run, stated),
        *_speed_and_turns(run),
        *of_fins,
        *_course_findings(run),
        *_dive_findings(run, stated),
    ]


def _speed_and_distance(run: Run, stated: Stated) -> list[Note]:
    """Return the finding that the speed from positions over 5 s and the logged speed differ by a factor, as by a wrong unit."""
    ratio = _distance_to_speed_ratio(run)
    if ratio is None or LEAST_WAY < ratio < MOST_WAY:
        return []
    unit = unit_of_ratio(ratio, SPEEDS) if stated.is_si("surge_m_s") else None
    advice = (
        f"{unit} is {factor_to('surge_m_s', unit):.3g} m/s: set `unit: {unit}` at surge_m_s"
        if unit
        else "check the unit of speed"
    )
    message = f"the way made is {ratio:.3g} times what surge_m_s says (limits {LEAST_WAY:.2g} and {MOST_WAY:g}): {advice}"
    data = {"signal": "surge_m_s", "value": ratio, "limit": MOST_WAY} | ({"unit": unit} if unit else {})
    return [Note("speed_unit", message, data)]


def goes_with_way(run: Run) -> bool:
    """Return whether the speed from x and y agrees with the logged speed."""
    ratio = _distance_to_speed_ratio(run)
    return ratio is not None and LEAST_WAY < ratio < MOST_WAY


def _distance_to_speed_ratio(run: Run) -> float | None:
    """Return the ratio of the speed from positions to the logged speed; None where there is too little of either."""
    seen = together(run, "x_m", "y_m", "surge_m_s")
    if seen is None or seen[0].size <= 2 * (width := width_of(seen[0], 5.0)):
        return None
    time, x, y, surge = seen
    made = np.hypot(over(x, width), over(y, width)) / over(time, width)
    speed_logged = np.abs(over(trapezoid_integral(time, surge), width)) / over(time, width)
    # In a turn the straight distance is shorter than the path, so the fastest windows are compared.
    fast = float(np.percentile(speed_logged, 90))
    return float(np.percentile(made, 90)) / fast if fast > SLOWEST else None


def _speed_and_turns(run: Run) -> list[Note]:
    """Return the finding that the advance per turn of the propeller is impossible: it is a few tenths of a metre."""
    seen = together(run, "propeller_rpm", "surge_m_s")
    if seen is None:
        return []
    _, rpm, surge = np.abs(seen)
    turning = (rpm > SLOW_RPM) & (surge > SLOWEST)
    if turning.sum() < FEWEST:
        return []
    advance = float(np.median(60.0 * surge[turning] / rpm[turning]))
    if advance < MOST_ADVANCE_M:
        return []
    message = f"surge_m_s makes {advance:.3g} m in a turn of propeller_rpm (limit {MOST_ADVANCE_M:g} m): check the units of both"
    return [Note("speed_unit", message, {"signal": "surge_m_s", "value": advance, "limit": MOST_ADVANCE_M})]


def _command_and_fin(run: Run, command: str, fin: str, stated: Stated) -> list[Note]:
    both = together(run, fin, command)
    if both is None or np.ptp(both[1]) == 0.0 or np.ptp(both[2]) == 0.0:
        return []
    time, a, b = both
    step = float(np.median(np.diff(time)))
    slope, trust = slope_of(a, b)
    found = []
    if trust > TRUSTED and slope < 0.0:
        message = f"{fin} moves against {command} (slope {slope:.3g}): {stated.flip(command, fin)}"
        found.append(Note("fin_sign", message, {"signal": fin, "value": slope, "limit": 0.0}))
    lag = delay_of(a, b, step)
    if lag < -1.5 * step:
        message = (
            f"{fin} moves {-lag:.3f} s before its command (limit {1.5 * step:.3g} s): their clocks differ"
            f"{stated.stamps(command, fin)}"
        )
        found.append(Note("clock_offset", message, {"signal": fin, "value": lag, "limit": -1.5 * step}))
    return found


WINDOW_S = 3.0
TURNED = 0.2
"""Smallest difference of two agreements for a finding; the heading must turn for it to occur."""
RATIO = 2.0
"""Largest ratio of the turns of course and heading: a vehicle with sideslip turns as far as its course in the end."""
LEAST_DIVE, MOST_DIVE = ALIKE
"""Limits of the ratio of the change of depth to that from speed and pitch; a heave velocity stays within."""
DEPTHS = {unit: factor_to("depth_m", unit) for unit in ("ft", "fathom", "cm", "mm")}
"""Units of depths, in m."""
HEADINGS = {"deg": math.degrees(1.0), "rad": math.radians(1.0)}
"""The unit to set for a heading that was read in the other unit, with the factor of its turns."""


@dataclass(frozen=True, slots=True)
class Course:
    """Course (m,) in rad over windows of `width` samples with motion, with heading, yaw rate, distance, and their share."""

    course: FloatArray
    heading: FloatArray
    rate: FloatArray
    way: FloatArray
    moved: float
    width: int

    @property
    def slope(self) -> float | None:
        """Ratio of the turns of course and heading; None where they are uncorrelated or the course cannot be unwrapped."""
        turned = np.unwrap(self.course)
        slope, agreed = slope_of(turned, self.heading)
        is_known = self.moved > 1.0 - FEW and slope > 0.0 and agreed >= STRONG and float(np.std(turned)) >= TURNED
        return slope if is_known else None


def course_of(run: Run, window_s: float = WINDOW_S) -> Course | None:
    """Return the course of a run over windows in s; None where there is too little motion."""
    seen = together(run, "x_m", "y_m", "yaw_rad")
    if seen is None or seen[0].size <= 4 * (width := width_of(seen[0], window_s)):
        return None
    time, x, y, yaw = seen
    dx, dy = over(x, width), over(y, width)
    way = np.hypot(dx, dy)
    moved = way > SLOWEST * window_s
    heading = trapezoid_integral(time, yaw)
    mean, rate = (over(v, width) / over(time, width) for v in (heading, yaw))
    if moved.sum() < FEWEST:
        return None
    share = float(moved.mean())
    return Course(np.arctan2(dy, dx)[moved], mean[moved], rate[moved], way[moved], share, width)


def _course_findings(run: Run) -> list[Note]:
    found = course_of(run)
    if found is None:
        return []
    # weighted by the distance: the course of a short distance is mostly sensor noise
    along, against = agreement(np.exp(1j * found.heading), found.way * np.exp(1j * found.course))
    if abs(against) > STRONG and abs(against) - abs(along) > TURNED:
        message = (
            f"the course made from x_m and y_m turns against yaw_rad (agreement {abs(against):.2f} against and {abs(along):.2f} "
            f"along it, limit {TURNED:g} between them): x is east and y north where the heading counts from north; "
            "set `frame: ENU` at x_m and y_m, or `frame: ENU` at yaw_rad"
        )
        return [Note("course_against", message, {"signal": "yaw_rad", "value": abs(against) - abs(along), "limit": TURNED})]
    slope = found.slope
    if slope is not None and not 1.0 / RATIO < slope < RATIO:
        message = (
            f"the course made from x_m and y_m turns {slope:.3g} times as far as yaw_rad (limits {1 / RATIO:g} and {RATIO:g}): "
            "a degree is 0.01745 rad; check the unit of the heading"
        )
        unit = next((u for u, factor in HEADINGS.items() if 1.0 / RATIO < slope * factor < RATIO), None)
        data = {"signal": "yaw_rad", "value": slope, "limit": RATIO} | ({} if unit is None else {"unit": unit})
        return [Note("course_slope", message, data)]
    off = math.remainder(float(np.angle(along)), math.tau)
    if abs(along) > STRONG and abs(off) > math.pi / 4:
        message = (
            f"the course made from x_m and y_m is {math.degrees(off):.0f} deg from yaw_rad (limit 45 deg): the heading counts "
            "from another direction than north, or x is not north; set `frame`"
        )
        return [Note("course_offset", message, {"signal": "yaw_rad", "value": abs(off), "limit": math.pi / 4})]
    return []


def goes_along_course(run: Run) -> bool:
    """Return whether the course turns, and as far as the heading: the heading is then in the unit in which it was read."""
    found = course_of(run)
    return found is not None and found.slope is not None and 1.0 / RATIO < found.slope < RATIO


def _dive_unit(slope: float, stated: Stated) -> list[Note]:
    """Return the finding that the depth and speed with pitch differ by the factor of a unit, with the unit where it is unique."""
    may = [("depth_m", u) for u, f in DEPTHS.items() if abs(slope * f - 1.0) < UNIT_LIMIT and stated.is_si("depth_m")]
    may += [("surge_m_s", u) for u, f in SPEEDS.items() if abs(slope / f - 1.0) < UNIT_LIMIT and stated.is_si("surge_m_s")]
    if not may:
        return []
    (signal, unit), is_one = may[0], len(may) == 1
    advice = f"set {', or '.join(f'`unit: {u}` at {s}' for s, u in may)}"
    message = (
        f"depth_m changes {slope:.3g} times as fast as surge_m_s and pitch_rad say (limits {LEAST_DIVE:.2g} and "
        f"{MOST_DIVE:.2g}): {advice}"
    )
    data = {"signal": signal, "value": slope, "limit": MOST_DIVE} | ({"unit": unit} if is_one else {})
    return [Note("depth_unit" if signal == "depth_m" else "speed_unit", message, data)]


def goes_with_depth(run: Run) -> bool:
    """Return whether the depth changes as speed and pitch predict, in the units in which they were read."""
    found = _depth_correlation(run)
    return found is not None and found[0] > TRUSTED and LEAST_DIVE < found[1] < MOST_DIVE


def goes_against_depth(run: Run) -> bool:
    """Return whether the depth changes against what speed and pitch predict: one of the two has the wrong sign."""
    found = _depth_correlation(run)
    return found is not None and found[0] <= -TRUSTED


def _depth_correlation(run: Run) -> tuple[float, float] | None:
    """Return the correlation and slope of the change of depth on that from speed and pitch; None where there is too little."""
    seen = together(run, "depth_m", "pitch_rad", "surge_m_s")
    if seen is None or seen[0].size <= 4 * (width := width_of(seen[0], WINDOW_S)):
        return None
    time, depth, pitch, surge = seen
    made, predicted = over(depth, width), over(trapezoid_integral(time, -surge * np.sin(pitch)), width)
    # Fisher's z = atanh(r), with the number of windows that do not overlap
    enough = math.atanh(TRUSTED) * math.sqrt(max(made.size / width - 3.0, 0.0)) >= SURE
    slope, trust = slope_of(made, predicted)
    return (math.copysign(trust, slope), abs(slope)) if enough and trust > 0.0 else None


def _dive_findings(run: Run, stated: Stated) -> list[Note]:
    found = _depth_correlation(run)
    if found is None:
        return []
    trust, slope = found
    if trust > TRUSTED and not LEAST_DIVE < slope < MOST_DIVE:
        is_known_wrong = all(run.has(s) for s in ("x_m", "y_m")) and not goes_with_way(run)
        return [] if is_known_wrong else _dive_unit(slope, stated)
    if not goes_against_depth(run):
        return []
    message = (
        f"depth_m goes against what surge_m_s and pitch_rad make of it (correlation {trust:.2f}, limit {-TRUSTED:g}): "
        "nose up is positive, and depth downwards; set `sign: -1` at depth_m or pitch_rad"
    )
    return [Note("dive_sign", message, {"signal": "depth_m", "value": trust, "limit": -TRUSTED})]
