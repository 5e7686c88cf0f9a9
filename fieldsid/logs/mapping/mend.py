"""What the doctor's findings on a log say of the mapping that was proposed for it: units, signs and frames that are set.

Each is one step, after which the log is read again: a heading that is turned may leave its rate against it. Which of two
signals is wrong, where a finding says only that they go against each other, is told by what is surer: a rate is turned to its
angle, an angle to a course over ground that is known to be north and east, a depth below the surface is positive.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping
from typing import Any

import numpy as np

from fieldsid.logs.channels import POSITION
from fieldsid.logs.doctor.fin_findings import WIDEST
from fieldsid.logs.mapping.name_words import words_of
from fieldsid.logs.mapping.numbers.true_north import GEOGRAPHIC
from fieldsid.logs.run import Note, Run

ANGLES_BESIDE = ("rudder_rad", "elevator_rad", "rudder_measured_rad", "elevator_measured_rad", "pitch_rad", "roll_rad")


def mended(body: dict[str, Any], run: Run, findings: Iterable[Note], by_size: Container[str] = ()) -> list[Note]:
    """Set in a mapping's body what findings on the run it gives say; return what was set and why, none where nothing was.

    `by_size` holds the signals that were taken for degrees because their numbers are large.
    """
    signals = body["signals"]
    done: list[Note] = []
    for note in findings:
        signal = note.data.get("signal", "")
        if note.code == "unit" and signal == "yaw_rate_rad_s" and "yaw_rad" in by_size and _counts_turns(signals, run):
            del signals["yaw_rad"]["unit"]
            done.append(_evidence("yaw_rad", "no unit, as rad that count turns", note))
        elif (
            note.code in ("unit", "speed_unit", "depth_unit")
            and "unit" in note.data
            and "unit" not in signals.get(signal, {"unit": 0})
        ):
            signals[signal]["unit"] = note.data["unit"]
            done.append(_evidence(signal, f"`unit: {note.data['unit']}`", note))
        elif note.code in ("rate_sign", "speed_sign") and _turn(signals, signal):
            done.append(_evidence(signal, "`sign: -1`", note))
        elif note.code == "dive_sign":
            wrong = "depth_m" if float(np.nanmedian(run["depth_m"])) < 0.0 else "pitch_rad"
            done += [_evidence(wrong, "`sign: -1`", note)] if _turn(signals, wrong) else []
        elif note.code == "course_against":
            turned = _turned_world(body, signals)
            done += [_evidence(turned[0], f"`frame: ENU` at {' and '.join(turned)}", note)] if turned else []
    return done


def _counts_turns(signals: Mapping[str, Any], run: Run) -> bool:
    """Whether a heading of more than a turn that goes with its rate number for number is in rad, not both in degrees.

    It is where the rate's unit is known, and where the other angles of the log are in rad: one logger wrote them.
    """
    if "unit" not in signals.get("yaw_rad", {}):
        return False
    others = [s for s in ANGLES_BESIDE if s in signals and "unit" not in signals[s] and run.has(s)]
    largest = max((float(np.nanpercentile(np.abs(run[s]), 99)) for s in others), default=np.inf)
    return "unit" in signals.get("yaw_rate_rad_s", {}) or largest < WIDEST


def _evidence(signal: str, what: str, note: Note) -> Note:
    return Note("evidence", f"{signal} is taken with {what}: {note.message}", {"signal": signal, "finding": note.code})


def _turn(signals: Mapping[str, Any], signal: str) -> bool:
    """Turn the sign of a signal once; return whether it was."""
    item = signals.get(signal)
    if item is None or "sign" in item:
        return False
    item["sign"] = -1
    return True


def _turned_world(body: Mapping[str, Any], signals: Mapping[str, Any]) -> tuple[str, ...]:
    """Say of a table that its heading counts from east where its way is known to be north and east, else that its x is east."""
    if "frame" in body or "yaw_rad" not in signals:
        return ()
    known = POSITION in signals or any(GEOGRAPHIC & set(words_of(str(signals[s].get("column")))) for s in ("x_m", "y_m"))
    turned = ("yaw_rad",) if known else ("x_m", "y_m")
    if any("frame" in signals[s] for s in turned):
        return ()
    for signal in turned:
        signals[signal]["frame"] = "ENU"
    return turned
