"""`sysid inspect` as a function: inventory, proposed mapping and findings of one log."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from fieldsid.artifacts import to_yaml, write_text
from fieldsid.display import Brief
from fieldsid.errors import FieldsidError, MappingError
from fieldsid.logs.channels import TableForm
from fieldsid.logs.convert.conditioning import MAIN, MAX_GAP_S, gaps_in
from fieldsid.logs.few_of import MOSTLY, SHOWN
from fieldsid.logs.importing import Importer
from fieldsid.logs.mapping.propose import propose
from fieldsid.logs.mapping.trial import Proposal
from fieldsid.logs.reader import ChannelInfo, FieldInfo, Inventory, ReadOptions, reader_of
from fieldsid.logs.readers._tables_of_run import tables_beside
from fieldsid.logs.run import FINS, Note, Run
from fieldsid.records.keys import Key
from fieldsid.text.one_line import one_line

_EXAMPLE = "# Nothing was recognised. A line for each signal is missing, with its own place and unit, of this form:\n"
_COLUMN_EXAMPLE = _EXAMPLE + "#   yaw_rad: {column: NAME_OR_PLACE_FROM_0, unit: UNIT}\n#   rudder_rad: {column: ..., unit: ...}\n"
_TOPIC_EXAMPLE = (
    _EXAMPLE + "#   yaw_rad: {topic: TOPIC, field: FIELD, unit: UNIT}\n#   rudder_rad: {topic: ..., field: ..., unit: ...}\n"
)
NO_TIME = "# No column is a time; say how many rows there are a second:\n# time: {rate: 10}\n"
_QUOTED_WORD = re.compile(r'(?<!\\)"(?!(?:y|n|yes|no|on|off|true|false|null)")([a-z/_][\w/.]*)"', re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class ShownChannel:
    """One line of the table of channels that the command prints."""

    name: Annotated[str, Key("Its name.")]
    type: Annotated[str, Key("Its type.")] = ""
    count: Annotated[int | Literal[""], Key("Number of samples; empty for a field.")] = ""
    rate: Annotated[str, Key("Samples per second, in words.")] = ""
    holds: Annotated[str, Key("Its range, or its first fields.")] = ""


@dataclass(frozen=True, slots=True, repr=False)
class Inspection(Brief):
    """The inventory of a log, the mapping proposed for it, the Run read with it (None where that fails), and the findings."""

    inventory: Inventory
    proposal: Proposal
    run: Run | None
    notes: tuple[Note, ...]
    needs_none: bool
    way_in: WayIn
    joined: tuple[Path, ...] = ()

    def yaml(self) -> str:
        """Return the proposed mapping as the text of a mapping.yaml."""
        head = f"# Proposed for {one_line(self.inventory.path.resolve().name)} by its names, types and numbers.\n"
        head += "# Check units, signs and frame before you trust it.\n"
        body = dict(self.proposal.body)
        signals = body.pop("signals")
        if "time" not in body and not self.inventory.by_topic:
            head += NO_TIME
        if signals:
            return head + to_yaml(body) + "signals:\n" + "".join(f"  {name}: {_line(item)}\n" for name, item in signals.items())
        return head + to_yaml(body) + "signals: {}\n" + (_TOPIC_EXAMPLE if self.inventory.by_topic else _COLUMN_EXAMPLE)


def inspect_log(
    path: Path,
    *,
    mapping: Path | None = None,
    msg_path: Path | None = None,
    joined: Sequence[Path] = (),
    progress: Callable[[float], None] | None = None,
) -> Inspection:
    """Return what is in a log, or in a run of several tables; `progress` is called with the share that has been read.

    Raises LogError when it cannot be read at all, MappingError for a mapping that does not fit.
    """
    from fieldsid.logs.load import load_run
    from fieldsid.logs.mapping.mapping_file import load_mapping, mapping_of

    given = None if mapping is None else load_mapping(mapping)
    clock = None if given is None else given.time
    reader, options = reader_of(path, joined), ReadOptions(msg_path, salvage=True, clock=clock, joined=tuple(joined))
    options = replace(options, progress=progress or options.progress)
    inventory = reader.inventory(path, options, TableForm() if given is None else given.table)
    proposal = propose(inventory, reader, options)
    own_map_found = reader.own_map(path, options)
    inspected, more = len(inventory.channels), inventory.more
    many = f"{inspected + more} channels: the first {inspected} by name were looked into for signals, {more} were not"
    notes_of_size = [Note("many_channels", many, {"more": more})] if more else []
    needs_none = (
        own_map_found is not None and not {s for s in proposal.body["signals"] if s in MAIN} - own_map_found.sources.keys()
    )
    run = proposal.run
    if mapping is not None or needs_none:
        run = load_run(path, mapping, msg_path=msg_path, joined=joined, salvage=True, max_gap_s=math.inf)
    proposed = [] if needs_none or mapping is not None else list(proposal.notes)
    notes = [*notes_of_size, *inventory.notes, *proposed, *(() if run is None else run.notes)]
    if proposal.problem is not None and run is None:
        problem, advice = proposal.problem, f": {proposal.problem.hint}" if proposal.problem.hint else ""
        notes.append(Note("not_importable", f"{problem.what} ({problem.found}){advice}", _data_of(problem)))
    if not proposal.body["signals"] and run is None:
        notes.append(Note("nothing_recognised", "no name says what its numbers are: fill in `signals` in the mapping", {}))
    if not (set(FINS) & {*proposal.body["signals"], *(() if run is None else run.signals)} or joined):
        notes += tables_beside(path)
    chosen = given or (None if needs_none or run is None else mapping_of(proposal.body))
    import_way = WayIn() if run is None else way_in(path, run, notes, Importer(chosen, msg_path=msg_path, joined=tuple(joined)))
    if import_way.refusal is not None:
        refusal, options_needed = import_way.refusal, " ".join(import_way.options)
        advice = f"import it with `{options_needed}`" if options_needed else refusal.hint
        notes.append(Note("refused", f"refused as it is: {refusal.what} ({refusal.found}); {advice}", _data_of(refusal)))
    distinct = {(n.code, n.message): n for n in notes if n.code != "ignored_columns"}
    return Inspection(inventory, proposal, run, tuple(distinct.values()), needs_none, import_way, tuple(joined))


def _data_of(error: FieldsidError) -> dict[str, str]:
    return {"found": error.found, "hint": error.hint}


def write_proposal(found: Inspection, path: Path, *, force: bool = False) -> Path:
    """Write the proposed mapping; raises MappingError when nothing was recognised at all, ArtifactError when the file exists."""
    if not found.inventory.channels:
        what, hint = f"nothing in `{found.inventory.path}` can be mapped", "check that this is the log you meant"
        raise MappingError(what, found="no columns and no topics", hint=hint)
    return write_text(path, found.yaml(), force=force)


def _line(item: dict[str, Any]) -> str:
    """Return one signal's source on one line of YAML, which takes JSON; a word needs no quotes, unless YAML parses it."""
    return one_line(_QUOTED_WORD.sub(r"\1", json.dumps(item, ensure_ascii=False)))


