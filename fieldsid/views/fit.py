"""A fit: warnings, statistics, parameters with errors and intervals, correlations; the free runs as table and figure."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite
from typing import TYPE_CHECKING

from fieldsid.display import Figures, Frames, View, page_of
from fieldsid.figures.sketch import sketch
from fieldsid.page import Block, Page, listed
from fieldsid.records.keys import body_of
from fieldsid.rounding import RADIANS
from fieldsid.views._words import base_words, joined, merit_blocks, parameter_rows, some, table, warned

if TYPE_CHECKING:
    from pandas import DataFrame

    from fieldsid.fitting.fit import Fit
    from fieldsid.fitting.predict.goodness_of_fit import GoodnessOfFit
    from fieldsid.fitting.predict.predict import Prediction
    from fieldsid.logs import Note
    from fieldsid.models.model import Noise

LEAST_CORRELATION = 0.5
"""Correlations of less are not shown: they hardly widen an interval."""


def line(fit: Fit) -> str:
    """Return axis, method, effects, base parameters, how well the free run follows, and how many warnings there are."""
    from fieldsid.fitting.predict.goodness_of_fit import goodness_of_fit

    model, m = fit.model, goodness_of_fit(fit.predictions)
    how_well = f"rate fit {m.rate_fit:.1f} %" if isfinite(m.rate_fit) else f"angle fit {m.angle_fit:.1f} %"
    head = joined(model.axis.value, model.method, listed(model.effects), some(len(fit.predictions), "run"))
    return f"{head}: {joined(base_words(model), how_well, some(len(_warnings(fit)), 'warning'))}"


def page(fit: Fit) -> Page:
    """Return the model with its warnings, the correlations of its parameters, and how each run is followed."""
    blocks = (*page_of(fit.model).blocks, _correlations(fit), *merit_blocks(_runs(fit), RADIANS))
    return Page(f"Fit of the {fit.model.axis.value} axis", warned(_warnings(fit)), blocks)


def frames(fit: Fit) -> Frames:
    """Return the parameters, the runs, the correlation of the estimates, and the motion of all runs over time."""
    return {
        "parameters": lambda: table(parameter_rows(fit.model), "parameter"),
        "runs": lambda: table(({"run": n, "speed_m_s": u, **body_of(m)} for n, u, m, _ in _runs(fit)), "run"),
        "correlation": lambda: _correlation(fit),
        "motion": lambda: motion(fit.predictions),
    }


def figures(fit: Fit) -> Figures:
    """Return the motion of each run by its name, and the estimates over time of a recursive method."""
    drawn = {p.record.name: sketch("identify", fit, i, line(fit)) for i, p in enumerate(fit.predictions)}
    if fit.history is not None:
        drawn["over_time"] = sketch("identify", fit, fit.history, draw="history_figure")
    return drawn


def motion(predictions: tuple[Prediction, ...]) -> DataFrame:
    """Return measured and simulated motion by run and time: angle rad, rate rad/s, fin rad; NaN where nothing was measured."""
    import numpy as np
    import pandas as pd

    parts = {
        p.record.name: pd.DataFrame(
            {
                "angle_rad": np.where(p.record.angle_ok, p.record.angle, np.nan),
                "angle_simulated_rad": p.angle,
                "rate_rad_s": np.where(p.record.rate_ok, p.record.rate, np.nan),
                "rate_simulated_rad_s": p.rate,
                "fin_rad": p.record.fin,
                "fin_simulated_rad": p.fin,
            },
            index=pd.Index(p.record.time, name="time_s"),
        )
        for p in predictions
    }
    return pd.concat(parts, names=["run"])


def _warnings(fit: Fit) -> list[Note]:
    from fieldsid.fitting.checks.warnings import is_warning

    return [n for n in fit.notes if is_warning(n, fit.model.axis)]


def _correlations(fit: Fit) -> Block:
    names, rho = fit.model.free, fit.correlation
    pairs = ((names[i], names[j], float(rho[i, j])) for j in range(len(names)) for i in range(j))
    rows = tuple((f"{a}, {b}", f"{share:+.2f}") for a, b, share in pairs if abs(share) > LEAST_CORRELATION)
    return Block(f"Correlations (those below {LEAST_CORRELATION:g} are left out)", rows)


def _correlation(fit: Fit) -> DataFrame:
    import pandas as pd

    return pd.DataFrame(fit.correlation, index=list(fit.model.free), columns=list(fit.model.free))


def _runs(fit: Fit) -> Iterator[tuple[str, float, GoodnessOfFit, Noise]]:
    """Yield name, speed, fit and noise of each run."""
    from fieldsid.fitting.predict.goodness_of_fit import goodness_of_fit

    yield from ((p.record.name, p.record.speed, goodness_of_fit([p]), fit.floor) for p in fit.predictions)


VIEW = View("fit", line, page, frames, lambda fit: "+".join(fit.model.runs), figures)
