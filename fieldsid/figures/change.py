"""The figure of before and after: both vehicles at the same fin, the change of each parameter, the gains over speed."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from fieldsid.change.record import CHANGED, Answers, Change, GainChange, ParameterChange
from fieldsid.figures.panel import MOST_TIMES, Cell, Panel, Picture, Series
from fieldsid.rounding import TWO_SIDED_95

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BEFORE, AFTER = "second", "simulated"


def figure(found: Change, names: tuple[str, str]) -> Picture:
    """Return the answers to the same fin over each other, and at the right the changes in per cent and the gains."""
    shown = [p for p in found.parameters if p.is_relative and np.isfinite(p.std_error)]
    left: Sequence[Cell] = () if found.answers is None else _answers(found.answers, names)
    right: Sequence[Cell] = (
        *([partial(draw, shown)] if shown or not found.gains else []),
        *([_gains(found.gains)] if found.gains else []),
    )
    return Picture(found.line, (13.0, 6.5), [column for column in (left, right) if column])


def draw(parameters: list[ParameterChange], ax: Axes) -> None:
    """Draw the change of each parameter with its 95 % interval, in per cent, the speeds below it where there are several."""
    from fieldsid.figures import canvas

    rows: list[tuple[str, float, float]] = []
    for p in parameters:
        rows.append((p.word, p.change, TWO_SIDED_95 * p.std_error))
        speeds = p.speeds if len(p.speeds) > 1 else ()
        rows += [(f"{a.speed:.2f} m/s", a.change, TWO_SIDED_95 * a.std_error) for a in speeds]
    places = -np.arange(len(rows), dtype=float)
    ax.axvline(0.0, color="0.4", linewidth=0.8)
    change, reach = (100.0 * np.array([r[i] for r in rows], dtype=float) for i in (1, 2))
    ax.errorbar(change, places, xerr=reach, fmt="o", color=canvas.SIMULATED, markersize=5)
    ax.set_yticks(places, [r[0] for r in rows])
    ax.margins(y=0.1)
    changed = ", ".join(p.word for p in parameters if p.state == CHANGED) or "nothing"
    canvas.dress(ax, x="change, %, with 95 % interval", title=f"beyond its error changed: {changed}")


def _answers(both: Answers, names: tuple[str, str]) -> tuple[Panel, Panel]:
    """Return the rates of both vehicles at the same fin, and the fin."""
    rates = zip((both.old_rate, both.new_rate), (BEFORE, AFTER), names, strict=True)
    series = [Series(both.time, np.degrees(values), kind, name) for values, kind, name in rates]
    above = Panel("rate, deg/s", series, height=220, title=f"both models at the same fin, {both.speed:.2f} m/s")
    return above, Panel("fin, deg", (Series(both.time, np.degrees(both.fin), "fin", form="steps"),), height=100, x="time, s")


def _gains(gains: tuple[GainChange, ...]) -> Panel:
    """Return the gain before and after over speed, on a scale that shows the gains where a band is far wider."""
    speeds, old, new = (np.array([getattr(g, name) for g in gains]) for name in ("speed", "old", "new"))
    low, high = (np.array([(1 + g.interval95[i]) * g.old for g in gains]) for i in (0, 1))
    error = np.abs(np.stack([new - low, high - new]))
    series = [Series(speeds, old, BEFORE, "before"), Series(speeds, new, AFTER, "after, 95 % band")]
    series += [Series(speeds, old, BEFORE, form="points"), Series(speeds, new, AFTER, form="points", error=error)]
    known = np.concatenate([old, new])[np.isfinite([*old, *new])]
    reach = MOST_TIMES * max(np.abs(known), default=1.0)
    ends = np.clip([np.nanmin([low, high, old, new]), np.nanmax([low, high, old, new])], -reach, reach)
    spare = 0.25 * max(float(np.ptp(ends)), 0.1 * reach)
    least, most = (f([100 * g.change for g in gains]) for f in (min, max))
    span = f"{least:+.0f} %" if round(least) == round(most) else f"{least:+.0f} to {most:+.0f} %"
    title = f"the gain that would be designed changes by {span}"
    return Panel("kp, rad/rad", series, limits=(ends[0] - spare, ends[1] + spare), x="speed, m/s", title=title)
