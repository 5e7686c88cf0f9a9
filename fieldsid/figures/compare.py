"""The figure of a comparison: a free run against its measurement, the worst stretches shaded, and where the error falls."""

from __future__ import annotations

from math import degrees, isfinite

from matplotlib.figure import Figure

from fieldsid.comparison.compare import Comparison
from fieldsid.figures import canvas, motion, where
from fieldsid.models.model import Model
from fieldsid.rounding import number

MOST_BARS = 12


def figure(found: Comparison, model: Model, name: str) -> Figure:
    """Return a sheet with the four panels of the motion at the left and the share of the error by condition at the right."""
    sheet = canvas.sheet(13.0, 8.2)
    halves = sheet.subfigures(1, 2, squeeze=False, width_ratios=(1.75, 1.0))
    left, right = halves[0, 0], halves[0, 1]
    effects = f" with {', '.join(model.effects)}" if model.effects else ""
    title = f"{name}{effects} on {found.run}, {model.axis.value}"
    sheet.suptitle(f"{title}\n{facts(found)}; shaded: the worst stretches", x=0.01, ha="left", fontsize=11)
    axes = left.subplots(4, 1, sharex=True, height_ratios=(1.25, 1.25, 0.9, 1.0))
    motion.draw(view_of(found), list(axes))
    left.align_ylabels(list(axes))
    ax = right.subplots()
    where.draw([where.Bar(p.condition, p.share_of_error, p.rms_ratio) for p in found.where[:MOST_BARS]], ax)
    ax.set_title(
        f"where the error of the {found.channel} falls\n(label: rms there over the whole run's)", loc="left", fontsize=10
    )
    return sheet


def view_of(found: Comparison) -> motion.MotionView:
    """Return the panels' view of a comparison."""
    shown, floor = found.shown, found.floor
    spans = tuple((s.start_s, s.end_s) for s in found.worst)
    return motion.MotionView(shown.record, shown.angle, shown.rate, shown.fin, floor.angle, floor.rate, spans)


def facts(found: Comparison) -> str:
    """Return the line of facts: speed, rms beside the noise, fit."""
    m, floor = found.merit, found.floor
    parts = [f"{found.shown.record.speed:.2f} m/s"] if isfinite(found.shown.record.speed) else []
    for name, unit, rms, noise, fit in (
        ("angle", "deg", m.angle_rms, floor.angle, m.angle_fit),
        ("rate", "deg/s", m.rate_rms, floor.rate, m.rate_fit),
    ):
        if isfinite(rms):
            parts.append(
                f"{name} rms {number(degrees(rms), 2)} {unit} (noise {number(degrees(noise), 2)}), fit {number(fit, 3)} %"
            )
    return "; ".join(parts)
