"""The test of a drafted mapping on the log: degrees are set by the size of numbers, then the findings on the run are applied.

Each finding that sets a unit, a sign or a frame is one step, after which the log is read again: a heading with a new sign may
contradict its rate. Where a finding says only that two signals contradict each other, the less certain one is corrected: a rate
is corrected to agree with its angle, an angle to agree with a course over ground that is known to be north and east, and a depth
below the surface is positive.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fieldsid.errors import FieldsidError
from fieldsid.logs.channels import POSITION, ChannelMap
from fieldsid.logs.convert.heading_unwrap import FASTEST_RAD_S
from fieldsid.logs.convert.times.time_column import units_of_step
from fieldsid.logs.convert.units import DEGREE, UNITS, find_unit
from fieldsid.logs.doctor.angle_and_rate import agrees_with_rate, fastest_turn
from fieldsid.logs.doctor.fin_findings import WIDEST
from fieldsid.logs.mapping.canonical_names import unit_in_name, words_of
from fieldsid.logs.mapping.draft import place_of
from fieldsid.logs.mapping.numbers.true_heading import GEOGRAPHIC
from fieldsid.logs.mapping.numbers.unit_inference import (
    MOST_TURNS,
    assumed_units,
    heading_in_doubt,
    set_by_size,
    unit_of_wraps,
)
from fieldsid.logs.mapping.vocabulary import TIME
from fieldsid.logs.reader import Inventory, RawLog, Reader, ReadOptions
from fieldsid.logs.run import FINS, RATE_OF, SIGNALS, Note, Run

CORRECTED = ("unit", "sign", "frame")
"""The keys of a signal that findings correct."""


@dataclass(frozen=True, slots=True)
class Log:
    """A log with its inventory, its reader and the options; it is read with salvage."""

    inventory: Inventory
    reader: Reader
    options: ReadOptions

    def read(self, mapping: ChannelMap) -> RawLog:
        """Return the signals that a mapping names; raises LogError and MappingError."""
        lenient = ReadOptions(self.options.msg_path, salvage=True, joined=self.options.joined)
        return self.reader.read(self.inventory.path, mapping, lenient)

    def run_of(self, body: Mapping[str, Any], raw: RawLog | None = None) -> Run:
        """Return the run that a mapping's body gives, from `raw` where given; raises LogError, MappingError and DataError."""
        from fieldsid.logs.convert.assemble import assemble
        from fieldsid.logs.mapping.mapping_file import mapping_of

        mapping = mapping_of(body)
        raw = self.read(mapping) if raw is None else raw
        return assemble(raw, mapping, self.inventory.path, ReadOptions(salvage=True), max_gap_s=float("inf"))


@dataclass(frozen=True, slots=True)
class Proposal:
    """The body of a mapping, the Run it gives or the error that prevents one, and notes on its choices."""

    body: dict[str, Any]
    run: Run | None = None
    problem: FieldsidError | None = None
    notes: tuple[Note, ...] = ()

    def saying(self, *notes: Note) -> Proposal:
        """Return the proposal with the given notes placed before its notes."""
        return replace(self, notes=(*notes, *self.notes))


def tried(log: Log, body: dict[str, Any], defined: frozenset[str]) -> Proposal:
    """Read the log with a mapping's body, and set in it what the numbers show; raises LogError, MappingError and DataError."""
    from fieldsid.logs.doctor.examine import examine
    from fieldsid.logs.doctor.stated import stated_by
    from fieldsid.logs.mapping.mapping_file import mapping_of

    raw, signals = log.read(mapping_of(body)), body["signals"]
    numeric_series = {s: v for s, v in raw.series.items() if s in signals and v.values.ndim == 1}
    stated_units = {s: v.unit for s, v in numeric_series.items() if v.unit is not None}
    by_size = set_by_size(signals, {s: v.values for s, v in numeric_series.items()}, stated_units)
    yaw = raw.series.get("yaw_rad")
    wraps = None if yaw is None else unit_of_wraps(yaw.values)
    in_doubt = by_size if wraps is None else by_size - {"yaw_rad"}
    why: list[Note] = []
    for _ in range(len(CORRECTED) * len(signals) + 2):  # each reading but the last corrects a key at least, or the time
        run, stated = log.run_of(body, raw), stated_by(mapping_of(body), raw)
        notes = examine(run, stated=replace(stated, time=None) if by_size & {*RATE_OF.values()} else stated)
        if retimed := _unit_of_time(log, body, notes):
            raw, corrections = log.read(mapping_of(body)), retimed
        else:
            corrections = mended(body, run, notes, in_doubt)
        why += corrections
        if not corrections:
            break
    why += _open_unit_of_time(log, body, run)
    if yaw is not None and "yaw_rad" in by_size and "unit" in signals["yaw_rad"]:
        why += heading_in_doubt(yaw.values, signals)
    # the size of a rate shows that it is not in rad/s; its unit follows from the comparison with its angle
    open_rates = {rate for angle, rate in RATE_OF.items() if rate in by_size and run.has(angle)}
    known = {*defined, *stated.units, *({"yaw_rad"} if wraps == "rad" else ())} - open_rates
    why += assumed_units(run, known, {s: (place_of(item), item.get("unit", SIGNALS.get(s, ""))) for s, item in signals.items()})
    return Proposal(body, replace(run, notes=(*run.notes, *notes)), notes=tuple(why))


