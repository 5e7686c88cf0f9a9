"""The figure of a diagnosis: the error with each candidate and its probability, and where the model fails."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from textwrap import fill

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fieldsid.diagnosis import Diagnosis, Pair
from fieldsid.figures import canvas, where
from fieldsid.models.model import Noise
from fieldsid.rounding import DEGREES, probability

MOST_BARS = 10
TITLE_WIDTH = 150
LABEL_WIDTH = 30
BELOW = 0.36
"""Distance of the ring of the fitted runs below the middle of its bar, as the label is next to the bar."""
MOST_TIMES = 3.0
"""Multiple of the first bar at which longer bars are cut: an effect that raises the error must not determine the scale."""


@dataclass(frozen=True, slots=True)
class Bar:
    """One candidate: error on fitted and on unseen runs, error in words, share explained, probability, whether it is named.

    The errors are over the noise floor, or for a log without noise over those of the present model, which has no probability.
    `worse`: the candidate raises the error and explains nothing.
    """

    effect: str
    fitted: float
    unseen: float
    says: str
    explained: float
    probability: float | None
    named: bool
    worse: bool = False


def figure(found: Diagnosis) -> Figure:
    """Return a sheet with the candidates at the left and where the model fails at the right."""
    chances = [c.probability for c in found.candidates]
    sure = f", probability {probability(chances[0])}" if found.effects and chances[0] == max(chances) else ""
    says = f"{found.axis.value}, {found.verdict}: {found.says}{sure}"
    sheet = canvas.sheet(13.0, 6.4, fill(says, TITLE_WIDTH))
    left, *right = sheet.subplots(1, 2 if found.where else 1, squeeze=False, width_ratios=(1.25, 1.0) if found.where else None)[0]
    draw(bars_of(found), left, noiseless=found.noiseless)
    for ax in right:
        where.draw(found.where[:MOST_BARS], ax)
        most = f"the model as it is fails most at\n{DEGREES.words(found.where[0].condition)}"
        ax.set_title(f"{most}\nbeside a bar: rms there over that of the whole run", loc="left", fontsize=10)
    return sheet


def bars_of(found: Diagnosis) -> list[Bar]:
    """Return the bars of a diagnosis: the present model, then the candidates in order."""
    named = "+".join(found.effects)
    base = [found.base.train, found.base.validation]
    references = [Noise(e.angle_rms_rad, e.rate_rms_rad_s) if found.noiseless else found.noise_floor for e in base]

    def bar(effect: str, errors: Pair, explained: float, p: float | None, *, worse: bool = False) -> Bar:
        sides = (errors.train, errors.validation)
        fitted, unseen = (e.over(one) for e, one in zip(sides, references, strict=True))
        judged = isfinite(unseen)
        says = sides[judged].sized() if found.noiseless else f"{unseen if judged else fitted:.2f} x"
        return Bar(effect, fitted, unseen, says, explained, p, named=bool(named) and effect == named, worse=worse)

    return [
        bar("model as it is", found.base, 0.0, None),
        *(bar(c.effect, c.errors, c.explained, c.probability, worse=c.worse) for c in found.candidates),
    ]


def draw(bars: list[Bar], ax: Axes, *, noiseless: bool = False) -> None:
    """Draw the error of each candidate: bars for unseen runs, rings below them for fitted ones, the noise floor, if any, at 1."""
    canvas.dress(ax, x=f"free-run error over {'that of the model as it is' if noiseless else 'the noise floor'}")
    judged = any(isfinite(b.unseen) for b in bars)
    errors = [b.unseen if judged else b.fitted for b in bars]
    rows = list(range(len(bars)))[::-1]
    end = min(max(*errors, *(b.fitted for b in bars), 1.0), MOST_TIMES * max(errors[0], 1.0))
    colours = [canvas.SIMULATED if b.named else canvas.QUIET for b in bars]
    ax.barh(rows, errors, color=colours, height=0.5, label="unseen runs" if judged else "fitted runs")
    if judged:
        rings = ([b.fitted for b in bars], [row - BELOW for row in rows])
        ax.plot(*rings, "o", markerfacecolor="white", markeredgecolor="0.25", markersize=6, label="fitted runs")
    if not noiseless:
        ax.axvline(1.0, color=canvas.SECOND, linewidth=1.4, linestyle="--", label="noise floor")
    for row, b, error in zip(rows, bars, errors, strict=True):
        place = (min(error, end), row)
        ax.annotate(words_of(b), place, xytext=(7, 0), textcoords="offset points", va="center", fontsize=8.5)
    ax.set_yticks(rows, [fill(b.effect.replace("+", " +"), LABEL_WIDTH) for b in bars], fontsize=9)
    ax.set_xlim(0.0, 1.95 * end)
    ax.grid(visible=False, axis="y")
    canvas.legend_above(ax, 3)


def words_of(b: Bar) -> str:
    """Return the label of a bar: the error, the share of the excess explained if any, the probability."""
    if b.probability is None:
        return b.says
    does = "worse" if b.worse else f"{100 * b.explained:.0f} % explained"
    return f"{b.says}, {does}, probability {probability(b.probability)}"
