"""The charts of a report, one function each: free runs, laws over speed, radius, gains, modelling loop, places of failure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np

from fieldsid.comparison.compare import Comparison
from fieldsid.comparison.localize import Place
from fieldsid.extension.lineage import Loop
from fieldsid.models.axis import NAMES
from fieldsid.plant.parameter_source import ParameterSource
from fieldsid.reporting.chart import Band, Panel, Series, bars, chart, legend, thinned
from fieldsid.rounding import DEGREES, TWO_SIDED_95
from fieldsid.schedule.record import Schedule

DEG = np.degrees(1.0)
MOST_BARS = 8


def free_run(found: Comparison, title: str) -> tuple[str, str]:
    """Return the chart of a free run over its measurement, the worst stretches shaded, and its legend."""
    shown, record = found.shown, found.shown.record
    spans = [(s.start_s, s.end_s) for c in found.failing[:1] for s in c.worst]
    time, angle, rate, fin = thinned(record.time, DEG * shown.angle, DEG * shown.rate, DEG * record.fin)
    panels, named = [], [Series(time, angle, "simulated", "free run of the model")]
    for word, unit, values, ok, model in (
        ("angle", "deg", record.angle, record.angle_ok, angle),
        ("rate", "deg/s", record.rate, record.rate_ok, rate),
    ):
        if not ok.any():
            continue
        seen, there = thinned(record.time, np.where(ok, DEG * values, np.nan))
        measured = Series(seen, there, "measured", "measured", "dots")
        named.insert(0, measured)
        panels.append(Panel(f"{word}, {unit}", (measured, Series(time, model, "simulated", "model")), height=125, spans=spans))
        panels.append(
            Panel(f"measured less model, {unit}", (Series(time, there - model, "second", "left over"),), height=60, spans=spans)
        )
    panels.append(Panel("fin, deg", (Series(time, fin, "quiet", "fin", "steps"),), height=60))
    return chart(panels, "time, s", title), legend(named)


def loop_motion(loop: Loop, *, has_last: bool) -> tuple[str, str]:
    """Return the chart of the measurement and the first model's free run, and its legend; with `has_last` also the last model's.

    The worst stretches of the first model are shaded.
    """
    models, title = [(loop.start, loop.before, "second")], f"the {loop.start} and the measurement"
    if has_last:
        models.append((f"with {', '.join(loop.added)}", loop.after, "simulated"))
        title = "the model with what was added, and the measurement"
    record, is_rate = loop.before.shown.record, loop.before.worst_channel.name == "rate"
    values, ok = (record.rate, record.rate_ok) if is_rate else (record.angle, record.angle_ok)
    seen, there = thinned(record.time, np.where(ok, DEG * values, np.nan))
    series = [Series(seen, there, "measured", "measured", "dots")]
    for name, found, kind in models:
        time, motion = thinned(record.time, DEG * (found.shown.rate if is_rate else found.shown.angle))
        series.append(Series(time, motion, kind, name))
    spans = [(s.start_s, s.end_s) for s in loop.before.worst_channel.worst]
    label = f"{record.axis.value} rate, deg/s" if is_rate else f"{record.axis.value}, deg"
    return chart([Panel(label, series, height=140, spans=spans)], "time, s", title), legend(series)


def loop_steps(loop: Loop) -> str:
    """Return bars of the error on unseen and on fitted runs, before the first addition and after each."""
    rows = []
    for step in loop.steps:
        sides = (("unseen", step.unseen, step.says[1]), ("fitted", step.fitted, step.says[0]))
        rows += [(f"{step.added}, {side}", value, says) for side, value, says in sides if isfinite(value)]
    return bars(rows, "the error step by step", mark=None if loop.is_noiseless else (1.0, "the sensors' noise"))


def failures(places: Sequence[Place], title: str) -> str:
    """Return bars of the share of the squared error of each condition less its share of the samples, in per cent."""
    worse = [p for p in places[:MOST_BARS] if p.beyond > 0.0]
    rows = [(DEGREES.words(p.condition), 100.0 * p.beyond, f"+{100.0 * p.beyond:.0f} %, {p.rms_ratio:.2f} x") for p in worse]
    return bars(rows, title)


def over_speed(source: ParameterSource, name: str, unit: str) -> str | None:
    """Return the chart of a parameter over speed with 95 % errors, and its law with a band where there are two speeds.

    The authority is drawn over the squared speed, where the lift of a fin is a straight line.
    """
    points = [p for p in source.points if name in p.values]
    if not points:
        return None
    power, x_label = (2, "speed squared, m²/s²") if name == NAMES[source.axis].authority else (1, "speed, m/s")
    speeds = np.array([p.speed for p in points])
    values = np.array([p.values[name] for p in points])
    errors = np.array([TWO_SIDED_95 * p.std_errors.get(name, 0.0) for p in points])
    dots = Series(speeds**power, values, "measured", name, "points", errors)
    if source.laws is None or name not in source.laws.by_name or np.ptp(speeds) == 0:
        margin = np.array([speeds.min() * 0.9, speeds.max() * 1.1]) ** power
        return chart([Panel(f"{name}, {unit}", (dots, Series(margin, np.full(2, np.nan), "quiet")), height=130)], x_label, name)
    law = source.laws.by_name[name]
    x = np.linspace(0.92 * speeds.min(), 1.08 * speeds.max(), 60)
    y, (low, high) = law.at(x), law.line.band(x)
    ends = np.sort(np.stack([law.sign * low, law.sign * high]), axis=0)
    series = (Series(x**power, y, "simulated", f"law: {law.chosen.replace('_', ' ')}"), dots)
    panel = Panel(f"{name}, {unit}", series, (Band(x**power, ends[0], ends[1], "simulated"),), height=130)
    return chart([panel], x_label, f"{name} over {x_label.partition(',')[0]}")


def radius(body: Mapping[str, Any]) -> tuple[str, str]:
    """Return the radius over speed to both sides with its bands, and the legend."""
    series, bands = [], []
    for side, kind in (("port", "port"), ("starboard", "starboard")):
        rows = sorted((r for r in body["rows"] if r["side"] == side), key=lambda r: float(r["speed_m_s"]))
        if not rows:
            continue
        x = np.array([r["speed_m_s"] for r in rows], dtype=float)
        y = np.array([r["radius_m"] for r in rows], dtype=float)
        low, high = (np.array([r["interval95"][i] for r in rows], dtype=float) for i in (0, 1))
        series += [Series(x, y, kind, side), Series(x, y, kind, side, "points")]
        bands.append(Band(x, low, high, kind))
    return chart([Panel("radius, m", series, bands, 170, from_zero=True)], "speed, m/s", "turning radius over speed"), legend(
        series
    )


def gains(schedule: Schedule) -> str:
    """Return the chart of the gains of a schedule and its phase margin over speed, with the required margin."""
    x = np.array(schedule.speeds, dtype=float)

    def line(values: Sequence[float], kind: str, name: str) -> tuple[Series, Series]:
        y = np.array(values, dtype=float)
        return Series(x, y, kind, name), Series(x, y, kind, name, "points")

    kinds = {"kp, rad/rad": "kp", "ki, 1/s": "ki", "kd, s": "kd"}
    drawn = {label: [getattr(r.gains, name) for r in schedule.rows] for label, name in kinds.items()}
    panels = [Panel(label, line(y, "simulated", kinds[label])) for label, y in drawn.items() if any(y)]
    margin = line([r.phase_margin_deg for r in schedule.rows], "second", "phase margin")
    required = Series(x, np.full(x.size, schedule.phase_margin_deg), "quiet", "asked for")
    panels.append(Panel("phase margin, deg (line: asked for)", (required, *margin), height=100, from_zero=True))
    return chart(panels, "speed, m/s", "gains and phase margin over speed")


def parameters_of(axis: str) -> list[tuple[str, str]]:
    """Return the base parameters of an axis with their units."""
    names = next(n for a, n in NAMES.items() if a.value == axis)
    units = {names.damping: "1/s", names.authority: "1/s²", names.trim: "rad/s²", names.stiffness: "1/s²"}
    return [(n, units[n]) for n in names.base]
