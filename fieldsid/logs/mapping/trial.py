"""A mapping that was drafted, tried on the log itself: degrees by size, then what the findings on the run it gives say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from fieldsid.errors import FieldsidError
from fieldsid.logs.channels import ChannelMap
from fieldsid.logs.doctor.angle_and_rate import PAIRS
from fieldsid.logs.mapping.draft import place_of
from fieldsid.logs.mapping.mend import mended
from fieldsid.logs.mapping.numbers.units_told import assumed_units, heading_in_doubt, set_by_size, unit_of_wraps
from fieldsid.logs.reader import Inventory, RawLog, Reader, ReadOptions
from fieldsid.logs.run import SIGNALS, Note, Run

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
        lenient = ReadOptions(self.options.msg_path, salvage=True, joined=self.options.joined)
        return self.reader.read(self.inventory.path, mapping, lenient)

    def run_of(self, body: Mapping[str, Any], raw: RawLog | None = None) -> Run:
        """Return the run that a mapping's body gives of what was read; raises LogError, MappingError and DataError."""
        from fieldsid.logs.convert.assemble import assemble
        from fieldsid.logs.mapping.mapping_file import mapping_of

        mapping = mapping_of(body)
        raw = self.read(mapping) if raw is None else raw
        return assemble(raw, mapping, self.inventory.path, ReadOptions(salvage=True), max_gap_s=float("inf"))


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
    from fieldsid.logs.doctor.examine import examine
    from fieldsid.logs.doctor.stated import stated_by
    from fieldsid.logs.mapping.mapping_file import mapping_of

    raw, signals = log.read(mapping_of(body)), body["signals"]
    plain = {s: v for s, v in raw.series.items() if s in signals and v.values.ndim == 1}
    told = {s: v.unit for s, v in plain.items() if v.unit is not None}
    by_size = set_by_size(signals, {s: v.values for s, v in plain.items()}, told)
    yaw = raw.series.get("yaw_rad")
    wraps = None if yaw is None else unit_of_wraps(yaw.values)
    in_doubt = by_size if wraps is None else by_size - {"yaw_rad"}
    why: list[Note] = []
    for _ in range(MENDS):
        run, stated = log.run_of(body, raw), stated_by(mapping_of(body), raw)
        notes = examine(run, stated=stated)
        set_now = mended(body, run, notes, in_doubt)
        why += set_now
        if not set_now:
            break
    if yaw is not None and "yaw_rad" in by_size and "unit" in signals["yaw_rad"]:
        why += heading_in_doubt(yaw.values, signals)
    # a size tells that a rate beside its angle is not in rad/s, and not in which unit it is then: that the angle says
    open_rates = {rate for angle, rate in PAIRS if rate in by_size and run.has(angle)}
    known = {*defined, *stated.units, *({"yaw_rad"} if wraps == "rad" else ())} - open_rates
    why += assumed_units(run, known, {s: (place_of(item), item.get("unit", SIGNALS.get(s, ""))) for s, item in signals.items()})
    return Proposal(body, replace(run, notes=(*run.notes, *notes)), notes=tuple(why))
