"""Records that state which column or topic of a log is which signal: the content of a mapping, from a file or from code."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Literal

from fieldsid.logs.convert.clock import GAP_FACTOR
from fieldsid.logs.convert.frames import Frame
from fieldsid.logs.run import ANGLES, MEASURED_FIN, RATE_OF

Stamp = Literal["header", "receive"]
ATTITUDE = "attitude"
"""Name for a quaternion in a mapping; it gives three signals: yaw, pitch and roll."""
POSITION = "position"
"""Name for latitude and longitude in a mapping; they give x and y, in m north and east of the first fix."""
COMBINED = (ATTITUDE, POSITION)


AXES = tuple(zip(RATE_OF.items(), MEASURED_FIN.items(), strict=False))
"""The signals of yaw and of pitch, motion and fin: identification needs at least one of each."""


def is_enough(signals: Iterable[str]) -> bool:
    """Return whether the signals include a motion and a fin of at least one axis."""
    known = set(signals)
    known |= set(ANGLES) if ATTITUDE in known else set()
    return any(known & set(motion) and known & set(fins) for motion, fins in AXES)


@dataclass(frozen=True, slots=True)
class Source:
    """The source of one signal: a column (name, or index from 0), four columns of a quaternion, or a topic's field.

    value = sign x (number converted to SI), rotated into NED and FRD, + offset in SI. `stamp` None means the header's stamp where
    the message has one. `unit` None means the unit that the column's name or the message type states, else SI. Where the unit is
    `counts`, `centre` is the count at zero angle and `scale` the angle in rad of one count; for an entry of a sum, `scale` is its
    factor in the sum, of either sign. A time may be composed of several columns; `unit` then names their parts. `date` holds the
    columns of the date where the time is a time of day, `week` the column of the GPS week; for a time that counts samples,
    `scale` is the sampling interval in s.
    """

    column: str | int | None = None
    columns: tuple[str | int, ...] = ()
    order: Literal["xyzw", "wxyz"] = "xyzw"
    topic: str | None = None
    path: str = ""
    unit: str | None = None
    sign: int = 1
    offset: float = 0.0
    frame: Frame | None = None
    stamp: Stamp | None = None
    centre: float | None = None
    scale: float | None = None
    date: tuple[str | int, ...] = ()
    week: str | int | None = None

    @property
    def places(self) -> tuple[str | int, ...]:
        """Every column that the source reads."""
        return tuple(c for c in (self.column, *self.columns, *self.date, self.week) if c is not None)

    @property
    def counts_rows(self) -> bool:
        """Whether this is a time without a column: the rows are counted, at a constant rate."""
        return self.scale is not None and not self.places and self.topic is None

    @property
    def label(self) -> str:
        """The source in words, for messages and notes."""
        if self.topic is not None:
            return f"{self.topic}.{self.path}" if self.path else self.topic
        return ", ".join(map(str, self.columns)) if self.columns else f"column {self.column!r}"


@dataclass(frozen=True, slots=True)
class TableForm:
    """The format of a text table; None where the reader detects it."""

    separator: str | None = None
    header: bool | None = None
    skip: int | None = None
    encoding: str | None = None
    decimal: Literal[".", ","] | None = None


@dataclass(frozen=True, slots=True)
class Pressure:
    """The constants that convert pressure to depth: density in kg/m^3, and pressure at the surface in Pa (0 for a gauge)."""

    density: float = 1025.0
    surface_pa: float = 101325.0


@dataclass(frozen=True, slots=True)
class ChannelMap:
    """The complete mapping of a log: sources by canonical signal, the time column of a table, frames, clocks, depth.

    A signal that is the sum of several sources has one entry for each, such as `rudder_rad[0]` and `rudder_rad[1]`; see
    `signal_of`.
    """

    sources: Mapping[str, Source]
    time: Source | None = None
    frame: Frame = field(default_factory=Frame)
    stamp: Stamp | None = None
    clock: str | None = None
    gap_factor: float = GAP_FACTOR
    pressure: Pressure = field(default_factory=Pressure)
    table: TableForm = field(default_factory=TableForm)
    origin: Path | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "sources", MappingProxyType(dict(self.sources)))

    @property
    def place(self) -> str:
        """The file of the mapping, for messages."""
        return f"`{self.origin}`" if self.origin else "the mapping"
