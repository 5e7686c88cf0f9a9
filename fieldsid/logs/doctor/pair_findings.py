"""Findings on signals that must agree: a speed and the way made, a command and its fin."""

from __future__ import annotations

import numpy as np

from fieldsid.logs.convert.units import KNOT
from fieldsid.logs.doctor.angle_and_rate import LAG_S, TRUSTED
from fieldsid.logs.doctor.stated import Stated
from fieldsid.logs.run import Note, Run
from fieldsid.numerics.shifted_correlation import lag_of, slope_of
from fieldsid.numerics.trapezoid import trapezoid_integral

KNOT_LIMIT = 0.15
"""By how much of itself the ratio of way and speed may be off a knot's, and the speed still be in knots."""
_FINS = (("rudder_rad", "rudder_measured_rad"), ("elevator_rad", "elevator_measured_rad"))


def pair_findings(run: Run, stated: Stated) -> list[Note]:
    """Return the findings on pairs of signals of a run."""
    found: list[Note] = []
    if all(run.has(s) for s in ("surge_m_s", "x_m", "y_m")):
        found += _speed_and_way(run, stated)
    for command, fin in _FINS:
        if run.has(command) and run.has(fin):
            found += _command_and_fin(run, command, fin, stated)
    return found


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
    in_knots = stated.is_si("surge_m_s") and abs(ratio / KNOT - 1.0) < KNOT_LIMIT
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
