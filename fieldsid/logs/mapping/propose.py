"""A first mapping for a log nobody has mapped yet, from names, message types and what the numbers say, tried on the log."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fieldsid.errors import FieldsidError, LogError
from fieldsid.logs.channels import ANGLES, ATTITUDE, POSITION, ChannelMap, Source
from fieldsid.logs.convert.servo_counts import COUNTED, COUNTS, FINS, Servo, servo_of
from fieldsid.logs.mapping.guesses import Guess, of_column, of_topic, quaternion_of
from fieldsid.logs.mapping.heading_units import heading_in_doubt, unit_of_wraps, wraps_in_rad
from fieldsid.logs.mapping.mend import mended
from fieldsid.logs.mapping.name_words import words_of
from fieldsid.logs.mapping.outputs import outputs_of, rudder_among, which_output
from fieldsid.logs.mapping.recognise import recognised, unit_of_heading
from fieldsid.logs.mapping.true_heading import better_heading
from fieldsid.logs.mapping.true_north import true_north
from fieldsid.logs.mapping.unit_evidence import assumed_units, said_of_assumed
from fieldsid.logs.mapping.vocabulary import LATITUDE, LONGITUDE
from fieldsid.logs.reader import Inventory, RawLog, Reader, ReadOptions, Samples, Series
from fieldsid.logs.run import GOALS, SIGNALS, Note, Run
from fieldsid.logs.several.sifting import attempt
from fieldsid.numerics.arrays import FloatArray

REP103 = "ENU/FLU"
_DEGREES = {"yaw_rad": 6.4, "pitch_rad": 1.6, "roll_rad": 3.3, "yaw_rate_rad_s": 4.0, "pitch_rate_rad_s": 4.0,
            "yaw_goal_rad": 6.4, "pitch_goal_rad": 1.6,
            "roll_rate_rad_s": 8.0,
            "rudder_rad": 1.6, "elevator_rad": 1.6, "rudder_measured_rad": 1.6, "elevator_measured_rad": 1.6}  # fmt: skip
"""Angles and rates larger than this are taken for degrees."""
GLIDER_CLOCK, GLIDER_SENSORS = "m_present_time", ("m_", "c_")
"""The clock of a glider's table, and how the sensors begin that are measured or commanded: others are settings and sums."""
_MESSAGE_PATH = re.compile(r"\bheader\.|\bpose\.pose\.|\btwist\.twist\.|\borientation\.[xyzw]$")
"""What columns are called that were written from messages, which are in the frames of REP 103."""
PERCENT = frozenset({"percent", "percentage", "pct", "perc"})
"""Words of a fin that is told in shares of its range, whose angle is not known."""
TRIES = 6
OTHER_HEADINGS = 4
"""Headings beside the surest that are tried."""
MENDS = 6
"""Readings of the log with what the last one's findings have set: a unit, a frame and the signs of two rates come in turn."""


@dataclass(frozen=True, slots=True)
class Proposal:
    """A mapping's body, the Run it gives, or why it gives none, and what speaks for it or for others."""

    body: dict[str, Any]
    run: Run | None = None
    problem: FieldsidError | None = None
    notes: tuple[Note, ...] = ()


def propose(inventory: Inventory, reader: Reader, options: ReadOptions) -> Proposal:
    """Return a mapping that `load_mapping` takes as soon as it names a signal, tried on the log itself.

    A signal that the log does not give after all is left out, and the reason said: a mapping that is proposed can be imported.
    """
    draft = _body(inventory)
    body, notes = draft.body, draft.notes
    if inventory.no_clock is not None:
        _in_degrees_by_span(body["signals"], inventory)
        return Proposal(body, problem=inventory.no_clock[1], notes=tuple(notes))
    for _ in range(TRIES):
        if not body["signals"]:
            break
        try:
            done = _with_own_heading(inventory, reader, options, draft)
            done = _with_rudder(inventory, reader, options, done, draft.defined)
        except FieldsidError as error:
            signal = _at_fault(error, body)
            if signal is None:
                _in_degrees_by_span(body["signals"], inventory)
                return Proposal(body, problem=error, notes=tuple(notes))
            left = body["signals"].pop(signal)
            notes.append(Note("left_out", f"{signal} is not proposed from {_label(left)}: {error.what}", {"signal": signal}))
        else:
            return replace(done, notes=(*notes, *done.notes))
    return Proposal(body, notes=tuple(notes))


