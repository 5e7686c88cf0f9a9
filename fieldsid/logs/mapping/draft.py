"""What a mapping may be before the log is read with it: the surest guess for each signal, and what the numbers of a table say."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fieldsid.logs.channels import ANGLES, ATTITUDE, POSITION, Source
from fieldsid.logs.convert.servo_counts import COUNTED, COUNTS, FINS, Servo, servo_of
from fieldsid.logs.mapping.guesses import Guess, of_column, of_topic, quaternion_of
from fieldsid.logs.mapping.name_words import words_of
from fieldsid.logs.mapping.numbers.recognise import recognised, unit_of_heading
from fieldsid.logs.mapping.numbers.true_north import true_north
from fieldsid.logs.mapping.vocabulary import LATITUDE, LONGITUDE
from fieldsid.logs.mapping.word_meaning import meaning_of
from fieldsid.logs.reader import TABLE, Inventory, Samples
from fieldsid.logs.run import SIGNALS, Note
from fieldsid.numerics.arrays import FloatArray

SCHEMA = "fieldsid/mapping/1"
REP103, NED = "ENU/FLU", "NED/FRD"
GLIDER_CLOCK, GLIDER_SENSORS = "m_present_time", ("m_", "c_")
"""The clock of a glider's table, and how the sensors begin that are measured or commanded: others are settings and sums."""
_MESSAGE_PATH = re.compile(r"\bheader\.|\bpose\.pose\.|\btwist\.twist\.|\borientation\.[xyzw]$")
"""What columns are called that were written from messages, which are in the frames of REP 103."""
NORTH_EAST_DOWN = ("ned", "px")
"""Words of topics whose frames are others: of one called so, and of PX4's."""
OTHER_HEADINGS = 4
"""Headings beside the surest that are tried."""
LARGEST = {"yaw_rad": 6.4, "pitch_rad": 1.6, "roll_rad": 3.3, "yaw_rate_rad_s": 4.0, "pitch_rate_rad_s": 4.0,
           "roll_rate_rad_s": 8.0, "yaw_goal_rad": 6.4, "pitch_goal_rad": 1.6,
           "rudder_rad": 1.6, "elevator_rad": 1.6, "rudder_measured_rad": 1.6,
           "elevator_measured_rad": 1.6}  # fmt: skip
"""Angles and rates larger than this are taken for degrees."""


@dataclass(frozen=True, slots=True)
class Draft:
    """A mapping's body, why it is that, the signals whose unit the format defines, and lines of other headings."""

    body: dict[str, Any]
    notes: tuple[Note, ...]
    defined: frozenset[str]
    headings: tuple[dict[str, Any], ...] = ()


def draft_of(inventory: Inventory) -> Draft:
    """Return what is to be tried on a log."""
    return _of_topics(inventory) if inventory.by_topic else _of_columns(inventory)


def label_of(item: Mapping[str, Any]) -> str:
    """Return where a line of a mapping reads a signal, in words."""
    return f"topic `{item['topic']}`" if "topic" in item else f"column `{item.get('column', item.get('columns'))}`"


def place_of(item: Mapping[str, Any]) -> str:
    """Return where a mapping's line says that a signal is: its column, or its topic and field."""
    if "topic" in item:
        return f"{item['topic']} {item['field']}".strip() if item.get("field") not in (None, "", "data") else str(item["topic"])
    return ", ".join(map(str, item["columns"])) if "columns" in item else str(item.get("column", ""))


def unit_by_size(signal: str, largest: float) -> str | None:
    """Return degrees where numbers of such a size are none in rad."""
    return None if largest <= LARGEST.get(signal, np.inf) else "deg/s" if signal.endswith("_s") else "deg"


def with_units_by_span(draft: Draft, inventory: Inventory) -> None:
    """Set the units that the least and largest of a column say, in a log that cannot be read as it is."""
    spans = {c.name: c.fields[0].span for c in inventory.channels if len(c.fields) == 1 and c.fields[0].span is not None}
    for signal, item in draft.body["signals"].items():
        span = spans.get(item.get("column", ""))
        if span is None or "unit" in item:
            continue
        servo = servo_of(np.array(span)) if signal in COUNTED else None
        unit = unit_by_size(signal, max(map(abs, span)))
        if servo is not None:
            item |= {"unit": COUNTS, "centre": round(servo.centre)}
        elif unit is not None:
            item["unit"] = unit


