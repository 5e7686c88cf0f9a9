"""The sheet of every figure: size, colours that colour-blind readers can distinguish, and saving.

The colours are those of Okabe and Ito 2008. There is no global state: figures are made without pyplot, so that a library call
does not change the settings of a notebook.
"""

from __future__ import annotations

import warnings
from io import BytesIO
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from fieldsid.artifacts import replacing
from fieldsid.figures.kinds import KINDS, TOOL, kind_of
from fieldsid.numerics.arrays import FloatArray
from fieldsid.page import folded
from fieldsid.runtime.background_tasks import BackgroundTasks

MEASURED = "0.45"
SIMULATED = "#D55E00"
SECOND = "#0072B2"
THIRD = "#009E73"
FOURTH = "#CC79A7"
WARM = "#E69F00"
QUIET = "0.75"
DPI = 120
LETTERS_PER_INCH = 11.5
"""Letters of a title in an inch of the sheet."""
MOST_DOTS = 4000


class Sheet(Figure):
    """A figure that a notebook displays without pyplot or a magic command."""

    def _repr_png_(self) -> bytes:
        out = BytesIO()
        self.savefig(out, format="png")
        return out.getvalue()


def sheet(width: float, height: float, title: str = "") -> Figure:
    """Return an empty figure of a size in inches, with a separate canvas and a title at the left."""
    figure = Sheet(figsize=(width, height), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    if title:
        lines = [folded(line, round(LETTERS_PER_INCH * width), rest="") for line in title.splitlines()]
        figure.suptitle("\n".join(lines), x=0.01, ha="left", fontsize=11, parse_math=False)
    return figure


def dress(ax: Axes, *, x: str = "", y: str = "", title: str = "") -> Axes:
    """Give a plot its labels, a light grid and open sides; return it."""
    if x:
        ax.set_xlabel(x)
    if y:
        ax.set_ylabel(y)
    if title:
        ax.set_title(title, loc="left", fontsize=10)
    ax.grid(visible=True, color="0.9", linewidth=0.6)
    ax.set_axisbelow(True)
    ax.spines[["top", "right"]].set_visible(False)
    ax.tick_params(labelsize=9)
    return ax


def note(ax: Axes, text: str, place: tuple[float, float], off: tuple[float, float], **how: Any) -> None:
    """Write words beside a point of the data; off: from there to the words, in points."""
    ax.annotate(text, place, xytext=off, textcoords="offset points", **{"fontsize": 9, **how})


def legend_above(ax: Axes, width: int) -> None:
    """Put the legend above the plot, at its right, where it hides no data; the plot's title goes above it.

    width: letters of the title in a line of it.
    """
    handles, names = ax.get_legend_handles_labels()
    folds = [fill(name, width) for name in names]
    columns = max(1, min(4, width * 10 // 9 // (4 + max(map(len, names)))))  # 9 pt here, 10 pt in the title
    rows = -(-sum(1 + fold.count("\n") for fold in folds) // columns)
    if title := ax.get_title(loc="left"):
        ax.set_title(title, loc="left", fontsize=10, pad=6.0 + 14.0 * rows)
    ax.legend(
        handles, folds, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=columns, frameon=False, fontsize=9, handlelength=1.6,
        borderaxespad=0.2, columnspacing=1.2,
    )  # fmt: skip


def dots(ax: Axes, x: FloatArray, y: FloatArray, label: str = "measured") -> None:
    """Draw measured samples as dots, thinned evenly where there are more than the eye can resolve."""
    step = max(1, int(np.ceil(x.size / MOST_DOTS)))
    ax.plot(x[::step], y[::step], linestyle="none", marker=".", markersize=2.6, color=MEASURED, label=label, rasterized=True)


def save(figure: Figure, path: Path, *, force: bool = False, tasks: BackgroundTasks | None = None) -> Path:
    """Write a figure completely or not at all, as PNG, SVG or PDF by its suffix; with `tasks`, in the background.

    Raises UsageError for another suffix, ArtifactError where it cannot be written.
    """
    kind_of(path)
    if tasks is None:
        _write(figure, path, force=force)
    else:
        tasks.run(lambda: _write(figure, path, force=force))
    return path


def _write(figure: Figure, path: Path, *, force: bool) -> None:
    for text in figure.findobj(Text):  # the name of a log may have dollars and braces, which are not a formula
        text.set_parse_math(parse_math=False)
    with warnings.catch_warnings():
        # A letter that the font lacks is drawn as a box; the figure's file has the name.
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        _draw(figure, path, force=force)


def _draw(figure: Figure, path: Path, *, force: bool) -> None:
    engine = figure.get_layout_engine()
    if engine is not None:  # the layout is computed here once; the writer would draw the figure a second time for it
        engine.execute(figure)
        # no engine at all: one that is named "none" still makes the writer draw twice
        with rc_context({"figure.autolayout": False, "figure.constrained_layout.use": False}):
            figure.set_layout_engine()
    kind = kind_of(path)
    with replacing(path, force=force) as temporary, rc_context({"svg.hashsalt": TOOL}):  # else an SVG's ids are drawn at random
        figure.savefig(temporary, format=kind, metadata=dict(KINDS[kind]))
