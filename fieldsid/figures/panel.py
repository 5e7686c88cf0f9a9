"""What a figure shows, as plain data: panels with their series, bars, and the picture they make. It imports nothing heavy.

`drawn.py` draws it with matplotlib, as files and in notebooks; `reporting/chart.py` as SVG for the report.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from fieldsid.numerics.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class Series:
    """One line: x and y (n,), its kind (a colour's name in `drawn.py` and in the style sheet), name, and how it is drawn.

    `form` is line, dots, steps, stems, points or rings; points have error bars of half length `error` (n,), or (2, n) for those
    down and up. `thin` marks what is drawn for comparison.
    """

    x: FloatArray
    y: FloatArray
    kind: str
    name: str = ""
    form: str = "line"
    error: FloatArray | None = None
    dashed: bool = False
    thin: bool = False


@dataclass(frozen=True, slots=True)
class Band:
    """An area between low (n,) and high (n,) over x (n,)."""

    x: FloatArray
    low: FloatArray
    high: FloatArray
    kind: str
    name: str = ""


@dataclass(frozen=True, slots=True)
class Panel:
    """One plot: the words of its y axis, its lines and areas, its height, and spans of x that are shaded.

    `x` are the words of its x axis, empty where that is the one of the panel below it. `limits` are the ends of the y axis where
    the data do not give them.
    """

    label: str
    series: Sequence[Series]
    bands: Sequence[Band] = ()
    height: int = 120
    spans: Sequence[tuple[float, float]] = ()
    from_zero: bool = False
    limits: tuple[float, float] | None = None
    x: str = ""
    title: str = ""


@dataclass(frozen=True, slots=True)
class Bar:
    """One bar: its name, its length, the words beside it, a second value drawn as a ring (NaN without), whether it stands out."""

    name: str
    value: float
    says: str
    ring: float = nan
    stands_out: bool = False


@dataclass(frozen=True, slots=True)
class Bars:
    """Horizontal bars from zero: the words of the axis, the bars from the top down, and what bars, rings and a line at 1 are."""

    label: str
    rows: Sequence[Bar]
    name: str = ""
    ring_name: str = ""
    mark: str = ""
    title: str = ""

    @property
    def end(self) -> float:
        """The length at which bars are cut: one that is much longer than the first must not determine the scale."""
        lengths = [v for b in self.rows for v in (b.value, b.ring) if isfinite(v)] + ([1.0] if self.mark else [])
        first = self.rows[0].value if self.rows else 1.0
        return min(max(lengths, default=1.0), MOST_TIMES * max(first, 1.0 if self.mark else 0.0)) or 1.0


MOST_TIMES = 3.0
"""Multiple of the first bar, of the mark or of the gains at which longer bars and wider bands are cut."""
Cell: TypeAlias = Panel | Bars | Callable[[Any], None]
"""A part of a picture; a function draws on the axes that it is given, what no other form shows."""


@dataclass(frozen=True, slots=True)
class Picture:
    """A whole figure: title, its size in inches, and its columns from left to right, each with its cells from the top down."""

    title: str
    size: tuple[float, float]
    columns: Sequence[Sequence[Cell]]
    widths: Sequence[float] | None = None
