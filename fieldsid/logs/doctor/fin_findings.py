"""Findings on fins and what follows them: a range no fin has, a motion that comes before the fin, a fin beyond its limit."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from fieldsid.errors import DataError
from fieldsid.logs.channels import AXES
from fieldsid.logs.convert.conditioning import blocks_of
from fieldsid.logs.convert.servo_counts import servo_of
from fieldsid.logs.doctor.holes import MOVED
from fieldsid.logs.doctor.together import SURE, together
from fieldsid.logs.run import Note, Run
from fieldsid.numerics.arrays import FloatArray

WIDEST = 0.8
"""Deflection in rad, 46 deg, that no fin of a vehicle has: the flow leaves it at half of that."""
BEYOND = math.pi
"""Deflection in rad that no fin, rudder or turning thruster reaches: such numbers are in another unit."""
BEFORE_S, AFTER_S = 0.5, 1.0
"""Times over which what moves before a step is set against what moves after it: so long the fin must have been still before,
for the last step's answer to be over."""
EARLY = 0.15
"""Share of the answer to a step that may come before it, by what is left of the motion before."""
FEWEST = 5
ROLLED = math.acos(0.9)
"""Roll in rad from which on the rate about the body's axis is a tenth off that of the heading: r = psi' cos(phi)."""


def fin_findings(run: Run) -> list[Note]:
    """Return the findings on the fins of a run, and on the roll under which they were used."""
    found = []
    for (_, rate), (fin, _) in AXES:
        if run.has(fin):
            found += [*_range(run, fin), *_early(run, fin, rate)]
    return [*found, *(_roll(run) if run.has("roll_rad") else [])]


def _range(run: Run, fin: str) -> list[Note]:
    largest = float(np.nanpercentile(np.abs(run[fin]), 99))
    if not WIDEST < largest <= 1.6:
        return []
    message = (
        f"{fin} reaches {largest:.3g} rad, {math.degrees(largest):.0f} deg (limit {WIDEST:g} rad): no fin does; where -1 .. 1 is "
        "its whole range, set `unit: 1`, with its largest angle in rad as `scale`"
    )
    return [Note("fin_range", message, {"signal": fin, "value": largest, "limit": WIDEST})]


def refuse_no_angle(run: Run, fin: str) -> None:
    """Raise DataError where a fin's numbers (rad) are none of an angle: a fit would go through, its authority in no unit."""
    values = run[fin][np.isfinite(run[fin])]
    if not float(np.abs(values).max(initial=0.0)) > BEYOND or not float(np.percentile(np.abs(values), 99)) > BEYOND:
        return
    servo = servo_of(values)
    unit = "its unit, probably `unit: deg`" if servo is None else f"`unit: counts` and `centre: {servo.centre:g}`"
    raise DataError(
        f"`{fin}` of run {run.name!r} is no angle in rad: no fin turns by {np.max(np.abs(values)):.4g} rad",
        found=f"{values.min():.4g} to {values.max():.4g} rad (limit {BEYOND:.3g} rad)",
        hint=f"set {unit} at `{fin}` in the mapping, and import the log again",
    )


def _early(run: Run, fin: str, rate: str) -> list[Note]:
    """The mean answer of the rate about steps of the fin: what comes before the step cannot be its answer."""
    both = together(run, fin, rate)
    if both is None:
        return []
    time, moves, answer = both
    at, size = _steps(time, moves)
    inside = (at > time[0] + BEFORE_S) & (at < time[-1] - AFTER_S)
    at, side = at[inside], np.sign(size[inside])
    if at.size < FEWEST:
        return []
    value = np.interp(at, time, answer)
    before = side * (value - np.interp(at - BEFORE_S, time, answer))
    after = side * (np.interp(at + AFTER_S, time, answer) - value)
    whole = float(np.mean(before + after))
    error = float(np.std(before, ddof=1)) / math.sqrt(at.size)
    share = float(np.mean(before)) / whole if whole != 0.0 else 0.0
    of_whole = float(np.std(before + after, ddof=1)) / math.sqrt(at.size)
    is_clear = abs(float(np.mean(before))) > SURE * error and abs(whole) > SURE * of_whole
    if not is_clear or share <= EARLY:
        return []
    message = (
        f"{rate} answers before {fin} moves: {100 * share:.0f} % of its answer to {at.size} steps comes in the {BEFORE_S:g} s "
        f"before them (limit {100 * EARLY:.0f} %): the fin's clock is late"
    )
    return [Note("fin_late", message, {"signal": fin, "value": share, "limit": EARLY, "count": int(at.size)})]


