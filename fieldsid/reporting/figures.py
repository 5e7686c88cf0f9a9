"""The charts of a report, one function each: free runs, laws over speed, radius, gains, the falling error, places of failure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fieldsid.comparison.compare import Channel, Comparison
from fieldsid.extension import Generation
from fieldsid.models.axis import NAMES
from fieldsid.plant.parameter_source import ParameterSource
from fieldsid.reporting.chart import Band, Panel, Series, bars, chart, legend, thinned
from fieldsid.rounding import MANY, TWO_SIDED_95

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


def failures(channel: Channel, title: str) -> str:
    """Return bars of the shares of a channel's squared error by condition."""
    return bars(
        [
            (p.condition, 100 * p.share_of_error, f"{100 * p.share_of_error:.0f} %, rms {p.rms_ratio:.2f} x")
            for p in channel.where[:MOST_BARS]
        ],
        title,
    )


def fall(line: Sequence[Generation], title: str) -> str | None:
    """Return bars of the error over the noise floor, from the first model of a line to its last; None where none was extended."""
    steps = [g for g in line if g.step is not None]
    if not steps or steps[0].step is None:
        return None
    before = ", ".join(e for e in steps[0].effects if e not in steps[0].step.gain.added) or "plain model"
    gains = [g.step.gain for g in steps if g.step is not None]
    rows = [(before, gains[0].over_floor[0], gains[0].judged[0])]
    rows += [(f"+ {', '.join(g.added)}", g.over_floor[1], g.judged[1]) for g in gains]
    if rows[0][1] < MANY:
        return bars([(n, v, f"{v:.2f} x") for n, v, _ in rows], title, mark=(1.0, "the sensors' noise"))
    return bars([(n, v, errors.sized("deg", DEG).replace(" and ", ", ")) for n, v, errors in rows], title)


def over_speed(source: ParameterSource, name: str, unit: str) -> str | None:
    """Return a parameter's points over speed with 95 % errors, and its law with its band where two speeds allow one."""
    points = [p for p in source.points if name in p.values]
    if not points:
        return None
    speeds = np.array([p.speed for p in points])
    values = np.array([p.values[name] for p in points])
    errors = np.array([TWO_SIDED_95 * p.std_errors.get(name, 0.0) for p in points])
    dots = Series(speeds, values, "measured", name, "points", errors)
    if source.laws is None or name not in source.laws.by_name or np.ptp(speeds) == 0:
        margin = np.array([speeds.min() * 0.9, speeds.max() * 1.1])
        return chart(
            [Panel(f"{name}, {unit}", (dots, Series(margin, np.full(2, np.nan), "quiet")), height=130)], "speed, m/s", name
        )
    law = source.laws.by_name[name]
    x = np.linspace(0.92 * speeds.min(), 1.08 * speeds.max(), 60)
    y, (low, high) = law.at(x), law.line.band(x)
    ends = np.sort(np.stack([law.sign * low, law.sign * high]), axis=0)
    series = (Series(x, y, "simulated", f"law: {law.chosen.replace('_', ' ')}"), dots)
    panel = Panel(f"{name}, {unit}", series, (Band(x, ends[0], ends[1], "simulated"),), height=130)
    return chart([panel], "speed, m/s", f"{name} over speed")


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


def gains(body: Mapping[str, Any]) -> str:
    """Return the gains of a schedule and its phase margin over speed, and the margin that was asked for."""
    rows = body["rows"]
    x = np.array([r["speed_m_s"] for r in rows], dtype=float)
    panels = []
    for name, unit in (("kp", "rad/rad"), ("ki", "1/s"), ("kd", "s")):
        y = np.array([r[name] for r in rows], dtype=float)
        if np.any(y != 0):
            panels.append(Panel(f"{name}, {unit}", (Series(x, y, "simulated", name), Series(x, y, "simulated", name, "points"))))
    phase = np.array([r["phase_margin_deg"] if r["phase_margin_deg"] is not None else np.nan for r in rows], dtype=float)
    wanted = np.full(x.size, float(body["phase_margin_wanted_deg"]))
    margin = (Series(x, phase, "second", "phase margin"), Series(x, phase, "second", "phase margin", "points"))
    asked = Series(x, wanted, "quiet", "asked for")
    panels.append(Panel("phase margin, deg (line: asked for)", (asked, *margin), height=100, from_zero=True))
    return chart(panels, "speed, m/s", "gains and phase margin over speed")


def parameters_of(axis: str) -> list[tuple[str, str]]:
    """Return the base parameters of an axis with their units."""
    names = next(n for a, n in NAMES.items() if a.value == axis)
    units = {names.damping: "1/s", names.authority: "1/s²", names.trim: "rad/s²", names.stiffness: "1/s²"}
    return [(n, units[n]) for n in names.base]
