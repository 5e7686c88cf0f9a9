"""Charts as SVG: panels over one x axis with lines, dots, bands and bars; complete without a script, which adds zoom and readout.

Colours are classes of the page's style sheet, which defines them for light, dark and print. Coordinates inside a panel are those
of the drawing; the attributes of the panel have its data range, from which the script computes the values.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape
from math import ceil, floor, isfinite, log10
from typing import TypeAlias

import numpy as np

from fieldsid.figures.panel import Band, Bars, Panel, Series
from fieldsid.numerics.arrays import FloatArray

WIDTH, LEFT, RIGHT, TOP, BOTTOM, GAP = 480, 56, 10, 18, 36, 22
SMALLEST_PLAIN = 1e-3
"""The smallest tick label without a power of ten: longer labels would be cut off at the edge of the page."""
MOST_POINTS = 700
"""Most points of one line, which is the resolution of a wide screen."""
TICKS_X, TICKS_Y = 6, 4
POINTS = ("points", "rings")
"""The forms of series with a mark at each point."""
SAME = 2e-4
"""Relative range of values that are drawn level: with the four digits of the tables they are equal."""


Scale: TypeAlias = tuple[Callable[[float], float], Callable[[float], float]]
"""The maps from x and from y to the coordinates of a panel."""


def chart(panels: Sequence[Panel], title: str) -> str:
    """Return panels over the x axis of the last one as an SVG element with a title for screen readers."""
    x_label = panels[-1].x
    has_points = any(s.form in POINTS for p in panels for s in p.series)
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


def bars(of: Bars, title: str) -> str:
    """Return horizontal bars from zero, each with its name and its words, rings on them, and the line at 1 with its name."""
    left, step, right = 186, 24, 112
    scale = (WIDTH - left - right) / of.end
    height = step * len(of.rows) + 8 + (18 if of.mark else 0)
    parts = [f'<svg class="bars" viewBox="0 0 {WIDTH} {height}" role="img"><title>{escape(title)}</title>']
    for i, bar in enumerate(of.rows):
        y, long = 4 + step * i, min(bar.value, of.end) * scale
        ring = f'<circle class="ring" cx="{left + min(bar.ring, of.end) * scale:.1f}" cy="{y + step - 6}" r="3.5"/>'
        parts.append(
            f'<text x="{left - 8}" y="{y + 15}" text-anchor="end">{escape(bar.name)}</text>'
            f'<rect class="bar{" out" * bar.stands_out}" x="{left}" y="{y + 3}" width="{max(long, 1):.1f}" height="{step - 8}"/>'
            f'{ring if isfinite(bar.ring) else ""}<text x="{left + long + 6:.1f}" y="{y + 15}">{escape(bar.says)}</text>'
        )
    if of.mark:
        x = left + scale
        parts.append(
            f'<line class="mark" x1="{x:.1f}" x2="{x:.1f}" y1="2" y2="{height - 18}"/>'
            f'<text class="quiet" x="{x:.1f}" y="{height - 4}" text-anchor="middle">{escape(of.mark)}</text>'
        )
    return "".join([*parts, "</svg>"])


def legend(panels: Sequence[Panel]) -> str:
    """Return the names of the lines of panels with their colours, as HTML."""
    named = {s.name: s.kind for p in panels for s in p.series if s.name}
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
    ends += [end for s in panel.series if s.error is not None for end in _ends(s)]
    y = panel.limits or _range(ends, 0.06, from_zero=panel.from_zero)
    width = WIDTH - LEFT - RIGHT
    at_x, at_y = scale = _place(*x, width), _place(y[1], y[0], panel.height)
    head = (
        f'<svg class="panel" x="{LEFT}" y="{top:g}" width="{width}" height="{panel.height}" '
        f'viewBox="0 0 {width} {panel.height}" preserveAspectRatio="none" data-y0="{y[0]:.6g}" data-y1="{y[1]:.6g}" '
        f'data-label="{escape(panel.label)}"><rect class="ground" width="{width}" height="{panel.height}"/>'
    )
    parts = [head]
    axis = []
    for tick in nice_ticks(*y, TICKS_Y if panel.height > 90 else 3):
        place = at_y(tick)
        parts.append(f'<line class="grid" x1="0" x2="{width}" y1="{place:.1f}" y2="{place:.1f}"/>')
        axis.append(f'<text x="{LEFT - 5}" y="{top + place + 4:.1f}" text-anchor="end">{_shown(tick)}</text>')
    for low, high in panel.spans:
        wide = max(at_x(high) - at_x(low), 1.0)
        parts.append(f'<rect class="span" x="{at_x(low):.1f}" width="{wide:.1f}" height="{panel.height}"/>')
    parts += [_band(b, scale) for b in panel.bands]
    parts += [_series(s, scale) for s in panel.series]
    label = f'<text class="label" x="{LEFT}" y="{top - 5:g}">{escape(panel.label)}</text>'
    return "".join([*parts, "</svg>", *axis, label])


def _place(low: float, high: float, size: float) -> Callable[[float], float]:
    """Return the map from data between two ends to the coordinates of a panel."""
    return lambda value: size * (value - low) / (high - low)


def _band(band: Band, scale: Scale) -> str:
    at_x, at_y = scale
    there = [(at_x(x), at_y(y)) for x, y in zip(band.x, band.high, strict=True)]
    back = [(at_x(x), at_y(y)) for x, y in zip(band.x[::-1], band.low[::-1], strict=True)]
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in [*there, *back])
    return f'<polygon class="band {band.kind}" points="{points}"/>'


def _ends(series: Series) -> tuple[FloatArray, FloatArray]:
    """Return the lower and the upper end (n,) of the error bars of a series."""
    down, up = (0.0, 0.0) if series.error is None else np.broadcast_to(series.error, (2, series.y.size))
    return series.y - down, series.y + up


def _series(series: Series, scale: Scale) -> str:
    at_x, at_y = scale
    x, y, low, high = thinned(series.x, series.y, *_ends(series))
    ok = np.isfinite(x) & np.isfinite(y)
    points = [(at_x(x), at_y(y)) for x, y in zip(x[ok], y[ok], strict=True)]
    kind = f"{series.kind}{' dashed' * series.dashed}{' thin' * series.thin}"
    name = f' data-name="{escape(series.name)}"' if series.name and not series.dashed else ""
    marks = "".join(f"M{x:.1f} {y:.1f}h0" for x, y in points)
    if series.form == "dots":
        return f'<path class="dots {kind}"{name} d="{marks}"/>'
    if series.form in POINTS:
        errors = zip(x[ok], low[ok], high[ok], strict=True)
        path = "".join(f"M{at_x(x):.1f} {at_y(low):.1f}V{at_y(high):.1f}" for x, low, high in errors)
        return f'<path class="errors {kind}" d="{path}"/><path class="{series.form} {kind}"{name} d="{marks}"/>'
    if series.form == "steps":
        points = [p for (x, y), (x1, _) in zip(points, [*points[1:], points[-1]], strict=True) for p in ((x, y), (x1, y))]
    drawn = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polyline class="line {kind}"{name} points="{drawn}"/>'


def _x_axis(top: float, x: tuple[float, float], label: str) -> str:
    width = WIDTH - LEFT - RIGHT
    at_x = _place(*x, width)
    ticks = "".join(
        f'<text x="{LEFT + at_x(t):.1f}" y="{top + 14:g}" text-anchor="middle">{_shown(t)}</text>'
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
