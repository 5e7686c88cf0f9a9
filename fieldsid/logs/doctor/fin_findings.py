"""Findings on fins: an impossible range, a response that precedes the fin, a fin beyond its limit, a rolled vehicle."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from fieldsid.errors import DataError
from fieldsid.logs.channels import AXES
from fieldsid.logs.convert.conditioning import blocks_of
from fieldsid.logs.convert.servo_counts import servo_of
from fieldsid.logs.convert.units import DEGREE
from fieldsid.logs.doctor.stated import Stated
from fieldsid.logs.doctor.together import SURE, together
from fieldsid.logs.few_of import FEW
from fieldsid.logs.run import MEASURED_FIN, Note, Run
from fieldsid.logs.segments import MOVED
from fieldsid.numerics.arrays import FloatArray

WIDEST = 0.8
"""Deflection in rad (46 deg) that no fin of a vehicle reaches: a fin stalls at half of that."""
BEYOND = math.pi
"""Angle in rad that no fin, rudder or azimuth thruster exceeds: larger numbers are in another unit."""
BEFORE_S, AFTER_S = 0.5, 1.0
"""Times before and after a fin step over which the responses are compared. The fin must have been constant for their sum before
a step, so that the response to the previous step is over."""
EARLY = 0.15
"""Largest share of the response to a step that may precede it, as the remainder of earlier motion."""
FEWEST = 5
ONE_SIDED = 0.02
"""Largest deflection to the other side of a fin that goes to one side only, as a share of its largest one."""
OTHER_SIDE = 0.3
"""Smallest ratio of the turns to each side, at least two of them, at which a fin on one side turns a vehicle to both."""
ROLLED = math.acos(0.9)
"""Roll phi in rad at which the yaw rate of the body differs by a tenth from that of the heading: r = psi' cos(phi)."""


def fin_findings(run: Run, stated: Stated) -> list[Note]:
    """Return the findings on the fins and on the roll of a run."""
    found = []
    for (angle, rate), (fin, _) in AXES:
        if run.has(fin):
            found += [*_range_finding(run, fin), *_early_response(run, fin, rate), *_as_in_radians(run, angle, fin, stated)]
    return [*found, *_without_side(run, "yaw_rad", "rudder_rad"), *(_roll_finding(run) if run.has("roll_rad") else [])]


def _range_finding(run: Run, fin: str) -> list[Note]:
    largest = float(np.nanpercentile(np.abs(run[fin]), 99))
    if not WIDEST < largest <= 1.6:
        return []
    message = (
        f"{fin} reaches {largest:.3g} rad, {math.degrees(largest):.0f} deg (limit {WIDEST:g} rad): no fin does; where -1 .. 1 is "
        "its whole range, set `unit: 1`, with its largest angle in rad as `scale`"
    )
    return [Note("fin_range", message, {"signal": fin, "value": largest, "limit": WIDEST})]


def _as_in_radians(run: Run, angle: str, fin: str, stated: Stated) -> list[Note]:
    """Return the finding that an angle and its fin are stated in degrees, and neither goes further than numbers in rad do."""
    if not run.has(angle) or any(stated.units.get(s) != "deg" for s in (angle, fin)):
        return []
    largest, deflected = (float(np.nanmax(np.abs(run[s]))) / DEGREE for s in (angle, fin))
    if largest > (math.tau if angle == "yaw_rad" else 0.5 * math.pi) or not 0.0 < deflected <= WIDEST:
        return []
    message = (
        f"{fin} and {angle} are taken in deg, and reach {deflected:.3g} and {largest:.3g} deg only, as numbers in rad do: set "
        "`unit: rad` at both where they are, and `unit: rad/s` at the rate"
    )
    return [Note("unit", message, {"signal": fin, "value": deflected, "limit": WIDEST})]


def _without_side(run: Run, angle: str, fin: str) -> list[Note]:
    """Return the finding that a fin goes to one side only, and the vehicle turns to either one while it is there.

    The turns over the stretches with more than half of the largest deflection are compared. With a sign they have one side; in
    pitch they need not, as the stiffness turns the vehicle back.
    """
    both = together(run, fin, angle)
    if both is None:
        return []
    _, moves, turned = both
    largest = float(np.max(np.abs(moves)))
    if min(-float(np.min(moves)), float(np.max(moves))) > ONE_SIDED * largest or largest == 0.0:
        return []
    ends = np.diff(np.abs(moves) > 0.5 * largest, prepend=False, append=False).nonzero()[0].reshape(-1, 2)
    turns = np.array([turned[end - 1] - turned[start] for start, end in ends])
    of_side = [turns[side * turns > 0.0] for side in (-1.0, 1.0)]
    less, more = sorted(float(np.abs(t).sum()) for t in of_side)
    if min(t.size for t in of_side) < 2 or less < OTHER_SIDE * more:
        return []
    message = (
        f"{fin} goes to one side only, and {angle} turns to either one over its {turns.size} deflections: it is a size without "
        "its side, which another column may hold; give it its sign before the import"
    )
    return [Note("no_side", message, {"signal": fin, "value": less / more, "limit": OTHER_SIDE, "count": int(turns.size)})]


