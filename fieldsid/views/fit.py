"""A fit: warnings, statistics, parameters with errors and intervals, correlations; the free runs as table and figure."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite
from typing import TYPE_CHECKING, Any

from fieldsid.display import Figures, Frames, View
from fieldsid.figures.sketch import sketch
from fieldsid.page import Block, Page, facts, listed
from fieldsid.records.keys import body_of
from fieldsid.rounding import RADIANS, p_value
from fieldsid.views._words import (
    base_words,
    joined,
    merit_blocks,
    parameter_block,
    parameter_rows,
    some,
    table,
    warned,
)

if TYPE_CHECKING:
    from pandas import DataFrame

    from fieldsid.fitting.fit import Fit
    from fieldsid.fitting.predict.predict import Prediction
    from fieldsid.logs import Note

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
    """Return the blocks of a fit's report."""
    from fieldsid.comparison.compare import errors_in_words
    from fieldsid.fitting.predict.goodness_of_fit import goodness_of_fit

    model, records = fit.model, [p.record for p in fit.predictions]
    seconds = sum(float(r.time[-1] - r.time[0]) for r in records)
    whiteness = model.info.get("whiteness_p")
    known = facts(
        "Statistics",
        (
            ("method", model.method),
            ("effects", listed(model.effects) or "none"),
            ("runs", listed(model.runs)),
            ("samples", f"{sum(len(r) for r in records)} in {seconds:.1f} s"),
            ("estimated", some(len(model.free), "parameter")),
            *((f"{n} error", e) for n, e in errors_in_words(goodness_of_fit(fit.predictions), fit.floor, RADIANS, 3)),
            ("whiteness", "" if whiteness is None else p_value(whiteness)),
        ),
    )
    blocks = (known, parameter_block([("", model)]), _correlations(fit), *_runs(fit))
    return Page(f"Fit of the {model.axis.value} axis", warned(_warnings(fit)), blocks)


def frames(fit: Fit) -> Frames:
    """Return the parameters, the runs, the correlation of the estimates, and the motion of all runs over time."""
    return {
        "parameters": lambda: table(parameter_rows(fit.model), "parameter"),
        "runs": lambda: table(map(_run_row, fit.predictions), "run"),
        "correlation": lambda: _correlation(fit),
        "motion": lambda: motion(fit.predictions),
    }


def figures(fit: Fit) -> Figures:
    """Return the motion of each run by its name, and the estimates over time of a recursive method."""
    drawn = {p.record.name: sketch("identify", fit, i) for i, p in enumerate(fit.predictions)}
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
    rows = tuple((f"{a}, {b}", f"{rho:+.2f}") for a, b, rho in _pairs(fit) if abs(rho) > LEAST_CORRELATION)
    return Block(f"Correlations (those below {LEAST_CORRELATION:g} are left out)", rows)


def _pairs(fit: Fit) -> Iterator[tuple[str, str, float]]:
    names = fit.model.free
    for j in range(len(names)):
        for i in range(j):
            yield names[i], names[j], float(fit.correlation[i, j])


def _correlation(fit: Fit) -> DataFrame:
    import pandas as pd

    return pd.DataFrame(fit.correlation, index=list(fit.model.free), columns=list(fit.model.free))


def _runs(fit: Fit) -> tuple[Block | str, ...]:
    """Return a row for each run, nothing where there is one."""
    from fieldsid.fitting.predict.goodness_of_fit import goodness_of_fit

    runs = [(p.record.name, p.record.speed, goodness_of_fit([p]), fit.floor) for p in fit.predictions]
    return merit_blocks(runs, RADIANS) if len(runs) > 1 else ()


def _run_row(p: Prediction) -> dict[str, Any]:
    from fieldsid.fitting.predict.goodness_of_fit import goodness_of_fit

    return {"run": p.record.name, "speed_m_s": p.record.speed, **body_of(goodness_of_fit([p]))}


VIEW = View("fit", line, page, frames, lambda fit: "+".join(fit.model.runs), figures)
