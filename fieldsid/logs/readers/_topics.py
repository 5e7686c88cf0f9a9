"""Inventory and signals of logs of topics, each with its own clock: shared by the readers of several formats."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field, replace
from importlib import import_module
from io import StringIO
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from fieldsid.errors import LogError, MappingError
from fieldsid.logs.channels import COMBINED, ChannelMap, Source, TableForm
from fieldsid.logs.convert.times.time_column import origin_note
from fieldsid.logs.few_of import few_of
from fieldsid.logs.mapping.canonical_names import unit_of_field
from fieldsid.logs.reader import (
    DEFINED,
    MOST_CHANNELS,
    ChannelInfo,
    FieldInfo,
    Inventory,
    RawLog,
    Reader,
    ReadOptions,
    Series,
    rate_of,
    span_of,
)
from fieldsid.logs.run import Note
from fieldsid.logs.several.run_names import stem_of
from fieldsid.logs.unknown_file import COPY_AGAIN
from fieldsid.numerics.arrays import FloatArray
from fieldsid.registry import near

DATA = "data"
"""Name of the field of a topic that is a single number."""
Means = Mapping[str, tuple[str, Mapping[str, Any]]]
"""Signals by the definition of a format: by `topic.field`, the signal and the keys of a mapping with which it is read."""


@dataclass(frozen=True, slots=True)
class Topic:
    """One topic: time (n,) in s, its numbers (n,) by field, and the unit that the log states for a topic of a single number."""

    time: FloatArray
    fields: Mapping[str, FloatArray]
    unit: str | None = None


@dataclass(frozen=True, slots=True)
class Topics:
    """The content of a log: topics by name, their meaning by the format, notes, and the number of topics that were not read."""

    by_name: Mapping[str, Topic | None]
    means: Means = field(default_factory=lambda: MappingProxyType({}))
    notes: tuple[Note, ...] = ()
    more: int = 0


def topic_reader(
    name: str,
    says: str,
    suffixes: tuple[str, ...],
    form: str,
    sniff: Callable[[Path], bool],
    found: Callable[[Path, ReadOptions, frozenset[str]], Topics],
    kind: str = DEFINED,
) -> Reader:
    """Return the reader of a format of topics.

    `found` reads the topics of a log; its last argument names topics that must be included, and if it is empty all are read.
    The reader's inventory has each topic with count, rate and first numbers. It reads the mapped fields, and raises MappingError
    for one that is missing, in addition to the LogError that `found` raises.
    """

    def inventory(path: Path, options: ReadOptions, written: TableForm) -> Inventory:
        return inventory_of(path, form, found(path, options, frozenset()), kind=kind)

    def read(path: Path, mapping: ChannelMap, options: ReadOptions) -> RawLog:
        return raw_log_of(path, found(path, options, wanted_by(mapping)), mapping)

    return Reader(name, says, suffixes, sniff, inventory, read)


def wanted_by(mapping: ChannelMap) -> frozenset[str]:
    """Return the topics that a mapping names."""
    return frozenset(source.topic for source in mapping.sources.values() if source.topic is not None)


def library(module: str, path: Path, what: str, extra: str) -> Any:
    """Return an optional library; raises LogError with the kind of the log and the command that installs the library."""
    try:
        return import_module(module)
    except ImportError as error:
        name = module.partition(".")[0]
        raise LogError(
            f"`{path}` is {what}, which is read with `{name}`, and that is not installed",
            found=str(error),
            hint=f"install it: `pip install 'fieldsid[{extra}]'`",
        ) from error


@contextmanager
def silenced() -> Iterator[None]:
    """Suppress what a library prints about a damaged log, which would mix with the data on stdout; a note reports it once."""
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        yield


def inventory_of(path: Path, form: str, log: Topics, *, kind: str = DEFINED) -> Inventory:
    """Return the inventory of a log of topics in north-east-down axes; raises LogError where it has no topic with data.

    `kind` is the word for a topic; with DEFINED the format defines its topics, and nothing is guessed by their names.
    """
    topics = _not_empty(path, log)
    names = sorted(topics)
    channels = tuple(_channel(name, topics[name], log.means, kind) for name in names[:MOST_CHANNELS])
    ends = [(float(t.time[0]), float(t.time[-1])) for t in topics.values()]
    duration = max(end for _, end in ends) - min(start for start, _ in ends)
    more = log.more + len(names) - len(channels)
    return Inventory(path, form, duration, channels, notes=log.notes, frame="NED/FRD", more=more)


def _channel(name: str, topic: Topic, means: Means, kind: str) -> ChannelInfo:
    bare = name.partition("[")[0]
    several = {p: m for key, m in means.items() if (p := key.removeprefix(f"{bare}.")) != key and ", " in p}
    fields = [
        FieldInfo(p, "number", tuple(v[:3].tolist()), span_of(v), means.get(f"{bare}.{p}")) for p, v in topic.fields.items()
    ]
    fields += [
        FieldInfo(p, "numbers", (), None, m) for p, m in several.items() if all(part in topic.fields for part in p.split(", "))
    ]
    return ChannelInfo(name, kind, int(topic.time.size), rate_of(topic.time), tuple(fields), topic.unit)


def _not_empty(path: Path, log: Topics) -> dict[str, Topic]:
    """Return the topics of a log that have a time; raises LogError where none has."""
    topics = {name: topic for name, topic in log.by_name.items() if topic is not None}
    if not topics:
        raise LogError(f"`{path}` has no data", found="no topic with a number and a time", hint=COPY_AGAIN)
    return topics


def raw_log_of(path: Path, log: Topics, mapping: ChannelMap) -> RawLog:
    """Return the mapped fields with time 0 at the first of their stamps; raises MappingError for a missing topic or field."""
    topics = _not_empty(path, log)
    picked = {signal: _picked(path, topics, signal, source) for signal, source in mapping.sources.items()}
    origin = min((float(s.time[0]) for s in picked.values()), default=0.0)
    series = {signal: replace(s, time=s.time - origin) for signal, s in picked.items()}
    return RawLog(stem_of(path), series, (*log.notes, origin_note(origin)), one_clock=False)


def topic_name(path: Path, what: str, topics: Collection[str], signal: str, source: Source) -> str:
    """Return the topic that a source names; raises MappingError where it names none, or one that the log does not have."""
    if source.topic is None:
        raise MappingError(
            f"`{signal}` is mapped to a {source.label}, but `{path}` is {what}",
            found=source.label,
            hint="name a `topic` and a `field`",
            signal=signal,
        )
    if source.topic not in topics:
        raise MappingError(
            f"`{path}` has no topic `{source.topic}` for `{signal}`",
            found=few_of(sorted(topics)) or "no topics",
            hint=near(source.topic, list(topics)),
            signal=signal,
        )
    return source.topic


def _picked(path: Path, topics: Mapping[str, Topic], signal: str, source: Source) -> Series:
    name_of_topic = topic_name(path, "a log of topics", topics, signal, source)
    topic = topics[name_of_topic]
    fields = [part.strip() for part in (source.path or DATA).split(",")]
    for name in fields:
        if name not in topic.fields:
            raise MappingError(
                f"topic `{name_of_topic}` has no field `{name}` for `{signal}`",
                found=few_of(list(topic.fields)),
                hint=near(name, list(topic.fields)),
                signal=signal,
            )
    values = [topic.fields[name] for name in fields]
    unit = None if signal in COMBINED else unit_of_field(name_of_topic, fields[0], signal, topic.unit)
    return Series(topic.time, values[0] if len(values) == 1 else np.stack(values, axis=1), source.label, unit)


def topic_of(time: FloatArray, fields: Mapping[str, FloatArray], unit: str | None = None) -> Topic | None:
    """Return a topic sorted by time, with the last sample of each group of equal times; None where there is no time."""
    good = np.isfinite(time)
    order = np.flatnonzero(good)[np.argsort(time[good], kind="stable")]
    kept = order[np.append(np.diff(time[order]) > 0.0, True)] if order.size else order
    if not kept.size:
        return None
    return Topic(time[kept], MappingProxyType({name: v[kept] for name, v in fields.items()}), unit)
