"""Where a model fails: the share of the squared error by condition, against the share of the samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes

from fieldsid.figures import canvas


@dataclass(frozen=True, slots=True)
class Bar:
    """One condition: its words, its share of the squared error, and its error over the whole run's (rms ratio)."""

    condition: str
    share: float
    ratio: float


def draw(bars: Sequence[Bar], ax: Axes) -> None:
    """Draw one bar per condition, the largest share at the top; the first of them, where the model fails most, stands out."""
    canvas.dress(ax, x="share of the squared error, %")
    ordered = sorted(bars, key=lambda b: b.share)
    colours = [canvas.SIMULATED if b is bars[0] else canvas.QUIET for b in ordered]
    ax.barh(range(len(ordered)), [100 * b.share for b in ordered], color=colours, height=0.66)
    ax.set_yticks(range(len(ordered)), [b.condition for b in ordered], fontsize=9)
    for i, b in enumerate(ordered):
        ax.annotate(f"{b.ratio:.2f} x", (100 * b.share, i), xytext=(4, 0), textcoords="offset points", va="center", fontsize=8)
    ax.margins(x=0.12)
    ax.grid(visible=False, axis="y")