def _unit_of_time(log: Log, body: dict[str, Any], findings: Iterable[Note]) -> list[Note]:
    """Set the unit that findings show for a time whose column states none; return the note on it, none where nothing was set."""
    time = body.get("time", {})
    found = next((n for n in findings if "time_unit" in n.data), None)
    if found is None or not _states_no_unit(log, time) or time.get("unit", "s") == found.data["time_unit"]:
        return []
    time["unit"] = found.data["time_unit"]
    seen = found.message.partition(": ")[0]
    return [Note("evidence", f"time is taken with `unit: {time['unit']}`: {seen}", {"signal": TIME, "finding": found.code})]


def _states_no_unit(log: Log, time: Mapping[str, Any]) -> bool:
    names = {name: c for i, c in enumerate(log.inventory.channels) for name in (c.name, i)}
    column = names.get(time.get("column", ""))
    return column is not None and unit_in_name(column.name, TIME, column.unit) is None


def _open_unit_of_time(log: Log, body: Mapping[str, Any], run: Run) -> list[Note]:
    """Return the note that a time in whole numbers, whose column states no unit, may be in several; none where one is left.

    In each the step is plausible, and no angle turns faster than a vehicle; an angle that agrees with its rate leaves one unit.
    """
    time = body.get("time", {})
    own = find_unit(time.get("unit", "s"), "time")
    if own is None or not _states_no_unit(log, time) or any(agrees_with_rate(run, *pair) for pair in RATE_OF.items()):
        return []
    counted, fastest = run.time / own.factor, fastest_turn(run) * own.factor
    if not np.array_equal(np.round(counted, 6), np.round(counted)):
        return []
    step = float(np.median(np.diff(counted)))
    turns = {unit: fastest / UNITS[unit].factor for unit in units_of_step(step)}
    readings = [
        f"{step * UNITS[u].factor:g} s a sample and {turn:.2g} rad/s at most in {u}"
        for u, turn in turns.items()
        if turn <= FASTEST_RAD_S
    ]
    if len(readings) < 2:
        return []
    message = f"`{time['column']}` states no unit, and nothing tells it: {', or '.join(readings)}; set `unit` at time"
    return [Note("time_unit", message, {"signal": TIME, "value": step, "limit": FASTEST_RAD_S})]


OTHER_ANGLES = (*FINS, "pitch_rad", "roll_rad")


def mended(body: dict[str, Any], run: Run, findings: Iterable[Note], by_size: Container[str]) -> list[Note]:
    """Set the corrections of the findings on a run in its mapping's body; return a note for each, none where nothing was set.

    `by_size` holds the signals that were assumed to be in degrees because their numbers are large.
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
        wrong, key, value = _correction(note, body, run)
        if wrong and not any(key in signals.get(s, {key: 0}) for s in wrong):
            for signal in wrong:
                signals[signal][key] = value
            done.append(_evidence(wrong, f"`{key}: {value}`{' at ' + ' and '.join(wrong) if key == 'frame' else ''}", note))
    return done


def _correction(note: Note, body: Mapping[str, Any], run: Run) -> tuple[list[str], str, Any]:
    """Return the signals that a finding shows to be read wrongly, and the key and value that correct them."""
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
    """Return whether a finding shows that a heading beyond 2 pi is in rad and counts turns.

    Either its course turns by as much in rad, or its rate agrees with it in rad. The second counts only where the unit of the
    rate is known or the other angles of the log are in rad, since one logger wrote them all; and only where there would be few
    turns: degrees beside a rate in degrees per minute disagree nearly as rad beside degrees per second do.
    """
    if "unit" not in signals.get("yaw_rad", {}):
        return False
    if note.code == "course_slope":
        return note.data.get("unit") == "rad"
    others = [s for s in OTHER_ANGLES if s in signals and "unit" not in signals[s] and run.has(s)]
    largest = max((float(np.nanpercentile(np.abs(run[s]), 99)) for s in others), default=np.inf)
    is_rate = note.code == "unit" and note.data["signal"] == "yaw_rate_rad_s" and "signals" in note.data
    turns = float(np.nanpercentile(np.abs(run["yaw_rad"]), 99)) / (DEGREE * math.tau)
    return is_rate and turns <= MOST_TURNS and ("unit" in signals.get("yaw_rate_rad_s", {}) or largest < WIDEST)


def _evidence(signals: list[str], what: str, note: Note) -> Note:
    """Return the note on a correction with what the finding saw, without its advice, which is followed now."""
    seen = note.message.partition(": ")[0]
    return Note("evidence", f"{signals[0]} is taken with {what}: {seen}", {"signal": signals[0], "finding": note.code})