def _of_columns(inventory: Inventory) -> Draft:
    guesses: list[Guess] = []
    names = [c.name for c in inventory.channels]
    is_of_glider = GLIDER_CLOCK in names
    is_named = inventory.table is None or bool(inventory.table.header)
    for i, channel in enumerate(inventory.channels if is_named else ()):
        if not is_of_glider or channel.name.startswith(GLIDER_SENSORS):
            # A name that several columns have, or none, says nothing of which one is meant.
            guesses += of_column(channel, channel.name if names.count(channel.name) == 1 else i)
    best, notes = _best(guesses)
    _plane_pose(best)
    _single_speed(best)
    body: dict[str, Any] = {"schema": SCHEMA}
    samples = inventory.samples
    source = samples.source if samples is not None else inventory.no_clock[0] if inventory.no_clock is not None else None
    if source is not None:
        body["time"] = _time(inventory, source)
    signals = _combined(best, names, samples)
    if any(_MESSAGE_PATH.search(name) for name in names):
        body["frame"] = REP103
    if samples is not None:
        notes += _by_numbers(samples, signals, inventory)
        notes += [] if "frame" in body else true_north(samples, names, signals)
        _as_counts(samples, signals)
    body["signals"] = {s: signals[s] for s in (ATTITUDE, POSITION, *SIGNALS) if s in signals}
    return Draft(body, tuple(notes), frozenset(_of_combined(signals)), _other_headings(guesses, signals))


def _of_combined(signals: Mapping[str, Any]) -> set[str]:
    """Return the signals that come several from one line, in units of their own."""
    return {*(ANGLES if ATTITUDE in signals else ()), *(("x_m", "y_m") if POSITION in signals else ())}


def _of_topics(inventory: Inventory) -> Draft:
    guesses = [g for c in inventory.channels for g in of_topic(c)]
    best, notes = _best(guesses)
    if ATTITUDE in best:
        for angle in ANGLES:
            best.pop(angle, None)
    named = words_of(" ".join(c.name + c.kind for c in inventory.channels).lower())
    from_messages = any(c.kind == TABLE and _MESSAGE_PATH.search(f.path) for c in inventory.channels for f in c.fields)
    frame = REP103 if from_messages else inventory.frame or (NED if set(NORTH_EAST_DOWN) & set(named) else REP103)
    signals = {s: best[s].item for s in (ATTITUDE, POSITION, *SIGNALS) if s in best}
    defined = {s for s in signals if best[s].defined} | _of_combined(signals)
    body = {"schema": SCHEMA, "frame": frame, "signals": signals}
    return Draft(body, tuple(notes), frozenset(defined), _other_headings(guesses, signals))


def _time(inventory: Inventory, source: Source) -> dict[str, Any]:
    """Return a time as a mapping has it: one column or several, its unit, and the columns of its days or weeks."""
    date = [_place(inventory, c) for c in source.date]
    keys = {
        "column": _place(inventory, source.column),
        "columns": [_place(inventory, c) for c in source.columns] or None,
        "unit": source.unit,
        "date": date[0] if len(date) == 1 else date or None,
        "week": _place(inventory, source.week),
    }
    return {key: value for key, value in keys.items() if value is not None}


def _combined(best: dict[str, Guess], names: list[str], samples: Samples | None) -> dict[str, Any]:
    """Return the columns of signals, with those that give several together: latitude and longitude, a quaternion."""
    position = [best.pop(s, None) for s in (LATITUDE, LONGITUDE)]
    signals = {signal: guess.item for signal, guess in best.items()}
    if all(position) and not {"x_m", "y_m"} & signals.keys():
        signals[POSITION] = {"columns": [g.item["column"] for g in position if g is not None]}
    attitude = None if samples is None else quaternion_of(names, samples.columns)
    if attitude is not None:
        signals = {s: item for s, item in signals.items() if s not in ANGLES}
        signals[ATTITUDE] = attitude
    return signals


def _place(inventory: Inventory, column: str | int | None) -> str | int | None:
    """Return a column as a mapping names it: without a header by its place."""
    return int(column) if isinstance(column, str) and inventory.table and not inventory.table.header else column