def _in_degrees_by_span(signals: dict[str, Any], inventory: Inventory) -> None:
    """Set degrees where a column's numbers say so, in a log that cannot be read as it is: what is left is the line it lacks."""
    spans = {c.name: c.fields[0].span for c in inventory.channels if len(c.fields) == 1 and c.fields[0].span is not None}
    for signal, item in signals.items():
        span = spans.get(item.get("column", ""))
        if span is not None and "unit" not in item and max(map(abs, span)) > _DEGREES.get(signal, float("inf")):
            item["unit"] = "deg/s" if signal.endswith("_s") else "deg"


def _at_fault(error: FieldsidError, body: dict[str, Any]) -> str | None:
    """Return the signal whose cells or place an error is about, None where it is about all of them."""
    if len(body["signals"]) < 2:
        return None
    said = "for `{}`" if isinstance(error, LogError) else "`{}`"
    return next((s for s in body["signals"] if said.format(s) in error.what), None)


def _label(item: dict[str, Any]) -> str:
    return f"topic `{item['topic']}`" if "topic" in item else f"column `{item.get('column', item.get('columns'))}`"


@dataclass(frozen=True, slots=True)
class _Draft:
    """A mapping's body, why it is that, the signals whose unit the format defines, and lines of other headings."""

    body: dict[str, Any]
    notes: list[Note]
    defined: frozenset[str]
    headings: tuple[dict[str, Any], ...] = ()


def _body(inventory: Inventory) -> _Draft:
    if inventory.by_topic:
        return _of_topics(inventory)
    guesses: list[Guess] = []
    names = [c.name for c in inventory.channels]
    is_of_glider = GLIDER_CLOCK in names
    for i, channel in enumerate(inventory.channels):
        if is_of_glider and not channel.name.startswith(GLIDER_SENSORS):
            continue
        # A name that several columns have, or none, says nothing of which one is meant.
        is_named = inventory.table is None or inventory.table.header
        guesses += of_column(channel, channel.name if names.count(channel.name) == 1 and is_named else i) if is_named else ()
    best, notes = _best(guesses)
    _plane_pose(best)
    body: dict[str, Any] = {"schema": "fieldsid/mapping/1"}
    samples = inventory.samples
    source = samples.source if samples is not None else inventory.no_clock[0] if inventory.no_clock is not None else None
    if source is not None:
        body["time"] = _time(inventory, source)
    elif inventory.table is not None and not inventory.table.header:
        body["time"] = {"column": 0, "unit": "s"}
    signals = _combined(best, names, samples)
    if any(_MESSAGE_PATH.search(name) for name in names):
        body["frame"] = REP103
    if samples is not None:
        notes += _by_numbers(samples, signals, inventory)
        notes += [] if "frame" in body else true_north(samples, names, signals)
        _as_counts(samples, signals)
    body["signals"] = {s: signals[s] for s in (ATTITUDE, POSITION, *SIGNALS) if s in signals}
    defined = frozenset({"x_m", "y_m"} if POSITION in signals else ())
    return _Draft(body, notes, defined, _other_headings(guesses, signals))


def _with_rudder(inventory: Inventory, reader: Reader, options: ReadOptions, done: Proposal, defined: frozenset[str]) -> Proposal:
    """Return a proposal with the output that is the rudder by the motion, where no name says it; else with those there are."""
    outputs = outputs_of(inventory) if inventory.by_topic and not set(FINS) & done.body["signals"].keys() else []
    if not outputs or done.run is None:
        return done
    fin = rudder_among(done.run, outputs, inventory.path, reader, ReadOptions(options.msg_path, salvage=True))
    if fin is None:
        return replace(done, notes=(*done.notes, which_output(outputs)))
    topic, path = outputs[int(fin.column)]
    done.body["signals"]["rudder_rad"] = {"topic": topic, "field": path, **fin.item}
    why = Note("evidence", f"rudder_rad is {topic} {path}: {fin.why}", {"signal": "rudder_rad", "outputs": len(outputs)})
    return replace(_tried(inventory, reader, options, done.body, defined), notes=(*done.notes, why))


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
        signals[ATTITUDE] = {"columns": list(attitude)}
    return signals


