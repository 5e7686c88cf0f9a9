"""Findings on signals that must agree: a speed and the way made, a command and its fin."""

from __future__ import annotations

import numpy as np

from fieldsid.logs.convert.units import factor_to, unit_of_ratio
from fieldsid.logs.doctor.angle_and_rate import LAG_S, TRUSTED
from fieldsid.logs.doctor.stated import Stated
from fieldsid.logs.doctor.together import FEWEST, over, together, width_of
from fieldsid.logs.run import Note, Run
from fieldsid.numerics.shifted_correlation import lag_of, slope_of
from fieldsid.numerics.trapezoid import trapezoid_integral

SPEEDS = {unit: factor_to("surge_m_s", unit) for unit in ("kn", "mph", "km/h", "ft/s", "cm/s", "mm/s")}
"""Units in which a speed is logged, in m/s."""
LEAST_WAY, MOST_WAY = 0.6, 1.5
"""How many times the speed the way made in a second may be: a current and a slip lie between."""
SLOWEST = 0.1
SLOW_RPM = 30.0
MOST_ADVANCE_M = 4.0
"""Way made in a turn of a propeller that is larger than any this program's vehicles have."""
_FINS = (("rudder_rad", "rudder_measured_rad"), ("elevator_rad", "elevator_measured_rad"))


def pair_findings(run: Run, stated: Stated) -> list[Note]:
    """Return the findings on pairs of signals of a run."""
    of_fins = [note for command, fin in _FINS for note in _command_and_fin(run, command, fin, stated)]
    return [*_speed_and_way(run, stated), *_speed_and_turns(run), *of_fins]


def _speed_and_way(run: Run, stated: Stated) -> list[Note]:
    """The way made over five seconds against the speed; a current may change it, a unit changes it more."""
    ratio = _way_by_speed(run)
    if ratio is None or LEAST_WAY < ratio < MOST_WAY:
        return []
    unit = unit_of_ratio(ratio, SPEEDS) if stated.is_si("surge_m_s") else None
    advice = (
        f"{unit} is {factor_to('surge_m_s', unit):.3g} m/s: set `unit: {unit}` at surge_m_s"
        if unit
        else "check the unit of speed"
    )
    message = f"the way made is {ratio:.3g} times what surge_m_s says (limits {LEAST_WAY:g} and {MOST_WAY:g}): {advice}"
    data = {"signal": "surge_m_s", "value": ratio, "limit": MOST_WAY} | ({"unit": unit} if unit else {})
    return [Note("speed_unit", message, data)]


def goes_with_way(run: Run) -> bool:
    """Whether the way made by x and y is that of the speed."""
    ratio = _way_by_speed(run)
    return ratio is not None and LEAST_WAY < ratio < MOST_WAY


def _way_by_speed(run: Run) -> float | None:
    """Return how many times the speed the way made in a second is; None where there is too little of either."""
    seen = together(run, "x_m", "y_m", "surge_m_s")
    if seen is None or seen[0].size <= 2 * (width := width_of(seen[0], 5.0)):
        return None
    time, x, y, surge = seen
    made = np.hypot(over(x, width), over(y, width)) / over(time, width)
    said = np.abs(over(trapezoid_integral(time, surge), width)) / over(time, width)
    # In a turn the straight way is shorter than the path, so the fastest windows decide.
    fast = float(np.percentile(said, 90))
    return float(np.percentile(made, 90)) / fast if fast > SLOWEST else None


def _speed_and_turns(run: Run) -> list[Note]:
    """The way made in a turn of the propeller: a few tenths of a metre, whatever its slip."""
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
    late, gain = lag_of(a, b, min(round(LAG_S / step), a.size // 4))
    lag = late * step
    if lag < -1.5 * step and gain > 0.002:
        message = (
            f"{fin} moves {-lag:.3f} s before its command (limit {1.5 * step:.3g} s): their clocks differ"
            f"{stated.stamps(command, fin)}"
        )
        found.append(Note("clock_offset", message, {"signal": fin, "value": lag, "limit": -1.5 * step}))
    return found
