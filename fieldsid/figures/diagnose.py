"""The figure of a diagnosis: what each candidate takes away of the error and how probable it is, and where the model fails."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from textwrap import fill

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fieldsid.diagnosis import Diagnosis
from fieldsid.figures import canvas, where
from fieldsid.rounding import probability

MOST_BARS = 10
TITLE_WIDTH = 150
LABEL_WIDTH = 30
MOST_TIMES = 3.0
"""Bars longer than so many times the first are cut: an addition that makes things worse needs no scale of its own."""


@dataclass(frozen=True, slots=True)
class Bar:
    """One candidate: its error over the noise floor on fitted and on unseen runs, share explained, probability, if it is named.

    The model as it is has no probability. worse: it raises the error, and explains nothing.
    """

    effect: str
    fitted: float
    unseen: float
    explained: float
    probability: float | None
    named: bool
    worse: bool = False


def figure(found: Diagnosis) -> Figure:
    """Return a sheet with the candidates at the left and where the model fails at the right."""
    sheet = canvas.sheet(13.0, 6.4)
    left, right = sheet.subplots(1, 2, width_ratios=(1.25, 1.0))
    chances = [c.probability for c in found.candidates]
    sure = f", probability {probability(chances[0])}" if found.effects and chances[0] == max(chances) else ""
    says = f"{found.axis.value}, {found.verdict}: {found.says}{sure}"
    sheet.suptitle(fill(says, TITLE_WIDTH), x=0.01, ha="left", fontsize=11)
    draw(bars_of(found), left)
    where.draw([where.Bar(p.condition, p.share_of_error, p.rms_ratio) for p in found.where[:MOST_BARS]], right)
    most = f"the model as it is fails most at {found.where[0].condition}" if found.where else "the model as it is fails nowhere"
    right.set_title(f"{most}\nbeside a bar: rms there over that of the whole run", loc="left", fontsize=10)
    return sheet


def bars_of(found: Diagnosis) -> list[Bar]:
    """Return the bars of a diagnosis: the model as it is, then the candidates in their order."""
    floor = found.noise_floor
    base = Bar("model as it is", found.base.train.over(floor), found.base.validation.over(floor), 0.0, None, named=False)
    named = "+".join(found.effects)
    return [
        base,
        *(
            Bar(
                c.effect,
                c.errors.train.over(floor),
                c.errors.validation.over(floor),
                c.explained,
                c.probability,
                named=bool(named) and c.effect == named,
                worse=c.worse,
            )
            for c in found.candidates
        ),
    ]


def draw(bars: list[Bar], ax: Axes) -> None:
    """Draw the error over the noise floor of each candidate: bars for unseen runs, rings for fitted ones, the floor at 1."""
    canvas.dress(ax, x="free-run error over the noise floor")
    judged = any(isfinite(b.unseen) for b in bars)
    errors = [b.unseen if judged else b.fitted for b in bars]
    rows = list(range(len(bars)))[::-1]
    end = min(max(*errors, *(b.fitted for b in bars), 1.0), MOST_TIMES * max(errors[0], 1.0))
    colours = [canvas.SIMULATED if b.named else canvas.QUIET for b in bars]
    ax.barh(rows, errors, color=colours, height=0.62, label="unseen runs" if judged else "fitted runs")
    if judged:
        fitted = [b.fitted for b in bars]
        ax.plot(fitted, rows, "o", markerfacecolor="white", markeredgecolor="0.25", markersize=6, label="fitted runs")
    ax.axvline(1.0, color=canvas.SECOND, linewidth=1.4, linestyle="--", label="noise floor")
    for row, b, error in zip(rows, bars, errors, strict=True):
        place = (min(max(error, b.fitted), end), row)
        ax.annotate(words_of(b, error), place, xytext=(7, 0), textcoords="offset points", va="center", fontsize=8.5)
    ax.set_yticks(rows, [fill(b.effect.replace("+", " +"), LABEL_WIDTH) for b in bars], fontsize=9)
    ax.set_xlim(0.0, 1.95 * end)
    ax.grid(visible=False, axis="y")
    canvas.legend_above(ax, 3)


def words_of(b: Bar, error: float) -> str:
    """Return the label of a bar: the error over the floor, the share of the excess explained if any, the probability."""
    if b.probability is None:
        return f"{error:.2f} x"
    does = "worse" if b.worse else f"{100 * b.explained:.0f} % explained"
    return f"{error:.2f} x, {does}, probability {probability(b.probability)}"
