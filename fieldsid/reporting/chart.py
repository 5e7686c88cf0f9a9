"""Charts as SVG: panels over one x axis with lines, dots, bands and bars; complete without a script, which adds zoom and readout.

Colours are classes of the page's style sheet, which defines them for light, dark and print. Coordinates inside a panel are those
of the drawing; the attributes of the panel have its data range, from which the script computes the values.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from math import ceil, floor, isfinite, log10

import numpy as np

from fieldsid.numerics.arrays import FloatArray

WIDTH, LEFT, RIGHT, TOP, BOTTOM, GAP = 480, 56, 10, 18, 36, 22
SMALLEST_PLAIN = 1e-3
"""The smallest tick label without a power of ten: longer labels would be cut off at the edge of the page."""
MOST_POINTS = 700
"""Most points of one line, which is the resolution of a wide screen."""
TICKS_X, TICKS_Y = 6, 4
SAME = 2e-4
"""Relative range of values that are drawn level: with the four digits of the tables they are equal."""


@dataclass(frozen=True, slots=True)
class Series:
    """One line: x and y (n,), its class (`measured`, `simulated`, `second`, `quiet`), name, and how it is drawn.

    `form` is line, dots, steps or points with error bars, of which `error` (n,) is the half length.
    """

    x: FloatArray
    y: FloatArray
    kind: str
    name: str = ""
    form: str = "line"
    error: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class Band:
    """An area between low (n,) and high (n,) over x (n,)."""

    x: FloatArray
    low: FloatArray
    high: FloatArray
    kind: str


@dataclass(frozen=True, slots=True)
class Panel:
    """One plot: the words of its y axis, its lines and areas, its height, and spans of x that are shaded."""

    label: str
    series: Sequence[Series]
    bands: Sequence[Band] = ()
    height: int = 120
    spans: Sequence[tuple[float, float]] = field(default_factory=tuple)
    from_zero: bool = False


def chart(panels: Sequence[Panel], x_label: str, title: str) -> str:
    """Return panels over one x axis as an SVG element with a title for screen readers."""
    has_points = any(s.form == "points" for p in panels for s in p.series)
    x0, x1 = _range([s.x for p in panels for s in p.series], pad=0.03 if has_points else 0.0)
    height = TOP + sum(p.height + GAP for p in panels) - GAP + BOTTOM
    head = (
        f'<svg class="chart" viewBox="0 0 {WIDTH} {height}" role="img" tabindex="0" data-x0="{x0:.6g}" data-x1="{x1:.6g}" '
        f'data-x="{escape(x_label)}"><title>{escape(title)}</title>'
    )
    parts = [head]
    top = float(TOP)
    for panel in panels:
        parts.append(_panel(panel, top, (x0, x1)))
        top += panel.height + GAP
    parts.append(_x_axis(top - GAP, (x0, x1), x_label))
    return "".join([*parts, "</svg>"])


def bars(rows: Sequence[tuple[str, float, str]], title: str, *, mark: tuple[float, str] | None = None) -> str:
    """Return horizontal bars, each with its name and a label, from zero; `mark` is a value drawn as a line with its name."""
    left, step, right = 186, 24, 112
    most = max([v for _, v, _ in rows] + ([mark[0]] if mark else []), default=1.0) or 1.0
    scale = (WIDTH - left - right) / most
    height = step * len(rows) + 8 + (18 if mark else 0)
    parts = [f'<svg class="bars" viewBox="0 0 {WIDTH} {height}" role="img"><title>{escape(title)}</title>']
    for i, (name, value, label) in enumerate(rows):
        y = 4 + step * i
        parts.append(
            f'<text x="{left - 8}" y="{y + 15}" text-anchor="end">{escape(name)}</text>'
            f'<rect class="bar" x="{left}" y="{y + 3}" width="{max(value * scale, 1):.1f}" height="{step - 8}"/>'
            f'<text x="{left + value * scale + 6:.1f}" y="{y + 15}">{escape(label)}</text>'
        )
    if mark:
        x = left + mark[0] * scale
        parts.append(
            f'<line class="mark" x1="{x:.1f}" x2="{x:.1f}" y1="2" y2="{height - 18}"/>'
            f'<text class="quiet" x="{x:.1f}" y="{height - 4}" text-anchor="middle">{escape(mark[1])}</text>'
        )
    return "".join([*parts, "</svg>"])


def legend(series: Sequence[Series]) -> str:
    """Return the names of lines with their colours, as HTML."""
    named = {s.name: s.kind for s in series if s.name}
    return "".join(f'<span class="key {kind}">{escape(name)}</span>' for name, kind in named.items())


def thinned(x: FloatArray, *ys: FloatArray) -> tuple[FloatArray, ...]:
    """Return series reduced to evenly spaced samples where there are more than MOST_POINTS."""
    step = max(1, ceil(x.size / MOST_POINTS))
    return (x[::step], *(y[::step] for y in ys))


def nice_ticks(low: float, high: float, count: int) -> list[float]:
    """Return about `count` round numbers between low and high."""
    if not (isfinite(low) and isfinite(high)) or high <= low:
        return [low]
    raw = (high - low) / count
    size = 10.0 ** floor(log10(raw))
    step = next(m * size for m in (1, 2, 2.5, 5, 10) if m * size >= raw * (1 - 1e-9))
    first = ceil(low / step - 1e-9)
    return [float(f"{k * step:.10g}") for k in range(first, floor(high / step + 1e-9) + 1)]


def _range(values: Sequence[FloatArray], pad: float, *, from_zero: bool = False) -> tuple[float, float]:
    finite = [v[np.isfinite(v)] for v in values]
    every = np.concatenate([f for f in finite if f.size] or [np.array([0.0, 1.0])])
    low, high = float(every.min()), float(every.max())
    if from_zero:
        low, high = min(low, 0.0), max(high, 0.0)
    size = max(abs(low), abs(high))
    margin = pad * (high - low) if high - low > SAME * size else 0.5 * size or 1.0
    return low - margin, high + margin


def _panel(panel: Panel, top: float, x: tuple[float, float]) -> str:
    ends = [s.y for s in panel.series] + [e for b in panel.bands for e in (b.low, b.high)]
    ends += [s.y + sign * s.error for s in panel.series if s.error is not None for sign in (-1.0, 1.0)]
    y = _range(ends, 0.06, from_zero=panel.from_zero)
    width = WIDTH - LEFT - RIGHT
    scale = _Scale(x, y, width, panel.height)
    head = (
        f'<svg class="panel" x="{LEFT}" y="{top:g}" width="{width}" height="{panel.height}" '
        f'viewBox="0 0 {width} {panel.height}" preserveAspectRatio="none" data-y0="{y[0]:.6g}" data-y1="{y[1]:.6g}" '
        f'data-label="{escape(panel.label)}"><rect class="ground" width="{width}" height="{panel.height}"/>'
    )
    parts = [head]
    axis = []
    for tick in nice_ticks(*y, TICKS_Y if panel.height > 90 else 3):
        place = scale.y(tick)
        parts.append(f'<line class="grid" x1="0" x2="{width}" y1="{place:.1f}" y2="{place:.1f}"/>')
        axis.append(f'<text x="{LEFT - 5}" y="{top + place + 4:.1f}" text-anchor="end">{_shown(tick)}</text>')
    for low, high in panel.spans:
        wide = max(scale.x(high) - scale.x(low), 1.0)
        parts.append(f'<rect class="span" x="{scale.x(low):.1f}" width="{wide:.1f}" height="{panel.height}"/>')
    parts += [_band(b, scale) for b in panel.bands]
    parts += [_series(s, scale) for s in panel.series]
    label = f'<text class="label" x="{LEFT}" y="{top - 5:g}">{escape(panel.label)}</text>'
    return "".join([*parts, "</svg>", *axis, label])


@dataclass(frozen=True, slots=True)
class _Scale:
    """The map from data to the coordinates of the panel."""

    x_range: tuple[float, float]
    y_range: tuple[float, float]
    width: float
    height: float

    def x(self, value: float) -> float:
        low, high = self.x_range
        return self.width * (value - low) / (high - low)

    def y(self, value: float) -> float:
        low, high = self.y_range
        return self.height * (high - value) / (high - low)


def _band(band: Band, scale: _Scale) -> str:
    there = [(scale.x(x), scale.y(y)) for x, y in zip(band.x, band.high, strict=True)]
    back = [(scale.x(x), scale.y(y)) for x, y in zip(band.x[::-1], band.low[::-1], strict=True)]
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in [*there, *back])
    return f'<polygon class="band {band.kind}" points="{points}"/>'


def _series(series: Series, scale: _Scale) -> str:
    ok = np.isfinite(series.x) & np.isfinite(series.y)
    points = [(scale.x(x), scale.y(y)) for x, y in zip(series.x[ok], series.y[ok], strict=True)]
    name = f' data-name="{escape(series.name)}"' if series.name else ""
    if series.form == "dots":
        path = "".join(f"M{x:.1f} {y:.1f}h0" for x, y in points)
        return f'<path class="dots {series.kind}"{name} d="{path}"/>'
    if series.form == "points":
        errors = np.zeros(series.y.size) if series.error is None else series.error
        bars = [
            f"M{scale.x(x):.1f} {scale.y(y - e):.1f}V{scale.y(y + e):.1f}"
            for x, y, e in zip(series.x[ok], series.y[ok], errors[ok], strict=True)
        ]
        path = "".join(f"M{x:.1f} {y:.1f}h0" for x, y in points)
        return f'<path class="errors {series.kind}" d="{"".join(bars)}"/><path class="marks {series.kind}"{name} d="{path}"/>'
    if series.form == "steps":
        points = [p for (x, y), (x1, _) in zip(points, [*points[1:], points[-1]], strict=True) for p in ((x, y), (x1, y))]
    drawn = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polyline class="line {series.kind}"{name} points="{drawn}"/>'


def _x_axis(top: float, x: tuple[float, float], label: str) -> str:
    width = WIDTH - LEFT - RIGHT
    ticks = "".join(
        f'<text x="{LEFT + width * (t - x[0]) / (x[1] - x[0]):.1f}" y="{top + 14:g}" text-anchor="middle">{_shown(t)}</text>'
        for t in nice_ticks(*x, TICKS_X)
    )
    middle = LEFT + 0.5 * width
    return (
        f'<g class="ticks" data-y="{top + 14:g}">{ticks}</g>'
        f'<text class="label" x="{middle:g}" y="{top + 29:g}" text-anchor="middle">{escape(label)}</text>'
    )


def _shown(value: float) -> str:
    """Return the label of a tick, short enough for the margin: `0.0015`, `5e\u22124`."""
    if 0.0 < abs(value) < SMALLEST_PLAIN:
        digits, _, power = f"{value:.3e}".partition("e")
        return f"{float(digits):g}e{int(power)}".replace("-", "\u2212")
    return f"{value:.6g}".replace("-", "\u2212")
