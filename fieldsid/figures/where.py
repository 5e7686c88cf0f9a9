"""Places of a model's error: for each condition, the share of the squared error less the share of the samples."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes

from fieldsid.comparison.localize import Place
from fieldsid.figures import canvas
from fieldsid.rounding import DEGREES


def draw(places: Sequence[Place], ax: Axes) -> None:
    """Draw one bar per condition worse than the rest, the longest, where the model fails most, at the top and in colour."""
    canvas.dress(ax, x="share of the squared error\nbeyond that of the time, %")
    ordered = sorted((p for p in places if p.beyond > 0.0), key=lambda p: p.beyond)
    lengths = [100.0 * p.beyond for p in ordered]
    colours = [canvas.SIMULATED if p is ordered[-1] else canvas.QUIET for p in ordered]
    ax.barh(range(len(ordered)), lengths, color=colours, height=0.66)
    ax.set_yticks(range(len(ordered)), [DEGREES.words(p.condition) for p in ordered], fontsize=9)
    for i, (p, length) in enumerate(zip(ordered, lengths, strict=True)):
        ax.annotate(f"{p.rms_ratio:.2f} x", (length, i), xytext=(4, 0), textcoords="offset points", va="center", fontsize=8)
    ax.margins(x=0.12)
    ax.grid(visible=False, axis="y")