def _other_headings(guesses: Iterable[Guess], signals: Mapping[str, Any]) -> tuple[dict[str, Any], ...]:
    """Return the lines of what may also be the heading, beside one column or field that is taken for it."""
    if "yaw_rad" not in signals:
        return ()
    others = sorted((g for g in guesses if g.signal == "yaw_rad" and g.item != signals["yaw_rad"]), key=lambda g: -g.sure)
    return tuple(g.item for g in others[:OTHER_HEADINGS])


def _best(guesses: Iterable[Guess]) -> tuple[dict[str, Guess], list[Note]]:
    """Return the surest guess for each signal, and a note where others are as near."""
    by_signal: dict[str, list[Guess]] = {}
    for guess in guesses:
        by_signal.setdefault(guess.signal, []).append(guess)
    best, notes = {}, []
    for signal, several in by_signal.items():
        ordered = sorted(several, key=lambda g: (-g.sure, -g.count))
        best[signal] = ordered[0]
        # of two that a format defines to be one signal both are it
        open_ones = [g for g in ordered[1:4] if g.sure > 0.5 * ordered[0].sure and not (g.defined and ordered[0].defined)]
        others = [label_of(g.item) for g in open_ones]
        if others and signal in SIGNALS:
            message = f"{signal} is taken from {label_of(ordered[0].item)}; it may also be {', '.join(others)}"
            notes.append(Note("alternatives", message, {"signal": signal, "others": others}))
    return best, notes


def _plane_pose(best: dict[str, Guess]) -> None:
    """In a pose of x, y and theta the one angle is the heading."""
    pitch = best.get("pitch_rad")
    if pitch is None or "yaw_rad" in best or not {"x_m", "y_m"} <= best.keys():
        return
    if "theta" in words_of(str(pitch.item["column"])):
        best["yaw_rad"] = replace(best.pop("pitch_rad"), signal="yaw_rad")


def _single_speed(best: dict[str, Guess]) -> None:
    """A `v` without a `u` beside it is the speed, and no sway."""
    sway = best.get("sway_m_s")
    if sway is not None and "surge_m_s" not in best and words_of(str(sway.item["column"])) == ["v"]:
        best["surge_m_s"] = replace(best.pop("sway_m_s"), signal="surge_m_s")


def _by_numbers(samples: Samples, signals: dict[str, Any], inventory: Inventory) -> list[Note]:
    """Add what the numbers of columns without a known name say, and return the reasons."""
    columns = samples.columns
    known = {s: i["column"] for s, i in signals.items() if "column" in i}
    known = {s: c if c in columns else str(c) for s, c in known.items()}
    used = {*known.values(), *samples.source.places, *(c for i in signals.values() for c in i.get("columns", ()))}
    named = inventory.table is None or inventory.table.header
    free = [c for c in columns if c not in used and not (named and isinstance(c, str) and meaning_of(c) is not None)]
    if all(known.get(s) in columns for s in ("yaw_rad", "x_m", "y_m")):
        unit = unit_of_heading(samples, known["yaw_rad"], (known["x_m"], known["y_m"]))
        if unit is not None:
            signals["yaw_rad"].setdefault("unit", unit)
    notes = []
    for found in recognised(samples, {s: c for s, c in known.items() if c in columns}, free):
        place = found.column if named else int(found.column)
        signals[found.signal] = {"column": place, **found.item}
        data = {"signal": found.signal, "column": place}
        notes.append(Note("evidence", f"{found.signal} is column {found.column}: {found.why}", data))
    return notes


def _as_counts(samples: Samples, signals: dict[str, Any]) -> None:
    """Write the centre of fins and motors that are logged in a servo's counts."""
    taken = [samples.columns.get(signals[s].get("column", "")) for s in FINS if s in signals and "unit" not in signals[s]]
    servos = [servo for values in taken if values is not None and (servo := servo_of(values)) is not None]
    for signal in COUNTED:
        item = signals.get(signal, {})
        values = samples.columns.get(item.get("column", ""))
        servo = None if values is None or "unit" in item else servo_of(values) or _as_others(values, servos)
        if servo is not None:
            item["unit"], item["centre"] = COUNTS, round(servo.centre)


def _as_others(values: FloatArray, servos: list[Servo]) -> Servo | None:
    """Return the kind of counts of the other fins where numbers (n,) fit it: one that never moves far tells none itself."""
    seen = values[np.isfinite(values)]
    whole = bool(seen.size) and bool((seen == np.round(seen)).all())
    return next((s for s in servos if whole and s.least <= seen.min() and seen.max() <= s.largest), None)
