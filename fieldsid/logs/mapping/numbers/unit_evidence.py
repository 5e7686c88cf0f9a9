"""How the units of a log's signals are known: stated, by the size of the numbers, or because other signals agree with them.

An angle whose numbers go beyond a turn in rad, or jump by a turn where they wrap, tells its unit itself. A rate agrees with the
change of its angle, a speed with the way made by x and y and with the change of the depth, a heading with the course. What none
of these tells is assumed to be SI.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from fieldsid.logs.doctor.angle_and_rate import PAIRS, agrees_with_rate
from fieldsid.logs.doctor.course_findings import goes_along_course, goes_with_depth
from fieldsid.logs.doctor.pair_findings import goes_with_way
from fieldsid.logs.mapping.draft import place_of
from fieldsid.logs.run import SIGNALS, Note, Run

NEEDS_NONE = frozenset({"thrust", "thrust_ratio", "propeller_rpm"})
"""Signals whose scale no estimate hangs on."""


def assumed_units(run: Run, known: Collection[str], signals: Mapping[str, Any]) -> list[Note]:
    """Return the note on the signals of a run that are taken in SI though nothing says so; `known` have a unit that is told."""
    sure = {s for s in run.signals if s in known}
    if goes_with_way(run):
        sure |= {"x_m", "y_m", "surge_m_s"}
    if _all_there(run, "x_m", "y_m", "yaw_rad") and goes_along_course(run):
        sure.add("yaw_rad")
    agreeing = [{a, r} for a, r in PAIRS if _all_there(run, a, r) and agrees_with_rate(run, a, r)]
    if _all_there(run, "depth_m", "pitch_rad", "surge_m_s") and goes_with_depth(run):
        agreeing += [{"depth_m", "surge_m_s"}]
    sure |= {s for both in agreeing if both & sure for s in both}
    assumed = [s for s in run.signals if s in SIGNALS and run.has(s) and s not in sure and s not in NEEDS_NONE]
    shown = ", ".join(f"{s} from `{place_of(signals.get(s, {}))}` in {SIGNALS[s]}" for s in assumed)
    message = f"no name and no other signal tells the unit of what is taken as it is: {shown}; write `unit:` where it is another"
    return [Note("unit_assumed", message, {"signals": assumed})] if assumed else []


def _all_there(run: Run, *signals: str) -> bool:
    return all(run.has(s) for s in signals)
