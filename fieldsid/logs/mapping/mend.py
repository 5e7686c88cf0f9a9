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
    signals, done = body["signals"], list[Note]()
    for note in findings:
        if "yaw_rad" in by_size and _counts_turns(note, signals, run):
            del signals["yaw_rad"]["unit"]
            done.append(_evidence(["yaw_rad"], "no unit, as rad that count turns", note))
            continue
        if (goes_as := note.data.get("goes_as")) is not None and note.data["signal"] in by_size:
            signals[note.data["signal"]]["unit"] = goes_as
            done.append(_evidence([note.data["signal"]], f"`unit: {goes_as}`", note))
            continue
        wrong, key, value = _remedy(note, body, run)
        if wrong and not any(key in signals.get(s, {key: 0}) for s in wrong):
            for signal in wrong:
                signals[signal][key] = value
            done.append(_evidence(wrong, f"`{key}: {value}`{' at ' + ' and '.join(wrong) if key == 'frame' else ''}", note))
    return done


def _remedy(note: Note, body: Mapping[str, Any], run: Run) -> tuple[list[str], str, Any]:
    """Return the signals that a finding shows to be read wrongly, and the key and value that mend it; none where it does not."""
    if note.code in ("unit", "speed_unit", "depth_unit", "course_slope"):
        return [note.data["signal"]] if "unit" in note.data else [], "unit", note.data.get("unit")
    if note.code in ("rate_sign", "speed_sign"):
        return [note.data["signal"]], "sign", -1
    if note.code == "dive_sign":
        return ["depth_m" if float(np.nanmedian(run["depth_m"])) < 0.0 else "pitch_rad"], "sign", -1
    if note.code == "course_against" and "frame" not in body and "yaw_rad" in body["signals"]:
        columns = [body["signals"].get(s, {}).get("column") for s in ("x_m", "y_m")]
        known = POSITION in body["signals"] or any(GEOGRAPHIC & set(words_of(str(c))) for c in columns)
        return ["yaw_rad"] if known else ["x_m", "y_m"], "frame", "ENU"
    return [], "", None


def _counts_turns(note: Note, signals: Mapping[str, Any], run: Run) -> bool:
    """Whether a finding shows that a heading of more than a turn is in rad, as its course turns or number for number as its rate.

    The latter is so where the rate's unit is known, and where the other angles of the log are in rad: one logger wrote them.
    """
    if "unit" not in signals.get("yaw_rad", {}):
        return False
    if note.code == "course_slope":
        return note.data.get("unit") == "rad"
    others = [s for s in ANGLES_BESIDE if s in signals and "unit" not in signals[s] and run.has(s)]
    largest = max((float(np.nanpercentile(np.abs(run[s]), 99)) for s in others), default=np.inf)
    is_rate = note.code == "unit" and note.data["signal"] == "yaw_rate_rad_s"
    return is_rate and ("unit" in signals.get("yaw_rate_rad_s", {}) or largest < WIDEST)


def _evidence(signals: list[str], what: str, note: Note) -> Note:
    return Note("evidence", f"{signals[0]} is taken with {what}: {note.message}", {"signal": signals[0], "finding": note.code})
