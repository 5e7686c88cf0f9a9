"""The laws of one axis against speed: points with errors, candidates, the chosen law's band, the exponent's verdict."""

from __future__ import annotations

from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fieldsid.figures import canvas
from fieldsid.models.axis import NAMES
from fieldsid.plant.laws.axis_laws import Laws
from fieldsid.plant.laws.parameter_law import ParameterLaw
from fieldsid.rounding import TWO_SIDED_95

COLOURS = {
    "affine": canvas.SIMULATED,
    "through_zero": canvas.SECOND,
    "power": canvas.THIRD,
    "constant": canvas.FOURTH,
    "linear": canvas.WARM,
}
WORDS = {"through_zero": "through zero", "power": "power law", "affine": "affine in u²", "linear": "linear in u"}
UNITS = {"a22": "1/s", "b2": "1/s²", "C0": "rad/s²", "c22": "1/s", "c23": "1/s²", "d2": "1/s²", "Cb": "rad/s²"}


def figure(laws: Laws) -> Figure:
    """Return one panel per parameter, the authority large and against u^2."""
    others = [law for n, law in laws.by_name.items() if n != NAMES[laws.axis].authority]
    sheet = canvas.sheet(11.0, 6.0 if len(others) < 3 else 7.0)
    parts = sheet.subfigures(1, 2 if others else 1, squeeze=False, width_ratios=(1.6, 1.0) if others else None)[0]
    draw_authority(laws.authority, parts[0].subplots())
    axes = parts[1].subplots(len(others), 1, squeeze=False, sharex=True)[:, 0] if others else ()
    for law, ax in zip(others, axes, strict=True):
        draw_other(law, ax)
        ax.label_outer()
        ax.set_xlabel("speed u, m/s")
    return sheet


def draw_authority(law: ParameterLaw, ax: Axes) -> None:
    """Draw |authority| against u^2 with its candidates and the exponent's verdict."""
    square = np.linspace(0.0, 1.12 * float(law.speeds.max()) ** 2, 200)
    speed = np.sqrt(np.maximum(square, 1e-6))
    for line in law.candidates:
        chosen = line.kind == law.chosen
        label = WORDS.get(line.kind, line.kind) + (" (taken)" if chosen else "")
        style = "-" if chosen else "--"
        ax.plot(square, line.at(speed), style, color=COLOURS[line.kind], linewidth=1.8 if chosen else 1.2, label=label)
        if chosen and line.dof > 0:
            ax.fill_between(square, *line.band(speed), color=COLOURS[line.kind], alpha=0.15, linewidth=0, label="95 % band")
    _points(ax, law, law.speeds**2, law.values)
    words = law.exponent.says if law.exponent else ""
    canvas.dress(ax, x="u², m²/s²", y=f"|{law.name}|, {UNITS[law.name]}")
    ax.set_title(fill(f"|{law.name}| ~ {words}" if words else f"|{law.name}|", 66), loc="left", fontsize=10)
    ax.set_xlim(left=0.0)
    top = float(law.values.max())
    ax.set_ylim(0.0, 1.3 * top)
    ax.legend(loc="upper left", frameon=False, fontsize=9)


def draw_other(law: ParameterLaw, ax: Axes) -> None:
    """Draw a damping, stiffness or trim against speed with the law chosen."""
    speed = np.linspace(0.9 * float(law.speeds.min()), 1.05 * float(law.speeds.max()), 100)
    line = law.line
    ax.plot(speed, law.at(speed), color=COLOURS.get(line.kind, canvas.SIMULATED), linewidth=1.6)
    if line.dof > 0:
        ax.fill_between(speed, *line.band(speed), color=COLOURS.get(line.kind, canvas.SIMULATED), alpha=0.15, linewidth=0)
    _points(ax, law, law.speeds, law.values)
    canvas.dress(ax, y=f"{law.name}, {UNITS[law.name]}", title=f"{law.name}: {WORDS.get(line.kind, line.kind)}")


def _points(ax: Axes, law: ParameterLaw, x: np.ndarray, y: np.ndarray) -> None:
    error = None if law.std_errors is None else TWO_SIDED_95 * law.std_errors
    ax.errorbar(x, y, yerr=error, fmt="o", color="0.15", markersize=5, capsize=3, linewidth=1.0, zorder=5)
    odd = [i for i, p in enumerate(law.points) if not p.belongs]
    if odd:
        ax.plot(
            x[odd], y[odd], "o", markersize=13, markerfacecolor="none", markeredgecolor="red", zorder=6, label="does not belong"
        )
