"""What becomes of a log: inspect, import and simulate."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from fieldsid.logs.importing import Imported
from fieldsid.logs.inspection import Inspection, ShownChannel, shown_channels
from fieldsid.logs.reader import ChannelInfo
from fieldsid.logs.run import Note
from fieldsid.records.keys import Key, Number, Result
from fieldsid.results.result import OfLogs

LISTED = 100
"""Channels that are listed; of more, how many there are."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Inspected(Result):
    """What is in a log, the mapping proposed for it, and the import doctor's findings."""

    SCHEMA = "fieldsid/inspection/1"

    path: Annotated[str, Key("The log.")]
    format: Annotated[str, Key("Its format, such as `text table`, `ROS 2 bag`.")]
    span: Annotated[str, Key("Its length, in words.")]
    duration_s: Annotated[Number, Key("Its length.")]
    channels: Annotated[tuple[ChannelInfo, ...], Key("What is in it, the first hundred.")]
    shown: Annotated[tuple[ShownChannel, ...], Key("The same as the page shows it.")]
    more_channels: Annotated[int, Key("How many channels there are besides.")]
    mapping_needed: Annotated[bool, Key("False where the columns have the canonical names.")]
    mapping: Annotated[Mapping[str, Any], Key("The proposed mapping, as `mapping.yaml` has it.")]
    mapping_file: Annotated[str | None, Key("Where it was written.")]
    signals: Annotated[tuple[str, ...], Key("The signals that the mapping gives.")]
    problem: Annotated[str | None, Key("Why no run can be made of it, where none can.")]
    joined: Annotated[tuple[str, ...], Key("The other tables of its run, where they were named with `--join`.")]
    import_options: Annotated[tuple[str, ...], Key("What an import must be asked for, where it refuses the log as it is.")]
    findings: Annotated[tuple[Note, ...], Key("The import doctor's findings.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Import(OfLogs):
    """The runs that `sysid import` wrote."""

    SCHEMA = "fieldsid/import/1"

    runs: Annotated[tuple[Imported, ...], Key("One for each log.")]
    already_imported: Annotated[tuple[str, ...], Key("Logs whose runs were there, made of the same bytes of log and mapping.")]


@dataclass(frozen=True, slots=True)
class SignalRange:
    """Smallest, largest and last value of a signal, in the unit its name has."""

    low: Annotated[float, Key("Smallest value.")]
    high: Annotated[float, Key("Largest value.")]
    end: Annotated[float, Key("Last value.")]


@dataclass(frozen=True, slots=True)
class Simulation(Result):
    """A model's own prediction, kept as a run."""

    SCHEMA = "fieldsid/simulation/1"

    model: Annotated[str, Key("The model's file.")]
    run: Annotated[str, Key("Name of the run.")]
    file: Annotated[str | None, Key("Where it was written.")]
    samples: Annotated[int, Key("Number of samples.")]
    seconds: Annotated[float, Key("Length.")]
    signals: Annotated[Mapping[str, SignalRange], Key("Range of each signal.")]


def inspected(found: Inspection, written: Path | None) -> Inspected:
    """Return an inspection as the command tells it; written: the mapping file, where one was."""
    inventory, run = found.inventory, found.run
    duration = inventory.duration_s if run is None else float(run.time[-1] - run.time[0])
    listed = inventory.channels[:LISTED]
    return Inspected(
        path=str(inventory.path),
        format=inventory.form,
        span=f"{duration:.2f} s" if math.isfinite(duration) else "length unknown",
        duration_s=duration,
        channels=listed,
        shown=tuple(row for c in listed for row in shown_channels(c)),
        more_channels=max(len(inventory.channels) - LISTED, 0) + inventory.more,
        mapping_needed=not found.needs_none,
        mapping=found.proposal.body,
        mapping_file=None if written is None else str(written),
        signals=() if run is None else tuple(s for s in run.signals if run.has(s)),
        problem=None if found.proposal.problem is None else str(found.proposal.problem),
        joined=tuple(map(str, found.joined)),
        import_options=tuple(found.way_in.options),
        findings=found.notes,
    )