def _place(inventory: Inventory, column: str | int | None) -> str | int | None:
    """Return a column as a mapping names it: without a header by its place."""
    return int(column) if isinstance(column, str) and inventory.table and not inventory.table.header else column


def _of_topics(inventory: Inventory) -> _Draft:
    guesses = [g for c in inventory.channels for g in of_topic(c)]
    best, notes = _best(guesses)
    if ATTITUDE in best:
        for angle in ANGLES:
            best.pop(angle, None)
    named = " ".join(c.name + c.kind for c in inventory.channels).lower()
    frame = inventory.frame or ("NED/FRD" if "ned" in words_of(named) else REP103)
    signals = {s: best[s].item for s in (ATTITUDE, POSITION, *SIGNALS) if s in best}
    defined = {s for s in signals if best[s].defined}
    defined |= set(ANGLES) if ATTITUDE in signals else {"x_m", "y_m"} if POSITION in signals else set()
    body = {"schema": "fieldsid/mapping/1", "frame": frame, "signals": signals}
    return _Draft(body, notes, frozenset(defined), _other_headings(guesses, signals))


def _other_headings(guesses: Iterable[Guess], signals: Mapping[str, Any]) -> tuple[dict[str, Any], ...]:
    """Return the lines of what may also be the heading, beside one column or field that is taken for it."""
    if "yaw_rad" not in signals:
        return ()
    others = sorted((g for g in guesses if g.signal == "yaw_rad" and g.item != signals["yaw_rad"]), key=lambda g: -g.sure)
    return tuple(g.item for g in others[:OTHER_HEADINGS])


def _with_own_heading(inventory: Inventory, reader: Reader, options: ReadOptions, draft: _Draft) -> Proposal:
    """Return the proposal as it was tried, with the heading that the numbers show to be the vehicle's, of several."""
    done = _tried(inventory, reader, options, draft.body, draft.defined)
    if done.run is None or not draft.headings:
        return done
    signals = draft.body["signals"]
    bodies = [draft.body | {"signals": signals | {"yaw_rad": dict(item)}} for item in draft.headings]
    others = [attempt(lambda body: _tried(inventory, reader, options, body, draft.defined), body) for body in bodies]
    tried = [done, *(p for p in others if isinstance(p, Proposal) and p.run is not None)]
    found = better_heading([p.run for p in tried if p.run is not None], [_label(p.body["signals"]["yaw_rad"]) for p in tried])
    if found is None:
        return done
    best, why = found
    return replace(tried[best], notes=(why, *tried[best].notes))


def _best(guesses: Iterable[Guess]) -> tuple[dict[str, Guess], list[Note]]:
    """Return the surest guess for each signal, and a note where others are as near."""
    by_signal: dict[str, list[Guess]] = {}
    for guess in guesses:
        by_signal.setdefault(guess.signal, []).append(guess)
    best, notes = {}, []
    for signal, several in by_signal.items():
        ordered = sorted(several, key=lambda g: (-g.sure, -g.count))
        best[signal] = ordered[0]
        others = [_label(g.item) for g in ordered[1:4] if g.sure > 0.5 * ordered[0].sure]
        if others and signal in SIGNALS:
            message = f"{signal} is taken from {_label(ordered[0].item)}; it may also be {', '.join(others)}"
            notes.append(Note("alternatives", message, {"signal": signal, "others": others}))
    return best, notes


def _plane_pose(best: dict[str, Guess]) -> None:
    """In a pose of x, y and theta the one angle is the heading."""
    pitch = best.get("pitch_rad")
    if pitch is None or "yaw_rad" in best or not {"x_m", "y_m"} <= best.keys():
        return
    if "theta" in words_of(str(pitch.item["column"])):
        best["yaw_rad"] = replace(best.pop("pitch_rad"), signal="yaw_rad")


def _by_numbers(samples: Samples, signals: dict[str, Any], inventory: Inventory) -> list[Note]:
    """Add what the numbers of columns without a known name say, and return the reasons."""
    columns = samples.columns
    known = {s: i["column"] for s, i in signals.items() if "column" in i}
    known = {s: c if c in columns else str(c) for s, c in known.items()}
    used = {*known.values(), *samples.source.places, *(c for i in signals.values() for c in i.get("columns", ()))}
    named = inventory.table is None or inventory.table.header
    free = [c for c in columns if c not in used and not (named and _is_named(c))]
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


