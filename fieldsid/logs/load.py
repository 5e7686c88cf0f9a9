"""Reading any log file as a Run: every command that takes a run calls `load_run`."""

from __future__ import annotations

import shlex
import sys
import tempfile
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from fieldsid.errors import FieldsidError, MappingError
from fieldsid.logs.channels import ATTITUDE, AXES, ChannelMap, Source, TableForm, is_enough
from fieldsid.logs.convert.assemble import WHOLE, assemble
from fieldsid.logs.convert.conditioning import MAX_GAP_S
from fieldsid.logs.few_of import few_of
from fieldsid.logs.mapping.canonical_names import canonical
from fieldsid.logs.mapping.vocabulary import TIME
from fieldsid.logs.reader import JOINED, Inventory, RawLog, Reader, ReadOptions, reader_of
from fieldsid.logs.run import OF_LIMITS, READ_WITH, STEP_LINES, Note, Run, signal_of
from fieldsid.records.reading import read_yaml

MAPPING_FILE = "mapping.yaml"
WANTED = frozenset({"yaw_rad", "yaw_rate_rad_s", "surge_m_s"})
"""Signals that are sought under other names as well, where the canonical names in a log suffice for an axis without them."""


def load_run(
    path: Path | str,
    mapping: ChannelMap | Path | None = None,
    *,
    channels: Mapping[str, Source] | None = None,
    msg_path: Path | None = None,
    joined: Sequence[Path] = (),
    salvage: bool = False,
    max_gap_s: float = MAX_GAP_S,
    part: tuple[float, float] = WHOLE,
    fin_max_rad: Mapping[str, float] | None = None,
    progress: Callable[[float], None] | None = None,
    recognise: bool = False,
    otherwise: ChannelMap | Path | None = None,
) -> Run:
    """Read a log file or bag folder as a Run, with the doctor's findings as notes; `-` reads standard input.

    mapping: a ChannelMap or a mapping.yaml. Without one: the canonical column names, else `mapping.yaml` in the
    working folder, else in the folder of the log. channels: sources that override those of the mapping. joined: the other tables
    where a run consists of several tables. salvage: read what is readable of a damaged log. max_gap_s: longest gap allowed in a
    main signal. part: the times in s between which the log is read and examined. fin_max_rad: fin limits by signal, for the
    finding of saturation. progress: called repeatedly with the share of the log that has been read. recognise: read a log without
    a mapping by what `inspect` proposes, where nothing that an axis needs is in doubt; where the canonical names in the log
    suffice for an axis, certain proposals are added to them in any case. otherwise: the mapping for a log without one, used where
    the canonical names do not suffice and the log holds every column of that mapping. Raises LogError or MappingError, and
    DataError where the part is empty.
    """
    if str(path) == "-":
        more = {"channels": channels, "salvage": salvage, "max_gap_s": max_gap_s, "part": part, "fin_max_rad": fin_max_rad}
        return _from_stdin(mapping, **more, recognise=recognise, otherwise=otherwise)
    path = Path(path)
    reader, options = reader_of(path, joined), ReadOptions(msg_path, salvage, joined=tuple(joined))
    chosen, notes = map_for(path, reader, options, mapping, channels or {}, recognise=recognise, otherwise=otherwise)
    command = _command(path, chosen, channels or {}, options)
    options = replace(options, command=command, progress=progress or options.progress)
    raw = reader.read(path, chosen, options)
    run = assemble(raw, chosen, path, options, part=part, max_gap_s=max_gap_s)
    if raw.finished:
        return _examined_again(run, fin_max_rad or {})
    return judged(replace(run, notes=(*notes, *run.notes)), raw, chosen, fin_max_rad)


def judged(run: Run, raw: RawLog, mapping: ChannelMap, fin_max_rad: Mapping[str, float] | None = None) -> Run:
    """Return a run that was read with a mapping, with the doctor's findings appended to its notes."""
    from fieldsid.logs.doctor.examine import examine
    from fieldsid.logs.doctor.stated import stated_by

    return replace(run, notes=(*run.notes, *examine(run, fin_max_rad, stated_by(mapping, raw))))


def _examined_again(run: Run, fin_max_rad: Mapping[str, float]) -> Run:
    """Return an imported run with the notes of its import, except those that depend on fin limits, which are examined again.

    The fin limits may have been corrected since the import.
    """
    kept = tuple(n for n in run.notes if n.code not in OF_LIMITS)
    if not fin_max_rad:
        return replace(run, notes=kept)
    from fieldsid.logs.doctor.fin_findings import limit_findings

    return replace(run, notes=(*kept, *limit_findings(run, fin_max_rad)))


