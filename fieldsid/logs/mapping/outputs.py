"""Which output of a vehicle's servos moves which fin, where no name says it: the one that the yaw rate follows.

The pulses of an output turn the vehicle as a fin does, r' = a r + b delta. Where one of the outputs explains clearly more of the
change of the rate than the others it is the rudder; where none does, all are named with the line that is missing.
"""

from __future__ import annotations

import json
import re

import numpy as np

from fieldsid.errors import LogError, MappingError
from fieldsid.logs.channels import ChannelMap, Source
from fieldsid.logs.convert.servo_counts import COUNTS, SERVOS
from fieldsid.logs.mapping.name_words import words_of
from fieldsid.logs.mapping.numbers.recognise import Recognised, moving_fin
from fieldsid.logs.mapping.trial import Log
from fieldsid.logs.reader import Inventory, Samples, Series
from fieldsid.logs.run import Note, Run
from fieldsid.numerics.arrays import FloatArray

OUTPUTS = frozenset({"servo", "servomotor", "actuator", "rcou", "outputs", "controls"})
"""Words of what a vehicle's servos are told or say."""
_OUTPUT = re.compile(r"^(value|servo\d+_raw|C\d+|(output|control|position)\[\d+\])$")
"""Fields of these that are an angle or a pulse."""
SAME_S = 1e-6
"""Times nearer to each other are one: a difference of large ones is not exact."""
SHOWN = 8
"""Outputs that a message names."""
Output = tuple[str, str]
"""A topic and its field."""


def outputs_of(inventory: Inventory) -> list[Output]:
    """Return the outputs of a log's servos."""
    fields = [(c.name, f.path) for c in inventory.channels for f in c.fields]
    return [(topic, path) for topic, path in fields if OUTPUTS & set(words_of(f"{topic} {path}")) and _OUTPUT.search(path)]


def rudder_among(run: Run, outputs: list[Output], log: Log) -> Recognised | None:
    """Return the output that is the rudder by what the motion of a run follows; None where none stands out."""
    signal = next((s for s in ("yaw_rate_rad_s", "yaw_rad") if run.has(s)), None)
    if signal is None:
        return None
    sources = {str(i): Source(topic=topic, path=field) for i, (topic, field) in enumerate(outputs)}
    try:
        raw = log.read(ChannelMap(sources))
    except (LogError, MappingError):  # an output that cannot be read is no fin
        return None
    time = run.time + _origin_s(run.notes) - _origin_s(raw.notes)
    single = {int(place): series for place, series in raw.series.items() if series.values.ndim == 1}
    columns: dict[str | int, FloatArray] = {place: _held(series, time) for place, series in single.items()}
    columns[signal] = run[signal]
    return moving_fin(Samples(run.time, columns, Source()), {signal: signal}, list(single))


def _origin_s(notes: tuple[Note, ...]) -> float:
    """Return the log's own time at time 0, in s: two readings of other fields start at other messages."""
    return next((1e-9 * n.data["origin_ns"] for n in notes if n.code == "time_origin"), 0.0)


def _held(series: Series, time: FloatArray) -> FloatArray:
    """Return an output held from sample to sample, at some times (n,)."""
    before = np.searchsorted(series.time, time + SAME_S, side="right") - 1
    return np.where(before >= 0, series.values[np.maximum(before, 0)], np.nan)


def _unit_by_span(span: tuple[float, float] | None) -> str:
    """Return the unit of an output by its least and largest, as a mapping has it: pulses, or shares of its range."""
    if span is None or span == (0.0, 0.0):
        return ""
    if max(map(abs, span)) <= 1.0:
        return ', unit: "1"'
    servo = next((s for s in SERVOS[1:] if s.least <= span[0] and span[1] <= s.largest), None)
    return "" if servo is None else f", unit: {COUNTS}, centre: {servo.centre:g}"


def which_output(outputs: list[Output], inventory: Inventory) -> Note:
    """Return the note that names the outputs, and the line that is missing."""
    shown = ", ".join(f"{topic} {path}" for topic, path in outputs[:SHOWN]) + (", ..." if len(outputs) > SHOWN else "")
    topic, path = outputs[0]
    spans = {(c.name, f.path): f.span for c in inventory.channels for f in c.fields}
    unit = _unit_by_span(spans.get((topic, path)))
    message = (
        f"which servo moves which fin is not in the log; one line is missing, as `rudder_rad: {{topic: {json.dumps(topic)}, "
        f"field: {json.dumps(path)}{unit}}}`, of: {shown}"
    )
    return Note("which_output", message, {"signal": "rudder_rad", "others": [f"{t} {p}" for t, p in outputs]})
