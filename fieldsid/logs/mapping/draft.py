"""The draft of a mapping before the log is read with it: the best guess for each signal, from names and a table's numbers."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fieldsid.logs.channels import ATTITUDE, POSITION, Source
from fieldsid.logs.few_of import MOSTLY
from fieldsid.logs.mapping.canonical_names import words_of
from fieldsid.logs.mapping.guesses import NOTHING, Guess, of_column, of_topic, quaternion_of
from fieldsid.logs.mapping.numbers.recognise import PLACE, recognised
from fieldsid.logs.mapping.numbers.true_heading import true_north
from fieldsid.logs.mapping.numbers.unit_inference import set_by_size
from fieldsid.logs.mapping.vocabulary import LATITUDE, LONGITUDE
from fieldsid.logs.mapping.word_meaning import is_command, meaning_of
from fieldsid.logs.reader import TABLE, Inventory, Samples
from fieldsid.logs.run import ANGLES, MEASURED_FIN, SIGNALS, Note

SCHEMA = "fieldsid/mapping/1"
REP103, NED = "ENU/FLU", "NED/FRD"
GLIDER_CLOCK, GLIDER_SENSORS = "m_present_time", ("m_", "c_")
"""The time column of a glider's table, and the prefixes of measured and commanded sensors; others are settings and totals."""
_MESSAGE_PATH = re.compile(r"\bheader\.|\bpose\.pose\.|\btwist\.twist\.|\borientation\.[xyzw]$")
"""Names of columns that were written from messages, which are in the frames of REP 103."""
NORTH_EAST_DOWN = frozenset({"ned", "px"})
"""Words of topics that are in NED and FRD: those with the frame in their name, and those of PX4."""
OTHERS = 4
"""Number of alternatives of a signal that a note names, and of a heading that are tried."""


@dataclass(frozen=True, slots=True)
class Draft:
    """The body of a mapping, notes on it, the signals whose unit the format defines, and lines of alternative headings."""

    body: dict[str, Any]
    notes: tuple[Note, ...]
    defined: frozenset[str]
    headings: tuple[dict[str, Any], ...] = ()


def place_of(item: Mapping[str, Any]) -> str:
    """Return, in words, the source in a line of a mapping: its column, its topic and field, or those of its sum."""
    if "sum" in item:
        return " + ".join(map(place_of, item["sum"]))
    if "topic" in item:
        return f"{item['topic']} {item['field']}".strip() if item.get("field") not in (None, "", "data") else str(item["topic"])
    column = item.get("column", "")
    return (
        ", ".join(map(str, item["columns"])) if "columns" in item else f"column {column}" if isinstance(column, int) else column
    )


def with_units_by_span(draft: Draft, inventory: Inventory) -> None:
    """Set the units that the smallest and largest value of a column indicate, in a log that cannot be read as it is."""
    spans = {c.name: c.fields[0].span for c in inventory.channels if len(c.fields) == 1}
    signals = draft.body["signals"]
    seen = {s: np.array(span) for s, item in signals.items() if (span := spans.get(item.get("column", ""))) is not None}
    set_by_size(signals, seen, {})


def draft_of(inventory: Inventory) -> Draft:
    """Return the draft of a mapping for a log."""
    body: dict[str, Any] = {"schema": SCHEMA}
    names = [c.name for c in inventory.channels]
    guesses = [g for c in inventory.channels for g in of_topic(c)] if inventory.by_topic else _of_columns(inventory, names)
    best, notes = _best(guesses)
    samples = inventory.samples
    attitude = None if samples is None else quaternion_of(names, samples.columns)
    signals = _combined(best, attitude)
    notes = [note for note in notes if note.data["signal"] in signals]
    if inventory.by_topic:
        body["frame"] = _frame_of_topics(inventory)
    else:
        source = samples.source if samples is not None else inventory.no_clock[0] if inventory.no_clock is not None else None
        body |= {} if source is None else {"time": _time(source)}
        body |= {"frame": REP103} if any(_MESSAGE_PATH.search(name) for name in names) else {}
    if samples is not None:
        notes += _by_numbers(samples, signals)
        notes += [] if "frame" in body else true_north(samples, names, signals)
    body["signals"] = {s: signals[s] for s in (ATTITUDE, POSITION, *SIGNALS) if s in signals}
    defined = {s for s, guess in best.items() if guess.defined}
    defined |= {*(ANGLES if ATTITUDE in signals else ()), *(("x_m", "y_m") if POSITION in signals else ())}
    return Draft(body, tuple(notes), frozenset(defined), _other_headings(guesses, signals))


def _of_columns(inventory: Inventory, names: list[str]) -> list[Guess]:
    """Return the guesses for the columns of a table; a column whose name is not unique is named by its index."""
    starts = GLIDER_SENSORS if GLIDER_CLOCK in names else ("",)
    return [
        guess
        for i, channel in enumerate(inventory.channels if inventory.is_named else ())
        if channel.name.startswith(starts)
        for guess in of_column(channel, channel.name if names.count(channel.name) == 1 else i)
    ]


def _frame_of_topics(inventory: Inventory) -> str:
    """Return the frames of a log of topics: those of its format, or REP 103 for tables that were written from messages."""
    if any(c.kind == TABLE and _MESSAGE_PATH.search(f.path) for c in inventory.channels for f in c.fields):
        return REP103
    named = words_of(" ".join(c.name + c.kind for c in inventory.channels).lower())
    return inventory.frame or (NED if NORTH_EAST_DOWN & set(named) else REP103)


