"""A run: what was measured how often, the findings, the signals as a table over time, and as a figure."""

from __future__ import annotations

from math import nan
from typing import TYPE_CHECKING, Any

from fieldsid.display import Figures, Frames, View
from fieldsid.figures.sketch import sketch
from fieldsid.page import Block, Page, cut, facts, listed
from fieldsid.rounding import RADIANS, Angles, number
from fieldsid.views._words import joined, some, speed_words, warned

if TYPE_CHECKING:
    from pandas import DataFrame

    from fieldsid.logs import Note, Run


def line(run: Run) -> str:
    """Return name, samples, rate, speed, how many notes warn, and signals."""
    measured = [n for n in run.signals if run.has(n)]
    words = joined(f"{len(run)} samples", _span(run), speed_words(_speed(run)), some(len(_findings(run)), "note"))
    return f"{cut(run.name, 60)}: {words}; {listed(measured, 5)}"


def page(run: Run, angles: Angles = RADIANS) -> Page:
    """Return the findings, the run's length and rate, and each signal's count and range."""
    import numpy as np

    from fieldsid.logs.run import COLUMNS

    rows = []
    for name, values in run.signals.items():
        seen = values[np.isfinite(values)]
        factor, unit = angles.of(COLUMNS.get(name, ""))
        ends = (seen.min(), seen.max(), seen[-1]) if seen.size else (nan, nan, nan)
        rows.append((name, unit, str(seen.size), *(number(factor * float(v)) for v in ends)))
    known = facts(
        "Statistics",
        (
            ("samples", f"{len(run)}, {_span(run)}"),
            ("time", f"{run.time[0]:.2f} .. {run.time[-1]:.2f} s" if len(run) else ""),
            ("speed", speed_words(_speed(run))),
            ("source", "" if run.source is None else str(run.source)),
        ),
    )
    signals = Block("Signals", tuple(rows), ("", "unit", "measured", "least", "largest", "last"), left=2)
    found = _findings(run)
    quiet = tuple(n.message for n in run.notes if n not in found)
    return Page(f"Run {cut(run.name, 60)}", warned(found), (known, signals), quiet)


def _findings(run: Run) -> list[Note]:
    """Return the notes that warn."""
    from fieldsid.logs.run import EXPLAINING

    return [n for n in run.notes if n.code not in EXPLAINING]


def frames(run: Run) -> Frames:
    """Return the signals over time_s, as `Run.from_frame` takes them back; the notes."""
    from fieldsid.views._words import table

    notes: list[dict[str, Any]] = [{"code": n.code, "message": n.message} for n in run.notes]
    return {"signals": lambda: _signals(run), "notes": lambda: table(notes)}


def read(frame: DataFrame, name: str) -> Run:
    """Return the run of a table."""
    from fieldsid.logs.pandas_table import run_of_frame

    return run_of_frame(frame, name)


def _signals(run: Run) -> DataFrame:
    import pandas as pd

    from fieldsid.logs.mapping.vocabulary import TIME

    made = pd.DataFrame(dict(run.signals), index=pd.Index(run.time, name=TIME))
    made.attrs["name"] = run.name
    return made


def _span(run: Run) -> str:
    import numpy as np

    if len(run) < 2:
        return ""
    return f"{run.time[-1] - run.time[0]:.1f} s at {number(1.0 / float(np.median(np.diff(run.time))), 3)} Hz"


def _speed(run: Run) -> float:
    import numpy as np

    return float(np.nanmedian(run["surge_m_s"])) if run.has("surge_m_s") else float("nan")


def figures(run: Run) -> Figures:
    """Return the signals over time."""
    return {"signals": sketch("run", run, line(run))}


VIEW = View("run", line, page, frames, lambda run: run.name, figures, read)
