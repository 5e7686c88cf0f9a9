"""The figure of a line of models: the error on unseen and on fitted runs, falling addition by addition to the noise floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees, isfinite
from textwrap import fill

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fieldsid.extension.extend import Gain
from fieldsid.extension.lineage import Generation
from fieldsid.figures import canvas
from fieldsid.rounding import MANY

LABEL_WIDTH = 18


@dataclass(frozen=True, slots=True)
class Fall:
    """One addition in one channel, in the figure's unit: errors before and after on unseen and fitted runs, and the floor."""

    unseen: tuple[float, float]
    fitted: tuple[float, float]
    floor: float


def figure(line: Sequence[Generation], name: str) -> Figure:
    """Return the figure of a line with at least one addition, as `fall_figure` draws it."""
    return fall_figure([g.step.gain for g in line if g.step], line[0].effects, name)


def fall_figure(gains: Sequence[Gain], before: Sequence[str], name: str) -> Figure:
    """Return a sheet with a panel for the rate and one for the angle of additions to a model with some effects before.

    A channel that was not measured is left out.
    """
    labels = [folded(", ".join(before) or "plain model")]
    labels += [folded(" ".join(f"+{n}" for n in gain.added)) for gain in gains]
    channels = [(c, falls) for c in ("rate", "angle") if (falls := falls_of(gains, c))]
    sheet = canvas.sheet(max(8.0, 1.6 + 2.6 * len(labels)), 5.2, f"{name}: {summary(gains)}")
    axes = sheet.subplots(1, len(channels), squeeze=False)[0]
    for ax, (channel, falls) in zip(axes, channels, strict=True):
        unit = "deg/s" if channel == "rate" else "deg"
        draw(falls, labels, ax)
        canvas.dress(ax, y=f"free-run {channel} error, rms [{unit}]")
        ax.grid(visible=False, axis="x")
    canvas.legend_above(axes[-1], 3)
    return sheet


def folded(text: str) -> str:
    """Return a label on as many lines as it needs, names unbroken."""
    return fill(text, LABEL_WIDTH, break_long_words=False)


def summary(gains: Sequence[Gain]) -> str:
    """Return the fall of the error in words."""
    where = "unseen runs" if gains[-1].unseen else "the runs fitted to"
    before, after = gains[0].over_floor[0], gains[-1].over_floor[1]
    if before < MANY:
        return f"error on {where} from {before:.2f} to {after:.2f} x the noise floor"
    return f"error on {where} from {' to '.join(e.sized('deg', degrees(1.0)) for e in (gains[0].judged[0], gains[-1].judged[1]))}"


def falls_of(gains: Sequence[Gain], channel: str) -> list[Fall]:
    """Return the falls of a channel in deg or deg/s; none where it was not measured."""
    name, noise = ("rate_rms_rad_s", "rate") if channel == "rate" else ("angle_rms_rad", "angle")
    falls = [
        Fall(
            (degrees(getattr(g.before.validation, name)), degrees(getattr(g.after.validation, name))),
            (degrees(getattr(g.before.train, name)), degrees(getattr(g.after.train, name))),
            degrees(getattr(g.noise_floor, noise)),
        )
        for g in gains
    ]
    return [f for f in falls if isfinite(f.fitted[0]) or isfinite(f.unseen[0])]


def draw(falls: Sequence[Fall], labels: Sequence[str], ax: Axes) -> None:
    """Draw each addition as a line from before to after; a gap between two means that they were judged on other data."""
    top = 0.0
    for i, fall in enumerate(falls):
        first = i == 0
        x = (i, i + 1)
        ends = (-0.5 if first else i, len(falls) + 0.5 if i == len(falls) - 1 else i + 1)
        ax.hlines(fall.floor, *ends, color=canvas.SECOND, linestyle="--", label="noise floor" if first else "_")
        ax.plot(x, fall.fitted, "o:", color="0.45", markerfacecolor="white", markersize=6, label="fitted runs" if first else "_")
        ax.plot(x, fall.unseen, "o-", color=canvas.SIMULATED, linewidth=2.0, markersize=7, label="unseen runs" if first else "_")
        top = max(top, *(v for v in (*fall.unseen, *fall.fitted, fall.floor) if isfinite(v)))
        shown = fall.unseen if isfinite(fall.unseen[0]) else fall.fitted
        for at, value in zip(x, shown, strict=True):
            if at == i + 1 or first:
                ax.annotate(f"{value / fall.floor:.2f} x", (at, value), xytext=(8, 6), textcoords="offset points", fontsize=9)
    ax.set_xticks(range(len(falls) + 1), list(labels), fontsize=9)
    ax.set_xlim(-0.3, len(falls) + 0.45)
    ax.set_ylim(0.0, 1.12 * top)
