"""Blocks that several views share: numbers with their errors, errors against the noise, warnings, rows as tables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import isfinite, nan
from typing import TYPE_CHECKING, Any

from fieldsid.page import Block, counted, cut, facts
from fieldsid.rounding import MANY, RADIANS, Angles, number, with_error

if TYPE_CHECKING:
    from pandas import DataFrame

    from fieldsid.fitting.predict.goodness_of_fit import GoodnessOfFit
    from fieldsid.logs import Note
    from fieldsid.models.model import Model, Noise


def warned(notes: Iterable[Note]) -> tuple[str, ...]:
    """Return notes as warnings, each with its code."""
    return tuple(f"{n.message} [{n.code}]" for n in notes)


def some(count: int, word: str) -> str:
    """Return `1 warning`, `2 warnings`; empty for none."""
    return counted(count, word) if count else ""


def joined(*parts: str) -> str:
    """Return the non-empty parts, joined by commas."""
    return ", ".join(p for p in parts if p)


def speed_words(speed: float) -> str:
    """Return a speed, empty where it is not known."""
    return f"{speed:.2f} m/s" if isfinite(speed) else ""


def base_words(model: Model) -> str:
    """Return the base parameters of a model with their errors: `a22 = 1.104 +/- 0.013 1/s`."""
    from fieldsid.fitting.estimates import estimates
    from fieldsid.models.axis import NAMES

    base = NAMES[model.axis].base
    known = (e for e in estimates(model) if e.name in base)
    return ", ".join(f"{e.name} = {with_error(e.value, e.std_error)} {e.unit}".rstrip() for e in known)


def parameter_block(models: Iterable[tuple[str, Model]], angles: Angles = RADIANS) -> Block:
    """Return the parameters of models, each with the name of its run: value and error, unit, 95 % interval.

    A value on a bound has no error. A model without a name is the only one, and the title has its speed.
    """
    from fieldsid.dynamics.at_bound import at_bound
    from fieldsid.fitting.estimates import estimates

    rows: list[tuple[str, ...]] = []
    title = ""
    for name, model in models:
        title = "" if name else f"Parameters at {speed_words(model.law.reference)}".removesuffix(" at ")
        bound, law = at_bound(model), model.info.get("law_parameters", {})
        for i, e in enumerate(estimates(model)):
            cells = angles.estimate(e.value, e.std_error, e.interval95, e.unit, at_bound=e.name in bound)
            rows.append(("" if i else name, e.name if e.name in law else model.shown(e.name), *cells))
    return Block(title, tuple(rows), ("run", "parameter", "value", "unit", "95 % interval"), left=2)


def parameter_rows(model: Model) -> list[dict[str, Any]]:
    """Return the parameters of a model as rows of a table."""
    from fieldsid.fitting.estimates import estimates

    return [
        {"parameter": e.name, "value": e.value, "std_error": e.std_error, "low95": low, "high95": high, "unit": e.unit}
        for e in estimates(model)
        for low, high in [e.interval95]
    ]


def merit_blocks(runs: Iterable[tuple[str, float, GoodnessOfFit, Noise]], angles: Angles) -> tuple[Block, str]:
    """Return a table of the error and fit of each run's free run, from name, speed, fit and noise, and a line with its units."""
    rows = [
        (
            name,
            number(speed, 3),
            *(number(angles.factor * v, 2) for v in (m.angle_rms, floor.angle if isfinite(m.angle_rms) else nan)),
            number(m.angle_fit, 3),
            *(number(angles.factor * v, 2) for v in (m.rate_rms, floor.rate if isfinite(m.rate_rms) else nan)),
            number(m.rate_fit, 3),
        )
        for name, speed, m, floor in runs
    ]
    heads = ("run", "m/s", "angle rms", "noise", "fit %", "rate rms", "noise", "fit %")
    return Block("", tuple(rows), heads), f"angle in {angles.unit}, rate in {angles.unit}/s"


def times(ratio: float) -> str:
    """Return an error over the noise floor, `-` where there is none."""
    return f"{ratio:.2f}" if abs(ratio) < MANY else number(ratio, 3)


def percent(share: float) -> str:
    """Return a share in per cent."""
    return f"{100 * share:.0f} %"


def where_block(title: str, where: Iterable[Any], angles: Angles, most: int) -> Block:
    """Return where a model fails: condition, share of squared error and samples, rms over the whole run's, the worst time."""
    rows = [
        (
            angles.words(p.condition),
            percent(p.share_of_error),
            percent(p.share_of_samples),
            f"{p.rms_ratio:.2f}",
            f"{p.start_s:.1f} .. {p.end_s:.1f}",
        )
        for p in list(where)[:most]
    ]
    return Block(title, tuple(rows), ("", "of error", "of time", "rms ratio", "worst, s"))


def table(rows: Iterable[Mapping[str, Any]], index: str | None = None) -> DataFrame:
    """Return rows as a pandas table, by one of their columns where named."""
    import pandas as pd

    made = pd.DataFrame.from_records(list(rows))
    return made if index is None or made.empty else made.set_index(index)


def fact_block(title: str, row: Mapping[str, Any]) -> Block:
    """Return one row of a table as names and values."""
    return facts(title, ((name.replace("_", " "), cell(value)) for name, value in row.items()))


def cell(value: Any) -> str:
    """Return a value of a row in words."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return number(value)
    if isinstance(value, (list, tuple)):
        return " .. ".join(cell(v) for v in value) if all(isinstance(v, float) for v in value) else "; ".join(map(str, value))
    return cut(str(value), 200)
