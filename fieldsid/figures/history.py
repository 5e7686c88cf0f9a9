"""The figure of a line of models: the error on unseen and on fitted runs, falling addition by addition to the noise floor."""

from __future__ import annotations

from collections.abc import Sequence

from fieldsid.extension.extend import Gain
from fieldsid.extension.lineage import Generation
from fieldsid.figures import bars
from fieldsid.figures.panel import Picture
from fieldsid.rounding import DEGREES


def figure(line: Sequence[Generation], name: str) -> Picture:
    """Return the figure of a line with at least one addition."""
    return fall_figure([g.step.gain for g in line if g.step], line[0].effects, name)


def fall_figure(gains: Sequence[Gain], before: Sequence[str], name: str) -> Picture:
    """Return the figure of additions to a model with some effects before."""
    rows = bars.steps(gains, before)
    return Picture(f"{name}: {bars.fall(gains, DEGREES)}", (9.0, 2.0 + 0.6 * len(rows.rows)), ((rows,),))
