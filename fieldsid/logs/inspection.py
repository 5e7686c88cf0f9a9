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
from fieldsid.logs.few_of import SHOWN
from fieldsid.logs.importing import Importer
from fieldsid.logs.mapping.propose import propose
from fieldsid.logs.mapping.trial import Proposal
from fieldsid.logs.reader import WORTH_SALVAGING, ChannelInfo, FieldInfo, Inventory, ReadOptions, reader_of
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
SHORT = 120
"""Letters up to which a finding tells what was found beside what is wrong."""
_PLAIN = re.compile(r"^[A-Za-z/_][\w/.]*$")
_RESERVED = frozenset({"y", "n", "yes", "no", "on", "off", "true", "false", "null"})


@dataclass(frozen=True, slots=True)
class ShownChannel:
    """A channel as the page shows it."""

    name: Annotated[str, Key("Its name.")]
    type: Annotated[str, Key("Its type.")] = ""
    count: Annotated[int | Literal[""], Key("Number of samples; empty for a field.")] = ""
    rate: Annotated[str, Key("Samples per second, in words.")] = ""
    holds: Annotated[str, Key("Its range, or its first fields.")] = ""


@dataclass(frozen=True, slots=True, repr=False)
class Inspection(Brief):
    """What a log holds, the mapping proposed for it, the Run that gives (None when it gives none), and the findings."""

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
    """Return what is in a log, or in a run of several tables; `progress` is given the share that has been looked through.

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
    own = reader.own_map(path, options)
    looked, more = len(inventory.channels), inventory.more
    many = f"{looked + more} channels: the first {looked} by name were looked into for signals, {more} were not"
    notes_of_size = [Note("many_channels", many, {"more": more})] if more else []
    needs_none = own is not None and not {s for s in proposal.body["signals"] if s in MAIN} - own.sources.keys()
    run = proposal.run
    if mapping is not None or needs_none:
        run = load_run(path, mapping, msg_path=msg_path, joined=joined, salvage=True, max_gap_s=math.inf)
    proposed = [] if needs_none or mapping is not None else list(proposal.notes)
    notes = [*notes_of_size, *inventory.notes, *proposed, *(() if run is None else run.notes)]
    if proposal.problem is not None and run is None:
        what, found, hint = proposal.problem.what, proposal.problem.found, proposal.problem.hint
        said = f"{what} ({found})" if len(found) <= SHORT else what
        notes.append(Note("not_importable", f"{said}: {hint}" if hint else said, {"found": found, "hint": hint}))
    if not proposal.body["signals"] and run is None:
        notes.append(Note("nothing_recognised", "no name says what its numbers are: fill in `signals` in the mapping", {}))
    if not (set(FINS) & {*proposal.body["signals"], *(() if run is None else run.signals)} or joined):
        notes += tables_beside(path)
    chosen = given or (None if needs_none or run is None else mapping_of(proposal.body))
    way = WayIn() if run is None else way_in(path, run, notes, Importer(chosen, msg_path=msg_path, joined=tuple(joined)))
    if way.refusal is not None:
        what, found, hint = way.refusal.what, way.refusal.found, way.refusal.hint
        advice = f"import it with `{' '.join(way.options)}`" if way.options else hint
        notes.append(Note("refused", f"refused as it is: {what} ({found}); {advice}", {"found": found, "hint": hint}))
    distinct = {(n.code, n.message): n for n in notes if n.code != "ignored_columns"}
    return Inspection(inventory, proposal, run, tuple(distinct.values()), needs_none, way, tuple(joined))


def write_proposal(found: Inspection, path: Path, *, force: bool = False) -> Path:
    """Write the proposed mapping; raises MappingError when nothing was recognised at all, ArtifactError when the file exists."""
    if not found.inventory.channels:
        raise MappingError(
            f"nothing in `{found.inventory.path}` can be mapped",
            found="no columns and no topics",
            hint="check that this is the log you meant",
        )
    return write_text(path, found.yaml(), force=force)


def _line(item: dict[str, Any]) -> str:
    """Return one signal's source on one line of YAML; a name that YAML could take for something else is quoted."""
    return "{" + ", ".join(f"{key}: {_scalar(value)}" for key, value in item.items()) + "}"


def _scalar(value: Any) -> str:
    if isinstance(value, list):
        return "[" + ", ".join(_scalar(part) for part in value) + "]"
    if isinstance(value, dict):
        return _line(value)
    text = str(value)
    return (
        text
        if isinstance(value, (int, float)) or (_PLAIN.match(text) and text.lower() not in _RESERVED)
        else one_line(json.dumps(text, ensure_ascii=False))  # YAML reads these escapes too
    )


def shown_channels(channel: ChannelInfo) -> Iterator[ShownChannel]:
    """Yield the line of a column or a topic, and one for each of its fields where it has several."""
    rate = f"{channel.rate_hz:.4g}" if math.isfinite(channel.rate_hz) else "-"
    fields = [f for f in channel.fields if "covariance" not in f.path and not f.path.startswith("header.")]
    holds = _range(fields[0]) if len(fields) == 1 else ""
    yield ShownChannel(channel.name, channel.kind, channel.count, rate, holds)
    for info in fields[:SHOWN] if len(fields) > 1 else ():
        yield ShownChannel(f"  {info.path}", holds=_range(info))
    if len(fields) > SHOWN:
        yield ShownChannel(f"  +{len(fields) - SHOWN} more: --json")


def _range(info: FieldInfo) -> str:
    """Return the least and the largest of a number, its first values where there are none."""
    return ", ".join(map(_short, info.first)) if info.span is None else " .. ".join(map(_short, info.span))


def _short(value: Any) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)[:20]


LEFT_OUT = frozenset({"truncated", "bad_rows", "not_a_number", "no_time", "time_order"})
"""Codes of what a reading that takes all it can get has left out."""


@dataclass(frozen=True, slots=True)
class WayIn:
    """The options with which a log is imported, none where it is as it is; and why a plain import is refused."""

    options: tuple[str, ...] = ()
    refusal: FieldsidError | None = None


def way_in(path: Path, run: Run, notes: Iterable[Note], plain: Importer) -> WayIn:
    """Return how a log is imported of which `run` is all that could be read, with `notes` on it: the first way it is not refused.

    A log of which nothing was left out, and that has no long gap, is not read again: nothing of it is refused.
    """
    notes = list(notes)
    longest = max((g.length_s for s in MAIN if run.has(s) for g in gaps_in(run.time, run[s])), default=0.0)
    if longest <= MAX_GAP_S and not any(n.code in LEFT_OUT for n in notes):
        return WayIn()
    refusal: FieldsidError | None = None
    is_worth = _left(notes) >= WORTH_SALVAGING
    for options, importer in _ways(plain, round(longest + 0.1, 1), salvaging=is_worth):
        try:
            importer.read(path)
        except FieldsidError as error:
            refusal = refusal or error
        else:
            return WayIn(options, refusal)
    return WayIn((), refusal)


def _left(notes: Iterable[Note]) -> float:
    """Return the least share of the log's samples that a reading kept whose time repeats or goes back."""
    return min((1.0 - n.data["dropped"] / n.data["of"] for n in notes if n.code == "time_order"), default=1.0)


def _ways(plain: Importer, gap_s: float, *, salvaging: bool) -> Iterator[tuple[tuple[str, ...], Importer]]:
    for salvage in (False, True) if salvaging else (False,):
        asked = ("--salvage",) if salvage else ()
        yield asked, replace(plain, salvage=salvage)
        yield (*asked, "--max-gap", f"{gap_s:g}"), replace(plain, salvage=salvage, max_gap_s=gap_s)
