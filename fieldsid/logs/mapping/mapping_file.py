"""The file mapping.yaml, which states the column or topic of each signal; an unknown key is refused with the nearest one."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Field

from fieldsid.errors import MappingError
from fieldsid.logs.channels import ATTITUDE, COMBINED, POSITION, ChannelMap, Pressure, Source, TableForm
from fieldsid.logs.convert.clock import GAP_FACTOR
from fieldsid.logs.convert.frames import Body, Frame, World
from fieldsid.logs.convert.servo_counts import COUNTED, COUNTS, SUMMED, counts_unit
from fieldsid.logs.convert.times.clock_parts import parts_of
from fieldsid.logs.convert.times.clock_text import FORMS
from fieldsid.logs.convert.times.time_column import time_unit
from fieldsid.logs.convert.units import find_unit, pick_unit
from fieldsid.logs.mapping.canonical_names import fitting
from fieldsid.logs.mapping.vocabulary import TIME
from fieldsid.logs.run import ANGLES, FINS, PART, SIGNALS, signal_of
from fieldsid.registry import near
from fieldsid.strict import StrictModel, read_model, validated

Column = Annotated[int, Field(ge=0)] | str
OF_FINS = "; `us` for a servo's pulses, `1` where -1 .. 1 is the whole range, `counts` for others"
Finite = Annotated[float, Field(allow_inf_nan=False)]


def _key(says: str, example: str, default: Any = None) -> Any:
    """Return the field of a key with its description and an example, which the guide shows."""
    return Field(default, description=says, examples=[example])


class _Place(StrictModel):
    """The source of numbers and their conversion: the keys that a signal and an entry of a sum share."""

    column: Column | None = _key("the column of a table, by its name or by its place from 0", "yaw_rad: {column: Heading}")
    columns: list[Column] | None = _key(
        "several columns that give one line: the four of a quaternion, or latitude and longitude",
        "attitude: {columns: [qx, qy, qz, qw]}",
    )
    order: Literal["xyzw", "wxyz"] = _key(
        "the order of a quaternion's numbers", 'attitude: {columns: ["q[0]", "q[1]", "q[2]", "q[3]"], order: wxyz}', "xyzw"
    )
    topic: str | None = _key("the topic of a bag, or what else has a clock of its own", "depth_m: {topic: /depth, field: data}")
    field: str = _key("the path of a number in the messages", "surge_m_s: {topic: /odom, field: twist.twist.linear.x}", "")
    unit: Annotated[str | None, BeforeValidator(lambda unit: "1" if unit == 1 else unit)] = _key(
        "the unit of the numbers, where the name does not say it; on a fin also `us` (pulses), `1` (-1 .. 1), `%` and `counts`",
        "rudder_rad: {column: rudder_cmd, unit: deg}",
    )
    sign: Literal[1, -1] = _key("-1 turns a signal that counts the other way", "rudder_rad: {column: fin, sign: -1}", 1)
    offset: Finite = _key("what is added last, in SI", "yaw_rad: {column: compass, unit: deg, offset: 0.0349}", 0.0)
    frame: str | None = _key("the frames of this signal only", "yaw_rad: {column: yaw, frame: ENU}")
    stamp: Literal["header", "receive"] | None = _key(
        "which stamps this signal has", "rudder_rad: {topic: /rudder, field: data, stamp: receive}"
    )
    centre: Finite | None = _key("the count of a servo in the middle", "rudder_rad: {column: servo1, unit: counts, centre: 1500}")


class _Entry(_Place):
    scale: Finite | None = _key("the share of this entry in the sum, either sign", "{column: fin3, scale: -0.5}")


class _Source(_Place):
    scale: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] | None = _key(
        "the rad that one count of a servo is worth", "rudder_rad: {column: servo1, unit: us, scale: 0.0013}"
    )
    sum: Annotated[list[_Entry], Field(min_length=1)] | None = _key(
        "several columns or topics that make up one fin or thrust together, as the fins of an X tail do",
        "rudder_rad: {sum: [{column: fin1, scale: 0.5}, {column: fin3, scale: -0.5}]}",
    )


class _Time(StrictModel):
    column: Column | None = _key("the column of the time, by its name or by its place from 0", "time: {column: stamp, unit: s}")
    columns: list[Column] | None = _key(
        "the columns whose sum the time is", "time: {columns: [hour, minute, second], unit: hh+mm+ss}"
    )
    unit: str | None = _key("the unit of the time, how a clock is written, or its parts", "time: {column: millis, unit: ms}")
    date: Column | Annotated[list[Column], Field(min_length=1, max_length=3)] | None = _key(
        "the columns of the days, where the time is that of a day", 'time: {column: clock, unit: "hhmmss", date: day}'
    )
    week: Column | None = _key("the column of the GPS weeks beside a time of the week", "time: {column: tow, week: wn}")
    rate: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] | None = _key(
        "how many samples a second a column counts, or how many rows a second there are where no column is a time",
        "time: {rate: 10}",
    )


class _Pressure(StrictModel):
    density: Annotated[float, Field(gt=0.0)] = _key("the water's, in kg/m^3", "pressure: {density: 1000.0}", 1025.0)
    surface_pa: Annotated[float, Field(ge=0.0)] = _key(
        "the pressure at the surface in Pa, 0 for a gauge", "pressure: {surface_pa: 0.0}", 101325.0
    )


class _Table(StrictModel):
    separator: str | None = _key("what stands between two cells, or `whitespace`", 'table: {separator: ";"}')
    header: bool | None = _key("whether the columns have names", "table: {header: false}")
    skip: Annotated[int, Field(ge=0)] | None = _key("lines above the table", "table: {skip: 4}")
    encoding: str | None = _key("the encoding of the text", "table: {encoding: cp1252}")
    decimal: Literal[".", ","] | None = _key("the decimal sign", 'table: {decimal: ","}')


class _File(StrictModel):
    schema_: Literal["fieldsid/mapping/1"] = Field(
        default="fieldsid/mapping/1", alias="schema", description="the kind of the file", examples=["schema: fieldsid/mapping/1"]
    )
    frame: str | None = _key("the frames of the log: the world's (NED, ENU) and the body's (FRD, FLU)", "frame: ENU/FLU")
    stamp: Literal["header", "receive"] | None = _key("which stamps every topic has", "stamp: receive")
    clock: str | None = _key("the signal whose samples give the clock, else the fastest angle or rate", "clock: yaw_rad")
    gap_factor: Annotated[float, Field(ge=1.0, le=1000.0)] = _key(
        "over how many of its periods a measurement is interpolated at most", "gap_factor: 4.0", GAP_FACTOR
    )
    time: _Time | None = _key("the time of a table", "time: {column: Time, unit: s}")
    pressure: _Pressure = _key("what turns a pressure into a depth", "pressure: {density: 1000.0, surface_pa: 0.0}", _Pressure())
    table: _Table = _key("how a table is written, where that is not found by itself", 'table: {separator: ";"}', _Table())
    signals: dict[str, _Source | str | int] = Field(
        description="a line for each signal: where it is and how it is read", examples=["yaw_rad: {column: Heading, unit: deg}"]
    )


KEYS: Mapping[str, type[StrictModel]] = MappingProxyType(
    {"": _File, "a line of `signals`": _Source, "`time`": _Time, "`pressure`": _Pressure, "`table`": _Table}
)
"""The keys of a mapping by the section that contains them, as the guide lists them."""


def load_mapping(path: Path) -> ChannelMap:
    """Read a mapping.yaml.

    Raises ArtifactError where it is not YAML, MappingError for an unknown key or signal (with the near match), a wrong
    type, a unit that does not fit, or a source that names neither a column nor a topic.
    """
    return _channel_map(read_model(_File, path, error=MappingError), f"`{path}`", path)


def mapping_of(body: Mapping[str, Any]) -> ChannelMap:
    """Return the mapping of a dictionary with the keys of mapping.yaml; raises MappingError."""
    return _channel_map(validated(_File, body, place="the mapping", error=MappingError), "the mapping", None)


def _refuse(place: str, *faults: tuple[object, str, object, str]) -> None:
    """Raise MappingError for the first fault that is present.

    A fault is a tuple: whether it is present, what is wrong, what was found, and a hint.
    """
    for is_present, what, found, hint in faults:
        if is_present:
            raise MappingError(f"{place} {what}", found=str(found), hint=hint)


def frame_of(text: str | None, place: str) -> Frame | None:
    """Return the frames that a text such as `ENU/FLU`, `NED` or `FLU` names; raises MappingError."""
    if text is None:
        return None
    named = [part.strip() for part in re.split("[-,/]", text.upper())]
    strange = next((part for part in named if part not in get_args(World) + get_args(Body)), None)
    hint = "write the world's and the body's: `NED/FRD` or `ENU/FLU`"
    _refuse(f"{place}:", (strange is not None, f"there is no frame {strange!r}", repr(text), hint))
    return Frame("ENU" if "ENU" in named else "NED", "FLU" if "FLU" in named else "FRD")


def channel_of(text: str) -> tuple[str, Source]:
    """Return the signal and source of `signal=column:unit`, or `signal=/topic.field:unit`; raises MappingError.

    A column of digits is an index, counted from 0. `time` names the time column.
    """
    signal, equals, rest = text.partition("=")
    signal = TIME if signal.strip() == "time" else signal.strip()
    known = (TIME, *COMBINED, *SIGNALS)
    _refuse(
        "`--channel",
        (not equals or not rest, f"{text}` is no channel", repr(text), "write `--channel yaw_rad=heading:deg`"),
        (signal not in known, f"` names an unknown signal `{signal}`", repr(text), near(signal, known)),
    )
    form = next((f for f in FORMS if signal == TIME and rest.endswith(f":{f}")), "")
    where, colon, unit = (rest.removesuffix(f":{form}"), ":", form) if form else rest.rpartition(":")
    if not colon:
        where, unit = rest, ""
    if unit and signal != TIME:
        _check_unit(signal, unit, "`--channel`")
    if where.startswith("/"):
        topic, _, path = where.partition(".")
        return signal, Source(topic=topic, path=path, unit=unit or None)
    return signal, Source(column=int(where) if where.isdigit() else where, unit=unit or None)


def _channel_map(file: _File, place: str, origin: Path | None) -> ChannelMap:
    frame = frame_of(file.frame, place)
    sources = {name: source for signal, item in file.signals.items() for name, source in _sources(signal, item, place)}
    unmapped, signals = file.clock is not None and file.clock not in file.signals, list(file.signals)
    hint = "write a line for each under `signals`, as `yaw_rad: {column: NAME, unit: deg}`"
    _refuse(place, (not sources, "maps no signal", "an empty `signals`", hint))
    _refuse(f"{place}:", (unmapped, "`clock` names a signal that is not mapped", file.clock, near(file.clock or "", signals)))
    return ChannelMap(
        sources,
        _time(file.time, place) if file.time else None,
        frame or Frame(),
        pressure=Pressure(**file.pressure.model_dump()),
        table=TableForm(**file.table.model_dump()),
        origin=origin,
        **file.model_dump(include={"stamp", "clock", "gap_factor"}),
    )


def _time(time: _Time, place: str) -> Source:
    """Return the source of the time; raises MappingError.

    Its unit is a unit of time, or the format of a clock; a time that counts samples or rows has a rate and no unit.
    """
    rate, columns = time.rate, tuple(time.columns or ())
    is_one = (time.column is None) != (not columns) or (not columns and rate is not None)
    advice = "name one with `column`, those that make it up with `columns`, or give the rows a second with `rate`"
    is_both = rate is not None and (time.unit, time.date, time.week, time.columns) != (None, None, None, None)
    _refuse(
        f"{place}:",
        (not is_one, "`time` needs one of `column`, `columns`, `rate`", "both" if columns else "none of them", advice),
        (
            is_both,
            "a time with a `rate` counts samples, and has no unit, date or week",
            f"rate {rate}",
            f"write `time: {{rate: {rate}}}`",
        ),
    )
    if columns:
        parts_of(time.unit, columns, place)
    elif time.unit is not None and time.unit not in FORMS:
        time_unit(time.unit, f"{place}: time")
    date = () if time.date is None else tuple(time.date) if isinstance(time.date, list) else (time.date,)
    return Source(time.column, columns, unit=time.unit, date=date, week=time.week, scale=1.0 / rate if rate else None)


def _sources(signal: str, item: _Source | str | int, place: str) -> list[tuple[str, Source]]:
    """Return the source of a signal by its name, or the sources of the entries of its sum by numbered names."""
    known = (*COMBINED, *SIGNALS)
    _refuse(place, (signal not in known, f"maps an unknown signal `{signal}`", signal, near(signal, known)))
    if not isinstance(item, _Source):
        item = validated(_Source, {"column": item}, place=f"{place}, `{signal}`", error=MappingError)
    if item.sum is None:
        return [(signal, _source(signal, item, place))]
    # only fins and motors may be sums, and all keys of a sum are given at its entries
    extra_keys, zero_entries = (
        sorted(item.model_fields_set - {"sum"}),
        [i for i, entry in enumerate(item.sum) if entry.scale == 0.0],
    )
    zero_hint = "leave the entry out, or write what its number is worth"
    _refuse(
        f"{place}:",
        (signal not in SUMMED, f"`{signal}` cannot be a sum", f"{len(item.sum)} entries", f"a sum is for {', '.join(SUMMED)}"),
        (
            extra_keys,
            f"`{signal}` has `{''.join(extra_keys[:1])}` beside its `sum`",
            ", ".join(extra_keys),
            "write it at each entry of the sum",
        ),
        (
            zero_entries,
            f"entry {zero_entries and zero_entries[0]} of the sum `{signal}` has a scale of zero",
            "scale: 0",
            zero_hint,
        ),
    )
    return [(name, _source(name, entry, place)) for i, entry in enumerate(item.sum) for name in (f"{signal}{PART}{i}]",)]


def _source(signal: str, item: _Source | _Entry, place: str) -> Source:
    _check_place(signal, item, place)
    # The scale of an entry converts its unit, such as N of a thruster, to that of the sum.
    is_converted = isinstance(item, _Entry) and item.scale is not None and find_unit(item.unit or "") is not None
    if item.unit is not None and not is_converted:
        _check_unit(signal, item.unit, place)
    as_written = item.model_dump(exclude={"sum", "field", "columns", "frame"})
    frame = frame_of(item.frame, f"{place}, `{signal}`")
    return Source(columns=tuple(item.columns or ()), path=item.field, frame=frame, **as_written)


def _check_place(signal: str, item: _Source | _Entry, place: str) -> None:
    """Raise MappingError unless exactly one of column, columns, topic is given, and its other keys fit the signal."""
    named = [n for n, v in (("column", item.column), ("columns", item.columns or None), ("topic", item.topic)) if v is not None]
    count, is_position, may_turn = len(item.columns or ()), signal == POSITION, signal in (ATTITUDE, *ANGLES)
    is_four = not is_position and (signal == ATTITUDE or count > 0)
    of_counts = {"centre": item.centre, "scale": item.scale if isinstance(item, _Source) else None}
    extra = [n for n, v in of_counts.items() if v is not None and counts_unit(signal_of(signal), item.unit) is None]
    no_place = f"`{signal}` needs one of `column`, `columns`, `topic`, `sum`"
    no_topic = item.field and item.topic is None
    no_pair = is_position and item.topic is None and count != 2
    no_four = not is_position and count and (count != 4 or not may_turn)
    no_counts = item.unit == COUNTS and signal_of(signal) not in COUNTED
    kind, at, four = "position" if is_position else "quaternion", f"at `{signal}`", "write `columns: [qx, qy, qz, qw]`"
    a_place = "write `column: NAME`, or `topic: NAME` where the log is a bag"
    _refuse(
        f"{place}:",
        (len(named) != 1, no_place, " and ".join(named) or "none of them", a_place),
        (no_topic, f"`{signal}` has a `field` without a `topic`", f"field: {item.field}", "name the `topic` too"),
        (no_pair, f"`{POSITION}` needs two columns", item.columns or item.column, "write `columns: [LAT, LON]`"),
        (
            no_four,
            "`columns` is for the four numbers of a quaternion",
            f"{count} columns {at}",
            four if may_turn else "use `column`",
        ),
        ((is_position or is_four) and item.sign != 1, f"a {kind} has no sign", at, "set `frame` instead"),
        (is_four and item.unit, "a quaternion has no unit", at, "set `frame` instead"),
        (extra, f"`{signal}` has a `{''.join(extra[:1])}` without counts", f"unit: {item.unit}", f"write `unit: {COUNTS}` too"),
        (no_counts, f"`{signal}` cannot be in {COUNTS!r}", f"{COUNTS} are those of a servo or a motor", "set its unit"),
    )


def _check_unit(signal: str, unit: str, place: str) -> None:
    """Raise MappingError unless the unit is known and fits the signal; a depth may be in a unit of pressure."""
    dimensions = fitting(signal)
    if not dimensions or unit == COUNTS or counts_unit(signal, unit) is not None:
        return
    pick_unit(unit, dimensions, f"{place}: `{signal}`", OF_FINS if signal_of(signal) in FINS else "")