def _command(path: Path, mapping: ChannelMap, channels: Mapping[str, Source], options: ReadOptions) -> str:
    """Return the command that imports a log with the options of this reading."""
    words = ["sysid", "import", *(["--join"] if options.joined else []), str(path), *map(str, options.joined)]
    words += ["--mapping", str(mapping.origin)] if mapping.origin else []
    for signal, source in channels.items():
        words += ["--channel", f"{signal}={source.column}" + (f":{source.unit}" if source.unit else "")]
    words += ["--msg-path", str(options.msg_path)] if options.msg_path else []
    return shlex.join([*words, *(["--salvage"] if options.salvage else [])])


def map_for(
    path: Path,
    reader: Reader,
    options: ReadOptions,
    mapping: ChannelMap | Path | None,
    channels: Mapping[str, Source],
    *,
    recognise: bool = False,
    otherwise: ChannelMap | Path | None = None,
) -> tuple[ChannelMap, list[Note]]:
    """Return the mapping with which a log is read, and a note where a mapping file was found or the log was recognised.

    Raises MappingError where there is no mapping.
    """
    notes: list[Note] = []
    chosen = _as_channel_map(mapping) if mapping is not None else reader.own_map(path, options)
    if chosen is None:
        file = next((f for f in (Path(MAPPING_FILE), path.parent / MAPPING_FILE) if f.is_file() and maps_anything(f)), None)
        chosen = None if file is None else _as_channel_map(file)
    if mapping is None and otherwise is not None and (chosen is None or not is_enough(chosen.sources)):
        named = _as_channel_map(otherwise)
        chosen = named if _is_in_log(named, reader.inventory(path, options, named.table)) else chosen
    complete = chosen_map(None, chosen, channels)
    is_open = mapping is None and not channels and (chosen is None or chosen.origin is None)
    mapped_signals = frozenset[str]() if complete is None else frozenset(complete.sources)
    may_join = is_open and (recognise or is_enough(mapped_signals))
    has_all = is_enough(mapped_signals) and (mapped_signals >= WANTED or _uses_every_column(complete, path, reader))
    if complete is None or (may_join and not has_all):
        from fieldsid.logs.mapping.certain import certain_of
        from fieldsid.logs.mapping.propose import propose

        found = reader.inventory(path, options, TableForm())
        proposal = propose(found, reader, options) if may_join else None
        certain = None if proposal is None else certain_of(proposal)
        mapped = None if certain is None else certain.mapping
        # signals with canonical names are certain: where they suffice, proposed ones are added and replace none of them
        if (
            certain is not None
            and mapped is not None
            and (not is_enough(mapped_signals) or _with_numbers(complete, found) < mapped.sources.keys())
        ):
            return mapped, list(certain.notes)
        notes += [] if certain is None else certain.left_out_beside(mapped_signals)
        if complete is None and proposal is not None and proposal.problem is not None and is_enough(proposal.body["signals"]):
            raise proposal.problem
        if complete is None:
            raise _no_mapping_error(path, reader, options, found, {} if certain is None else certain.doubts)
    if complete.origin is not None:
        notes.append(Note(READ_WITH, f"read with `{complete.origin}`", {"path": str(complete.origin)}))
    return complete, notes


def chosen_map(mapping: ChannelMap | Path | None, own: ChannelMap | None, channels: Mapping[str, Source]) -> ChannelMap | None:
    """Return the mapping, else that of the log's own names, overridden by single channels; None where all are missing."""
    base = own if mapping is None else _as_channel_map(mapping)
    if base is None and not channels:
        return None
    base = base or ChannelMap({})
    sources = {s: c for s, c in channels.items() if s != TIME}
    lines = {line for fin in sources for line in STEP_LINES.get(fin, ())}  # the step lines of a fin whose column is replaced
    kept = {s: c for s, c in base.sources.items() if s not in lines and signal_of(s) not in sources}
    return replace(base, sources={**kept, **sources}, time=channels.get(TIME, base.time))


def maps_anything(mapping: Path) -> bool:
    """Whether a mapping has a line for any signal; the template that `sysid init` writes has none."""
    return bool(read_yaml(mapping).get("signals", True))


def needs_mapping(log: Path) -> bool:
    """Whether the canonical names in a log do not suffice for an axis; raises LogError."""
    own = reader_of(log).own_map(log, ReadOptions())
    return own is None or not is_enough(own.sources)