def _steps(time: FloatArray, fin: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the last times before steps of a fin, and their sizes (k,), of those before which it was still."""
    change = np.diff(fin)
    moved = np.flatnonzero(np.abs(change) > 1e-3 * float(np.ptp(fin)))
    if not moved.size:
        return np.zeros(0), np.zeros(0)
    still = np.diff(time[moved + 1], prepend=time[0])
    kept = moved[(np.abs(change[moved]) > MOVED * float(np.ptp(fin))) & (still > AFTER_S + BEFORE_S)]
    return time[kept], change[kept]


def _roll(run: Run) -> list[Note]:
    seen = np.isfinite(run["roll_rad"])
    time, roll = run.time[seen], np.abs(run["roll_rad"][seen])
    share = float(np.mean((roll > ROLLED) & (roll < math.pi - ROLLED)))
    if share <= 0.05 or float(np.percentile(roll, 99)) > math.pi:
        return []
    message = (
        f"roll_rad is beyond {math.degrees(ROLLED):.0f} deg for {100 * share:.0f} % of the run (limit 5 %): there yaw and pitch "
        f"answer to both fins, and no model of one axis holds{_upright(time, roll)}"
    )
    return [Note("rolled", message, {"signal": "roll_rad", "value": share, "limit": 0.05})]


def _upright(time: FloatArray, roll: FloatArray) -> str:
    """Return the advice to take the longest stretch between rolls of this size; nothing where there is none."""
    starts, behind = blocks_of(roll <= ROLLED)
    if not starts.size:
        return ""
    begin, end = max(zip(time[starts], time[behind - 1], strict=True), key=lambda part: part[1] - part[0])
    return f"; take the longest stretch without: `--from {begin:.2f} --to {end:.2f}`"


BEYOND_SHARE = 0.05
"""Share of a run in which a command may be beyond the fin's limit."""
FIN_ZERO = 0.0175
"""One degree, in rad: a fin's zero is not rigged better. Commands about a trim reach so far beyond the limit; a smaller offset
is not counted on, nor against."""


def limit_findings(run: Run, fin_max_rad: Mapping[str, float]) -> list[Note]:
    """Return the findings on a run that hang on its vehicle: fins beyond the limits (rad) given for their signals."""
    return [note for fin, limit in fin_max_rad.items() for note in _beyond(run, fin, limit)]


def _beyond(run: Run, fin: str, limit: float) -> list[Note]:
    """Return that a fin was measured, or commanded for long, beyond its limit (rad)."""
    measured, stated = f"{fin.removesuffix('_rad')}_measured_rad", f"`{fin.removesuffix('_rad')}_max_rad` of vehicle.yaml"
    name = measured if run.has(measured) else fin
    if not run.has(name) or (share := _share(run, name, limit)) <= BEYOND_SHARE:
        return []
    reach = float(np.nanmax(np.abs(run[name])))
    message = (
        f"{name} goes to {reach:.3g} rad, beyond the fin's limit of {limit:.3g} rad for {100 * share:.0f} % of the run (limit "
        f"{100 * BEYOND_SHARE:.0f} %): "
    )
    data = {"signal": name, "value": share, "limit": BEYOND_SHARE, "reach_rad": reach}
    if name == measured:
        return [Note("fin_limit", f"{message}correct {stated}", data)]
    advice = f"where the fin goes so far, correct {stated}; where it stopped, the log does not show it: log the measured fin"
    return [Note("saturated", message + advice, data)]


def _share(run: Run, name: str, limit: float) -> float:
    return float(np.mean(np.abs(run[name][np.isfinite(run[name])]) > limit + FIN_ZERO))


def share_beyond(run: Run, fin: str, limit: float) -> float:
    """Return the share of a run in which a fin's command is beyond its limit (rad); one that is at it shows where the fin is.

    Nothing is hidden where the fin itself was measured.
    """
    if run.has(f"{fin.removesuffix('_rad')}_measured_rad") or fin.endswith("_measured_rad"):
        return 0.0
    return _share(run, fin, limit)