def _is_named(column: str | int) -> bool:
    from fieldsid.logs.mapping.word_meaning import meaning_of

    return isinstance(column, str) and meaning_of(column) is not None


def _as_counts(samples: Samples, signals: dict[str, Any]) -> None:
    """Write the centre of fins and motors that are logged in a servo's counts."""
    taken = [samples.columns.get(signals[s].get("column", "")) for s in FINS if s in signals and "unit" not in signals[s]]
    servos = [servo for values in taken if values is not None and (servo := servo_of(values)) is not None]
    for signal in COUNTED:
        item = signals.get(signal, {})
        values = samples.columns.get(item.get("column", ""))
        if signal in FINS and "unit" not in item and PERCENT & set(words_of(str(item.get("column", "")))):
            item["unit"], item["centre"] = COUNTS, 0
        servo = None if values is None or "unit" in item else servo_of(values) or _as_others(values, servos)
        if servo is not None:
            item["unit"], item["centre"] = COUNTS, servo.centre


def _as_others(values: FloatArray, servos: list[Servo]) -> Servo | None:
    """Return the kind of counts of the other fins where numbers (n,) fit it: one that never moves far tells none itself."""
    seen = values[np.isfinite(values)]
    whole = bool(seen.size) and bool((seen == np.round(seen)).all())
    return next((s for s in servos if whole and s.least <= seen.min() and seen.max() <= s.largest), None)


def _tried(inventory: Inventory, reader: Reader, options: ReadOptions, body: dict[str, Any], defined: frozenset[str]) -> Proposal:
    """Read the log with the proposal, and set degrees where the numbers say so."""
    from fieldsid.logs.convert.assemble import assemble
    from fieldsid.logs.doctor.examine import examine
    from fieldsid.logs.doctor.stated import stated_by
    from fieldsid.logs.mapping.mapping_file import mapping_of

    lenient = ReadOptions(options.msg_path, salvage=True)
    raw = reader.read(inventory.path, mapping_of(body), lenient)
    by_size = frozenset(s for s, v in raw.series.items() if _is_in_degrees(s, v, body["signals"].get(s, {})))
    for signal in by_size:
        body["signals"][signal]["unit"] = "deg/s" if signal.endswith("_s") else "deg"
    if "yaw_rad" in by_size:
        body["signals"]["yaw_rad"]["unit"] = unit_of_wraps(raw.series["yaw_rad"].values)
    _as_the_heading(raw, body["signals"])
    why: list[Note] = []
    for _ in range(MENDS):
        mapping: ChannelMap = mapping_of(body)
        run = assemble(raw, mapping, inventory.path, lenient, max_gap_s=float("inf"))
        notes = examine(run, stated=stated_by(mapping, raw))
        set_now = mended(body, run, notes, by_size)
        why += set_now
        if not set_now:
            break
    if "yaw_rad" in by_size and "unit" in body["signals"]["yaw_rad"]:
        why += heading_in_doubt(raw.series["yaw_rad"].values, body["signals"])
    stated = stated_by(mapping, raw).units.keys()
    turned = {"yaw_rad"} if "yaw_rad" in raw.series and wraps_in_rad(raw.series["yaw_rad"].values) else set()
    assumed = assumed_units(run, {*defined, *stated, *turned, *(ANGLES if ATTITUDE in body["signals"] else ())})
    why += said_of_assumed(assumed, body["signals"])
    return Proposal(body, Run(run.name, run.time, run.signals, inventory.path, (*run.notes, *notes)), notes=tuple(why))


def _as_the_heading(raw: RawLog, signals: dict[str, Any]) -> None:
    """Take pitch, roll and goals without a unit for degrees where the heading is in them: one logger wrote them."""
    if "deg" not in {signals.get("yaw_rad", {}).get("unit"), raw.series["yaw_rad"].unit if "yaw_rad" in raw.series else None}:
        return
    for angle in ("pitch_rad", "roll_rad", *sorted(GOALS)):
        if angle in signals and raw.series[angle].unit is None and "field" not in signals[angle]:
            signals[angle].setdefault("unit", "deg")


def _is_in_degrees(signal: str, series: Series, item: dict[str, Any]) -> bool:
    if signal not in _DEGREES or series.values.ndim != 1 or "unit" in item or series.unit is not None:
        return False
    return float(np.max(np.abs(series.values[np.isfinite(series.values)]), initial=0.0)) > _DEGREES[signal]
