"""The laws of one axis against speed: points with errors, candidates, the chosen law's band, the exponent's verdict."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fieldsid.figures.panel import Band, Panel, Picture, Series
from fieldsid.models.axis import NAMES
from fieldsid.rounding import TWO_SIDED_95

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fieldsid.plant.laws.axis_laws import Laws
    from fieldsid.plant.laws.parameter_law import ParameterLaw
    from fieldsid.plant.points import Point

KINDS = {"affine": "simulated", "through_zero": "second", "power": "third", "constant": "fourth", "linear": "warm"}
WORDS = {"through_zero": "through zero", "power": "power law", "affine": "affine in u²", "linear": "linear in u"}
UNITS = {"a22": "1/s", "b2": "1/s²", "C0": "rad/s²", "c22": "1/s", "c23": "1/s²", "d2": "1/s²", "Cb": "rad/s²"}
SPEED, SQUARE = "speed u, m/s", "u², m²/s²"


def figure(laws: Laws) -> Picture:
    """Return one panel per parameter, the authority large and against u^2."""
    authority = NAMES[laws.axis].authority
    others = [panel(law) for name, law in laws.by_name.items() if name != authority]
    columns = ((panel(laws.by_name[authority]),), others)[: 1 + bool(others)]
    return Picture("", (11.0, 6.0 if len(others) < 3 else 7.0), columns, (1.6, 1.0)[: len(columns)])


def panel(law: ParameterLaw) -> Panel:
    """Return a parameter with its law: the authority's size over the squared speed, where the lift of a fin is a straight line.

    The authority is drawn with every candidate, the others with the one that is taken.
    """
    power, sign = (2, 1.0) if law.exponent else (1, law.sign)
    speed = np.linspace(0.0 if law.exponent else 0.92 * float(law.speeds.min()), 1.08 * float(law.speeds.max()), 100)
    u = np.maximum(speed, 1e-3)
    series, bands = [], []
    for line in law.candidates if law.exponent else (law.line,):
        chosen, kind = line.kind == law.chosen, KINDS.get(line.kind, "simulated")
        name = WORDS.get(line.kind, line.kind) + (" (taken)" if chosen and law.exponent else "")
        series.append(Series(speed**power, sign * line.at(u), kind, name if law.exponent else "", dashed=not chosen))
        if chosen and line.dof > 0:
            low, high = np.sort(np.stack([sign * end for end in line.band(u)]), axis=0)
            bands.append(Band(speed**power, low, high, kind, "95 % band" if law.exponent else ""))
    error = None if law.std_errors is None else TWO_SIDED_95 * law.std_errors
    series.append(Series(law.speeds**power, sign * law.values, "measured", form="points", error=error))
    if odd := [i for i, p in enumerate(law.points) if not p.belongs]:
        series.append(Series(law.speeds[odd] ** power, sign * law.values[odd], "odd", "does not belong", "rings"))
    says = f"|{law.name}| ~ {law.exponent.says}" if law.exponent else f"{law.name}: {WORDS.get(law.line.kind, law.line.kind)}"
    label = f"|{law.name}|" if law.exponent else law.name
    label, x = f"{label}, {UNITS[law.name]}", SQUARE if law.exponent else SPEED
    return Panel(label, series, bands, 130, from_zero=law.exponent is not None, x=x, title=says)


def points(name: str, known: Sequence[Point]) -> Panel:
    """Return a parameter at points that have no law, as of a single speed."""
    speeds, values = np.array([p.speed for p in known]), np.array([p.values[name] for p in known])
    errors = np.array([TWO_SIDED_95 * p.std_errors.get(name, 0.0) for p in known])
    ends = Series(np.array([0.9 * speeds.min(), 1.1 * speeds.max()]), np.full(2, np.nan), "quiet")
    dots = Series(speeds, values, "measured", name, "points", errors)
    return Panel(f"{name}, {UNITS[name]}", (ends, dots), height=130, x=SPEED)