def to_map(log: Path, joined: Sequence[Path] = ()) -> str:
    """Return the command that writes a first mapping of a log; it overwrites a mapping file that exists."""
    words = ["sysid", "inspect", *(["--join"] if joined else []), str(log), *map(str, joined), "--write-mapping", MAPPING_FILE]
    return shlex.join([*words, *(["--force"] if Path(MAPPING_FILE).is_file() else [])])


def _is_in_log(mapping: ChannelMap, found: Inventory) -> bool:
    """Return whether a log contains every column and topic that a mapping names."""
    return _places_of(mapping) <= {c.name for c in found.channels}


def _with_numbers(mapping: ChannelMap | None, found: Inventory) -> set[str]:
    """Return the signals that a mapping names, without those whose columns are empty."""
    empty = {c.name for c in found.channels if not c.count}
    sources = {} if mapping is None else mapping.sources
    return {s for s, source in sources.items() if not source.places or not {str(p) for p in source.places} <= empty}


def _uses_every_column(mapping: ChannelMap | None, path: Path, reader: Reader) -> bool:
    """Whether a mapping names every column of a table, so that no column is left to be recognised."""
    return mapping is not None and reader.names_of is not None and set(reader.names_of(path)) <= _places_of(mapping)


def _places_of(mapping: ChannelMap) -> set[str]:
    """Return the columns and topics that a mapping names."""
    sources = [*mapping.sources.values(), *([] if mapping.time is None else [mapping.time])]
    return {str(place) for s in sources for place in (s.places if s.topic is None else (s.topic,))}


def _as_channel_map(mapping: ChannelMap | Path) -> ChannelMap:
    if isinstance(mapping, ChannelMap):
        return mapping
    from fieldsid.logs.mapping.mapping_file import load_mapping

    return load_mapping(mapping)


def _no_mapping_error(
    path: Path, reader: Reader, options: ReadOptions, found: Inventory, doubts: Mapping[str, str]
) -> MappingError:  # fmt: skip
    from fieldsid.logs.readers._tables_of_run import tables_beside

    names = [c.name for c in found.channels]
    shown = few_of(names)
    hint = f"write a mapping: `{to_map(path, options.joined)}`"
    hint += f"; in doubt: {', '.join(f'{signal} ({why})' for signal, why in doubts.items())}" if doubts else ""
    if found.by_topic:
        what = "bag" if found.form.endswith("bag") else "run in several tables" if reader.name == JOINED else "log of topics"
        return MappingError(f"`{path}` is a {what} and needs a mapping", found=f"topics {shown or 'none'}", hint=hint)
    close, proposed = _near_names(found)
    hint += f"; {close}" if close else ""
    hint += "" if is_enough(proposed) else "".join(f"; {note.message}" for note in tables_beside(path))
    if found.no_clock is not None:
        reason = found.no_clock[1]
        return MappingError(f"`{path}` has no clock: {reason.what}", found=reason.found, hint=f"{reason.hint}; {hint}")
    missing = _missing_kinds(proposed)
    if missing:
        what = f"no column of numbers in `{path}` is known by its name as {' or '.join(missing)}"
    else:
        what = f"`{path}` needs a mapping: not all of its columns have the names of signals"
    return MappingError(what, found=f"columns {shown}", hint=hint)


def _missing_kinds(signals: Collection[str]) -> list[str]:
    """Return, in words, the kinds of signal that a run needs and that are missing among the signals."""
    motions, fins = ({s for axis in AXES for s in axis[i]} for i in range(2))
    kinds = ("time", {TIME}), ("the vehicle's angle or rate", motions | {ATTITUDE}), ("a fin's angle", fins)
    return [words for words, any_of in kinds if not any_of & set(signals)]


def _near_names(found: Inventory) -> tuple[str, Collection[str]]:
    """Return, in words, which signals the columns without canonical names probably are, and all signals that are proposed."""
    from fieldsid.logs.mapping.draft import draft_of, place_of

    body = draft_of(found).body
    lines = ({TIME: body["time"]} if "time" in body else {}) | body["signals"]
    pairs = [f"`{place_of(item)}` may be `{signal}`" for signal, item in lines.items() if canonical(place_of(item)) is None]
    return few_of(pairs), lines


def _from_stdin(mapping: ChannelMap | Path | None, **more: Any) -> Run:
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "stdin"
        copy.write_bytes(sys.stdin.buffer.read())
        try:
            run = load_run(copy, mapping, **more)
        except FieldsidError as error:
            what, found, hint = (text.replace(str(copy), "-") for text in (error.what, error.found, error.hint))
            raise type(error)(what, found=found, hint=hint) from error
    return Run("stdin", run.time, run.signals, None, run.notes)
