"""A mapping that was drafted, tried on the log itself: degrees by size, then what the findings on the run it gives say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fieldsid.errors import FieldsidError
from fieldsid.logs.channels import ChannelMap
from fieldsid.logs.mapping.draft import unit_by_size
from fieldsid.logs.mapping.mend import mended
from fieldsid.logs.mapping.numbers.heading_units import heading_in_doubt, unit_of_wraps, wraps_in_rad
from fieldsid.logs.mapping.numbers.unit_evidence import assumed_units, said_of_assumed
from fieldsid.logs.reader import Inventory, RawLog, Reader, ReadOptions, Series
from fieldsid.logs.run import GOALS, Note, Run

MENDS = 6
"""Readings of the log with what the last one's findings have set: a unit, a frame and the signs of two rates come in turn."""


@dataclass(frozen=True, slots=True)
class Log:
    """A log, what is in it, and how it is read: damage is left out."""

    inventory: Inventory
    reader: Reader
    options: ReadOptions

    def read(self, mapping: ChannelMap) -> RawLog:
        """Return what a mapping names; raises LogError and MappingError."""
        return self.reader.read(
            self.inventory.path, mapping, ReadOptions(self.options.msg_path, salvage=True, joined=self.options.joined)
        )


@dataclass(frozen=True, slots=True)
class Proposal:
    """A mapping's body, the Run it gives, or why it gives none, and what speaks for it or for others."""

    body: dict[str, Any]
    run: Run | None = None
    problem: FieldsidError | None = None
    notes: tuple[Note, ...] = ()

    def saying(self, *notes: Note) -> Proposal:
        """Return the proposal with notes before its own."""
        return replace(self, notes=(*notes, *self.notes))


def tried(log: Log, body: dict[str, Any], defined: frozenset[str]) -> Proposal:
    """Read the log with a mapping's body, and set in it what the numbers say; raises LogError, MappingError and DataError."""
    from fieldsid.logs.convert.assemble import assemble
    from fieldsid.logs.doctor.examine import examine
    from fieldsid.logs.doctor.stated import stated_by
    from fieldsid.logs.mapping.mapping_file import mapping_of

    raw, signals = log.read(mapping_of(body)), body["signals"]
    by_size = _in_degrees(raw, signals)
    why: list[Note] = []
    for _ in range(MENDS):
        mapping = mapping_of(body)
        run = assemble(raw, mapping, log.inventory.path, ReadOptions(salvage=True), max_gap_s=float("inf"))
        stated = stated_by(mapping, raw)
        notes = examine(run, stated=stated)
        set_now = mended(body, run, notes, by_size)
        why += set_now
        if not set_now:
            break
    yaw = raw.series.get("yaw_rad")
    if yaw is not None and "yaw_rad" in by_size and "unit" in signals["yaw_rad"]:
        why += heading_in_doubt(yaw.values, signals)
    turned = {"yaw_rad"} if yaw is not None and wraps_in_rad(yaw.values) else set()
    why += said_of_assumed(assumed_units(run, {*defined, *stated.units, *turned}), signals)
    return Proposal(body, replace(run, notes=(*run.notes, *notes)), notes=tuple(why))


def _in_degrees(raw: RawLog, signals: Mapping[str, Any]) -> frozenset[str]:
    """Set the units that the size of the numbers says; return the signals whose unit was told by it."""
    units = {s: unit for s, v in raw.series.items() if (unit := _unit_of(s, v, signals.get(s, {}))) is not None}
    for signal, unit in units.items():
        signals[signal]["unit"] = unit
    if "yaw_rad" in units:
        signals["yaw_rad"]["unit"] = unit_of_wraps(raw.series["yaw_rad"].values)
    _as_the_heading(raw, signals)
    return frozenset(units)


def _unit_of(signal: str, series: Series, item: Mapping[str, Any]) -> str | None:
    if series.values.ndim != 1 or "unit" in item or series.unit is not None:
        return None
    return unit_by_size(signal, float(np.max(np.abs(series.values[np.isfinite(series.values)]), initial=0.0)))


def _as_the_heading(raw: RawLog, signals: Mapping[str, Any]) -> None:
    """Take pitch, roll and goals without a unit for degrees where the heading is in them: one logger wrote them."""
    if "deg" not in {signals.get("yaw_rad", {}).get("unit"), raw.series["yaw_rad"].unit if "yaw_rad" in raw.series else None}:
        return
    for angle in ("pitch_rad", "roll_rad", *sorted(GOALS)):
        if angle in signals and raw.series[angle].unit is None and "field" not in signals[angle]:
            signals[angle].setdefault("unit", "deg")