def refuse_no_angle(run: Run, fin: str) -> None:
    """Raise DataError where the numbers of a fin cannot be an angle in rad: a fit would succeed with b2 in an unknown unit."""
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


def _early_response(run: Run, fin: str, rate: str) -> list[Note]:
    """Return the finding that part of the mean response of the rate to fin steps precedes them: the fin is logged late."""
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
    response = float(np.mean(before + after))
    error = float(np.std(before, ddof=1)) / math.sqrt(at.size)
    share = float(np.mean(before)) / response if response != 0.0 else 0.0
    response_error = float(np.std(before + after, ddof=1)) / math.sqrt(at.size)
    is_clear = abs(float(np.mean(before))) > SURE * error and abs(response) > SURE * response_error
    if not is_clear or share <= EARLY:
        return []
    message = (
        f"{rate} answers before {fin} moves: {100 * share:.0f} % of its answer to {at.size} steps comes in the {BEFORE_S:g} s "
        f"before them (limit {100 * EARLY:.0f} %): the fin's clock is late"
    )
    return [Note("fin_late", message, {"signal": fin, "value": share, "limit": EARLY, "count": int(at.size)})]


def _steps(time: FloatArray, fin: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the times (k,) just before steps of a fin that was constant before them, and the sizes (k,) of the steps."""
    change = np.diff(fin)
    moved = np.flatnonzero(np.abs(change) > 1e-3 * float(np.ptp(fin)))
    if not moved.size:
        return np.zeros(0), np.zeros(0)
    still = np.diff(time[moved + 1], prepend=time[0])
    kept = moved[(np.abs(change[moved]) > MOVED * float(np.ptp(fin))) & (still > AFTER_S + BEFORE_S)]
    return time[kept], change[kept]


def _roll_finding(run: Run) -> list[Note]:
    seen = np.isfinite(run["roll_rad"])
    time, roll = run.time[seen], np.abs(run["roll_rad"][seen])
    share = float(np.mean((roll > ROLLED) & (roll < math.pi - ROLLED)))
    if share <= FEW or float(np.percentile(roll, 99)) > math.pi:
        return []
    message = (
        f"roll_rad is beyond {math.degrees(ROLLED):.0f} deg for {100 * share:.0f} % of the run (limit {100 * FEW:.0f} %): there "
        f"yaw and pitch answer to both fins, and no model of one axis holds{_upright_advice(time, roll)}"
    )
    return [Note("rolled", message, {"signal": "roll_rad", "value": share, "limit": FEW})]


def _upright_advice(time: FloatArray, roll: FloatArray) -> str:
    """Return the advice to use the longest stretch with a small roll; empty where there is none."""
    starts, behind = blocks_of(roll <= ROLLED)
    if not starts.size:
        return ""
    begin, end = max(zip(time[starts], time[behind - 1], strict=True), key=lambda part: part[1] - part[0])
    return f"; take the longest stretch without: `--from {begin:.2f} --to {end:.2f}`"


FIN_ZERO = math.radians(1.0)
"""The accuracy of a fin's zero in rad. Commands about a trim may exceed the limit by as much."""


def limit_findings(run: Run, fin_max_rad: Mapping[str, float]) -> list[Note]:
    """Return the findings that depend on the vehicle: fins beyond the limits (rad) given by signal."""
    return [note for fin, limit in fin_max_rad.items() for note in _limit_finding(run, fin, limit)]


def _limit_finding(run: Run, fin: str, limit: float) -> list[Note]:
    """Return the finding that a fin was measured or commanded beyond its limit (rad) for more than FEW of the run."""
    measured, stated = MEASURED_FIN.get(fin, fin), f"`{fin.removesuffix('_rad')}_max_rad` of vehicle.yaml"
    name = measured if run.has(measured) else fin
    if not run.has(name) or (share := _share_beyond(run, name, limit)) <= FEW:
        return []
    reach = float(np.nanmax(np.abs(run[name])))
    message = (
        f"{name} goes to {reach:.3g} rad, beyond the fin's limit of {limit:.3g} rad for {100 * share:.0f} % of the run (limit "
        f"{100 * FEW:.0f} %): "
    )
    data = {"signal": name, "value": share, "limit": FEW, "reach_rad": reach}
    if name == measured:
        return [Note("fin_limit", f"{message}correct {stated}", data)]
    advice = f"where the fin goes so far, correct {stated}; where it stopped, the log does not show it: log the measured fin"
    return [Note("saturated", message + advice, data)]


def _share_beyond(run: Run, name: str, limit: float) -> float:
    return float(np.mean(np.abs(run[name][np.isfinite(run[name])]) > limit + FIN_ZERO))


def share_beyond(run: Run, fin: str, limit: float) -> float:
    """Return the share of a run in which the command of a fin exceeds its limit (rad), so that the fin angle is unknown.

    The share is zero where the fin itself was measured.
    """
    return 0.0 if run.has(MEASURED_FIN.get(fin, fin)) else _share_beyond(run, fin, limit)