def _time(source: Source) -> dict[str, Any]:
    """Return the line of a time in a mapping: one column or several, its unit, and the columns of the date or week."""
    date = source.date[0] if len(source.date) == 1 else list(source.date)
    line = {"column": source.column, "columns": list(source.columns), "unit": source.unit, "date": date, "week": source.week}
    return {key: value for key, value in line.items() if value not in (None, [])}


def _combined(best: dict[str, Guess], attitude: dict[str, Any] | None) -> dict[str, Any]:
    """Return the lines of signals, with latitude and longitude combined to a position, and a quaternion to an attitude.

    In a pose of x, y and theta, theta is the heading; a `v` in a log without a `u` is the speed and not the sway.
    """
    latitude, longitude = (best.pop(s, None) for s in (LATITUDE, LONGITUDE))
    signals = {signal: guess.item for signal, guess in best.items()}
    if {"pitch_rad", "x_m", "y_m"} <= signals.keys() and "yaw_rad" not in signals and _is_called(signals, "pitch_rad", "theta"):
        signals["yaw_rad"] = signals.pop("pitch_rad")
    if "surge_m_s" not in signals and _is_called(signals, "sway_m_s", "v"):
        signals["surge_m_s"] = signals.pop("sway_m_s")
    if latitude is not None and longitude is not None and not {"x_m", "y_m"} & signals.keys():
        unit = {"unit": latitude.item["unit"]} if latitude.item.get("unit", "deg") != "deg" else {}
        if "column" in latitude.item:
            signals[POSITION] = {"columns": [latitude.item["column"], longitude.item["column"]], **unit}
        elif latitude.item["topic"] == longitude.item["topic"]:
            fields = f"{latitude.item['field']}, {longitude.item['field']}"
            signals[POSITION] = {"topic": latitude.item["topic"], "field": fields, **unit}
    signals |= {} if attitude is None else {ATTITUDE: attitude}
    return {s: item for s, item in signals.items() if ATTITUDE not in signals or s not in ANGLES}


def _is_called(signals: Mapping[str, Any], signal: str, word: str) -> bool:
    item = signals.get(signal, {})
    words = words_of(str(item.get("column", item.get("field", ""))))
    return words == [word] or (len(word) > 1 and word in words)


def _other_headings(guesses: Iterable[Guess], signals: Mapping[str, Any]) -> tuple[dict[str, Any], ...]:
    """Return the lines of the alternatives to the column or field that is taken for the heading."""
    if "yaw_rad" not in signals:
        return ()
    others = sorted((g for g in guesses if g.signal == "yaw_rad" and g.item != signals["yaw_rad"]), key=lambda g: -g.sure)
    return tuple(g.item for g in others[:OTHERS])


def _best(guesses: Iterable[Guess]) -> tuple[dict[str, Guess], list[Note]]:
    """Return the guess with the highest score for each signal, and a note where others score nearly as high."""
    by_signal: dict[str, list[Guess]] = {}
    for guess in guesses:
        by_signal.setdefault(guess.signal, []).append(guess)
    for fin, measured in MEASURED_FIN.items():
        # beside a fin whose name says that it is the command, the others are where the fin is
        of_fin = by_signal.get(fin, [])
        commanded = [g for g in of_fin if is_command(place_of(g.item), fin)]
        if any(g.sure > NOTHING for g in commanded) and len(commanded) < len(of_fin):
            by_signal[fin] = commanded
            by_signal.setdefault(measured, []).extend(replace(g, signal=measured) for g in of_fin if g not in commanded)
    best, notes = {}, []
    for signal, several in by_signal.items():
        ordered = sorted(several, key=lambda g: (-g.sure, -g.count, len(words_of(str(g.item.get("column", ""))))))
        first = best[signal] = ordered[0]
        # where a format defines two fields as the same signal, neither is an alternative
        near = [g for g in ordered[1 : 1 + OTHERS] if g.sure > MOSTLY * first.sure and not (g.defined and first.defined)]
        others = [f"`{place_of(g.item)}`" for g in near]
        if others and signal in SIGNALS:
            message = f"{signal} is taken from `{place_of(first.item)}`; it may also be {', '.join(others)}"
            notes.append(Note("alternatives", message, {"signal": signal, "others": others}))
    return best, notes


def _by_numbers(samples: Samples, signals: dict[str, Any]) -> list[Note]:
    """Add the signals that are recognised by the numbers of columns without a known name, and return the reasons."""
    columns = samples.columns
    known = {s: i["column"] for s, i in signals.items() if "column" in i}
    if "unit" not in signals.get(POSITION, {"unit": ""}):
        known |= dict(zip(PLACE, signals[POSITION]["columns"], strict=True))
    used = {*known.values(), *samples.source.places, *(c for i in signals.values() for c in i.get("columns", ()))}
    free = [c for c in columns if c not in used and not (isinstance(c, str) and meaning_of(c) is not None)]
    notes = []
    for found in recognised(samples, {s: c for s, c in known.items() if c in columns}, free):
        signal, place = POSITION if found.signal in PLACE and found.item else found.signal, found.column
        if signal == POSITION:
            signals[POSITION] = {"columns": [*signals.get(POSITION, {"columns": []})["columns"], place]}
        else:
            signals[signal] = {"column": place, **found.item}
        notes.append(Note("evidence", f"{signal} is column {place}: {found.why}", {"signal": signal, "column": place}))
    return notes
