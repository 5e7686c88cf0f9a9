"""The units, signs and stamps that a mapping states, so that the doctor advises no correction that was already made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from fieldsid.logs.channels import ChannelMap, Source
from fieldsid.logs.convert.units import factor_to, find_unit
from fieldsid.logs.reader import RawLog
from fieldsid.logs.run import SIGNALS, signal_of


@dataclass(frozen=True, slots=True)
class Stated:
    """Units by signal, the signals whose sign the mapping reverses, those that use the stamps of receipt, and the unit of time.

    The unit of time is None where the clock is that of a format, or its form has no unit.
    """

    units: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    turned: frozenset[str] = frozenset()
    received: frozenset[str] = frozenset()
    time: str | None = None

    def is_si(self, signal: str) -> bool:
        """Return whether the numbers of a signal were read as SI: no unit was stated, or the SI unit."""
        return self.units.get(signal) in (None, SIGNALS[signal])

    def probable(self, signal: str, unit: str, largest: float, limit: float) -> tuple[str, dict[str, str]]:
        """Return the advice on a signal that is implausibly large and may be in `unit`, and the unit to set if any."""
        if not self.is_si(signal):
            return f"taken as `{self.units[signal]}` already: check which one it is", {}
        if largest * factor_to(signal, unit) <= limit:
            return f"set its unit, probably `unit: {unit}`", {"unit": unit}
        return "check its unit, and which one it is", {}

    def flip(self, *signals: str) -> str:
        """Return the advice on how to reverse the sign of one of the signals."""
        turned = next((s for s in signals if s in self.turned), None)
        return f"take `sign: -1` away from {turned}" if turned else f"set `sign: -1` at {' or '.join(signals)}"

    def stamps(self, *signals: str) -> str:
        """Return the advice to use the stamps of the header, where the mapping uses those of receipt; empty elsewhere."""
        return "; use `stamp: header` where the log has them" if any(s in self.received for s in signals) else ""


def stated_by(mapping: ChannelMap, raw: RawLog) -> Stated:
    """Return the units, signs and stamps that a mapping, and the log itself, state."""
    units = {s: v.unit for s, v in raw.series.items() if v.unit} | {s: c.unit for s, c in mapping.sources.items() if c.unit}
    return Stated(
        MappingProxyType({signal_of(s): u for s, u in units.items() if signal_of(s) in SIGNALS}),
        frozenset(s for s, c in mapping.sources.items() if c.sign < 0),
        frozenset(signal_of(s) for s, c in mapping.sources.items() if (c.stamp or mapping.stamp) == "receive"),
        _unit_of_time(mapping.time),
    )


def _unit_of_time(time: Source | None) -> str | None:
    """Return the unit of the numbers of a time in one column, seconds without one; None for a clock of another form."""
    if time is None or time.column is None or time.date or time.week is not None or time.scale is not None:
        return None
    found = find_unit(time.unit or "s", "time")
    return None if found is None or found.dimension != "time" else found.name
