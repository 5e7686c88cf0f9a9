"""One look at a live estimate as plain values: what `sysid live --json` prints a line, and the sentence that leads it."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite, pi
from types import MappingProxyType
from typing import Any

from fieldsid.artifacts import plain
from fieldsid.models.axis import NAMES, Axis
from fieldsid.online.estimate import OnlineEstimate
from fieldsid.online.progress import LOOK_BACK_S, ParameterProgress, Progress

SCHEMA = "fieldsid/live/1"
NOTHING_BESIDE: Mapping[str, Any] = MappingProxyType({"gains": None, "diagnosed": None})
LONGEST_GUESS_S = 3600.0
"""A time to the goal beyond which it is not told: the pace of a few seconds says nothing of hours."""


def look_body(
    now: OnlineEstimate,
    progress: Progress,
    *,
    source: str,
    goals_from: str,
    unreadable: int,
    then: str,
    beside: Mapping[str, Any] = NOTHING_BESIDE,
) -> dict[str, Any]:
    """Return a look as nested plain values, with what was worked out `beside` the estimate; NaN as None."""
    bands, units = now.intervals95, units_of(now.axis)
    body = {
        "schema": SCHEMA,
        "axis": now.axis.value,
        "source": source,
        "time_s": now.time,
        "verdict": progress.verdict,
        "said": said(progress),
        "share": progress.share,
        "limited_by": progress.limited_by,
        "left_s": progress.left_s,
        "goals_from": goals_from,
        "speed_m_s": now.speed,
        "samples": now.used,
        "excitation": {"fin_rms_rad": progress.fin_rms, "rate_rms_rad_s": progress.rate_rms},
        "parameters": {
            p.name: {
                "value": p.value,
                "std_error": p.std_error,
                "interval95": list(bands[p.name]),
                "unit": units[p.name],
                "goal_std_error": p.goal,
                "share": p.share,
                "settled": p.is_settled,
            }
            for p in progress.parameters
        },
        "authority_jump": None
        if now.jump is None
        else {"since_s": now.jump.time, "factor": now.jump.factor, "std_error": now.jump.std_error},
        "counts": {**now.counts, "unreadable": unreadable},
        "next": then,
        **beside,
    }
    out: dict[str, Any] = plain(body)
    return out


def units_of(axis: Axis) -> Mapping[str, str]:
    """Return the units of an axis' base parameters."""
    names = NAMES[axis]
    stiff = {} if names.stiffness is None else {names.stiffness: "1/s^2"}
    return {names.damping: "1/s", **stiff, names.authority: "1/s^2", names.trim: "rad/s^2"}


def said(progress: Progress) -> str:
    """Return the verdict in one sentence, its number first."""
    wanted = [p for p in progress.parameters if isfinite(p.goal)]
    share = f"{100.0 * progress.share:.0f} % of the data"
    match progress.verdict:
        case "starting":
            return "0 % of the data: no estimate yet"
        case "contradicts":
            return f"0 % of the data can be used: {progress.contradiction}"
        case "enough":
            known = ", ".join(_known(p) for p in wanted)
            return f"enough data, come up: {known}; settled for {LOOK_BACK_S:.0f} s"
        case "moving":
            still = ", ".join(p.name for p in wanted if not p.is_settled)
            return f"{share}, but {still} still moving: go on for {LOOK_BACK_S:.0f} s"
        case "not_excited":
            return f"{share}, and the fin is still ({progress.fin_rms * 180.0 / pi:.1f} deg rms): move it; {_last(progress)}"
    left = progress.left_s
    pace = f", about {left:.0f} s more as it is flown now" if isfinite(left) and left < LONGEST_GUESS_S else ""
    return f"{share}{pace}: {_last(progress)}"


def _last(progress: Progress) -> str:
    (p,) = (p for p in progress.parameters if p.name == progress.limited_by)
    return f"{_known(p)}, wanted {_share(p.goal, p.value)}" if isfinite(p.std_error) else f"nothing is known of {p.name} yet"


def _known(p: ParameterProgress) -> str:
    return f"{p.name} to {_share(p.std_error, p.value)}"


def _share(error: float, value: float) -> str:
    """Return an error in per cent of a value, as it is where the value may be zero."""
    if not isfinite(error):
        return "nothing yet"
    return f"{100.0 * error / abs(value):.1f} %" if value and error < 0.5 * abs(value) else f"+/- {error:.2g}"