def shown_channels(channel: ChannelInfo) -> Iterator[ShownChannel]:
    """Yield the line of a column or a topic, and one line for each field where it has several."""
    rate = f"{channel.rate_hz:.4g}" if math.isfinite(channel.rate_hz) else "-"
    fields = [f for f in channel.fields if "covariance" not in f.path and not f.path.startswith("header.")]
    holds = _range(fields[0]) if len(fields) == 1 else ""
    yield ShownChannel(channel.name, channel.kind, channel.count, rate, holds)
    for info in fields[:SHOWN] if len(fields) > 1 else ():
        yield ShownChannel(f"  {info.path}", holds=_range(info))
    if len(fields) > SHOWN:
        yield ShownChannel(f"  +{len(fields) - SHOWN} more: --json")


def _range(info: FieldInfo) -> str:
    """Return the smallest and largest value of a field, or its first values where it is not a number."""
    return ", ".join(map(_short, info.first)) if info.span is None else " .. ".join(map(_short, info.span))


def _short(value: Any) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)[:20]


LEFT_OUT = frozenset({"truncated", "bad_rows", "not_a_number", "no_time", "time_order"})
"""Codes of the notes on samples that a reading with salvage left out."""


@dataclass(frozen=True, slots=True)
class WayIn:
    """The options that an import of the log needs (none where a plain import succeeds), and the error of a plain import."""

    options: tuple[str, ...] = ()
    refusal: FieldsidError | None = None


def way_in(path: Path, run: Run, notes: Iterable[Note], plain: Importer) -> WayIn:
    """Return the first combination of import options under which a log is not refused.

    `run` holds all that could be read of the log, and `notes` are the notes on it. A log of which nothing was left out, and that
    has no long gap, is not read again: a plain import accepts it.
    """
    notes = list(notes)
    longest = max((g.length_s for s in MAIN if run.has(s) for g in gaps_in(run.time, run[s])), default=0.0)
    if longest <= MAX_GAP_S and not any(n.code in LEFT_OUT for n in notes):
        return WayIn()
    refusal: FieldsidError | None = None
    is_worth_salvaging = _share_kept(notes) >= MOSTLY
    for options, importer in _importers(plain, round(longest + 0.1, 1), salvaging=is_worth_salvaging):
        try:
            importer.read(path)
        except FieldsidError as error:
            refusal = refusal or error
        else:
            return WayIn(options, refusal)
    return WayIn((), refusal)


def _share_kept(notes: Iterable[Note]) -> float:
    """Return the smallest share of samples that was kept where the time repeats or goes back; 1 where it does neither."""
    return min((1.0 - n.data["dropped"] / n.data["of"] for n in notes if n.code == "time_order"), default=1.0)


def _importers(plain: Importer, gap_s: float, *, salvaging: bool) -> Iterator[tuple[tuple[str, ...], Importer]]:
    for salvage in (False, True) if salvaging else (False,):
        salvage_option = ("--salvage",) if salvage else ()
        yield salvage_option, replace(plain, salvage=salvage)
        yield (*salvage_option, "--max-gap", f"{gap_s:g}"), replace(plain, salvage=salvage, max_gap_s=gap_s)
