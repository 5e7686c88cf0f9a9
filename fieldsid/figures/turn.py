"""Turning: radius and u-turn time over speed with bands and measured points, and a track with its circle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from fieldsid.figures.panel import Band, Panel, Picture, Series
from fieldsid.records.keys import body_of
from fieldsid.rounding import TWO_SIDED_95
from fieldsid.turning.measured.measured_turn import MeasuredTurn
from fieldsid.turning.prediction import SIDES, TurnPrediction

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHIFT = 0.004
"""Shift of a side where there are few speeds, as a share of the speed, so that the error bars of the sides do not overlap."""
FEW = 12
LEAST_HALF_SPAN = 0.1
"""Smallest half width of the speed axis, as a share of the speed: at a single speed the shift is not to look like another one."""


def figure(prediction: TurnPrediction) -> Picture:
    """Return radius and u-turn time over the entry speed, one above the other."""
    title = f"{_tightest(prediction)}\n{_band(prediction)}"
    return Picture(title, (9.0, 7.5), (panels(body_of(prediction)),))


def panels(body: Mapping[str, Any]) -> tuple[Panel, Panel]:
    """Return the radius of both sides with its bands and the measured circles, and the time of a u-turn, of the JSON of turns."""
    rows = [{"predicted_m": r["radius_m"], "predicted95": r["interval95"], **r} for r in body["rows"]]
    middle = float(np.mean([r["speed_m_s"] for r in rows]))
    ends = Series(np.array([(1.0 - LEAST_HALF_SPAN) * middle, (1.0 + LEAST_HALF_SPAN) * middle]), np.full(2, np.nan), "quiet")
    radius, bands = _sides(rows, "predicted_m", "predicted95")
    time, time_bands = _sides(rows, "u_turn_time_s", "u_turn_time95_s")
    for side in SIDES:
        if circles := [c for c in body.get("measured", ()) if c["side"] == side]:
            speed = np.array([c.get("entry_speed_m_s") or c.get("path_speed_m_s") for c in circles], dtype=float)
            size, error = (np.array([c[k] for c in circles], dtype=float) for k in ("radius_m", "std_error_m"))
            name = f"measured circle, {side}, {_fins(circles)} of rudder"
            radius.append(Series(speed, size, side, name, "rings", TWO_SIDED_95 * error))
    above = Panel("radius, m", (ends, *radius), bands, 190, from_zero=True)
    x = "speed before the turn, m/s"
    return above, Panel("time to turn 180°, s", (ends, *time), time_bands, 120, from_zero=True, x=x)


def _fins(circles: Sequence[Mapping[str, Any]]) -> str:
    """Return the fin angles that circles were flown with."""
    return ", ".join(sorted({f"{np.degrees(abs(c['fin_rad'])):.0f}°" for c in circles if c["fin_rad"] is not None}))


def _sides(rows: Sequence[Mapping[str, Any]], value: str, band: str) -> tuple[list[Series], list[Band]]:
    """Return a value of each side over speed with its band, by their keys; at few speeds the band is drawn as error bars."""
    series, bands = [], []
    for side, sign in SIDES.items():
        mine = sorted((r for r in rows if r["side"] == side), key=lambda r: float(r["speed_m_s"]))
        if not mine:
            continue
        x, y = (np.array([r.get(k) for r in mine], dtype=float) for k in ("speed_m_s", value))
        low, high = np.array([r.get(band) or (np.nan, np.nan) for r in mine], dtype=float).T
        if len(mine) > FEW:
            series.append(Series(x, y, side, f"{side}, predicted", dashed=side == "starboard"))
            bands.append(Band(x, low, high, side))
            continue
        x, error = x * (1.0 + SHIFT * sign), np.nan_to_num(np.maximum(np.stack([y - low, high - y]), 0.0))
        series += [Series(x, y, side, f"{side}, predicted"), Series(x, y, side, form="points", error=error)]
    return series, bands


def _tightest(prediction: TurnPrediction) -> str:
    row = min(prediction.rows, key=lambda r: r.radius)
    rudder = f"{np.degrees(prediction.rudder_max):.0f}° of rudder"
    radius = f"{row.radius:.2f} m" if not row.band_only else "between {:.2f} and {:.2f} m".format(*row.interval95)
    return f"with {rudder} the tightest turn is {radius} to {row.side} at {row.speed:.2f} m/s, {row.trust}"


def _band(prediction: TurnPrediction) -> str:
    """Return the meaning of the bars or bands in words."""
    drawn = "bars" if len({r.speed for r in prediction.rows}) <= FEW else "bands"
    trust = {r.trust for r in prediction.rows}
    wider = ", with the error of the model's form where nothing was measured" if trust != {"measured"} else ""
    return f"{drawn}: 95 % of what the runs allow{wider}"


def track_figure(turn: MeasuredTurn) -> Picture:
    """Return the track of a measured turn with its circle, and the distance of the settled part to it."""
    title = f"{turn.run}: {turn.side} at {turn.flown_at:.2f} m/s, radius {turn.circle.radius:.2f} m"
    time = np.linspace(turn.start_s, turn.end_s, turn.circle.residual.size)
    off = Series(time, turn.circle.residual, "measured", form="dots"), Series(time, 0.0 * time, "simulated")
    return Picture(title, (7.5, 8.0), ((partial(draw_track, turn), Panel("off the circle, m", off, height=50, x="time, s")),))


def draw_track(turn: MeasuredTurn, ax: Axes) -> None:
    """Draw x north up against y east right: whole track, settled part with the current taken out, fitted circle."""
    from fieldsid.figures import canvas

    x, y = turn.track
    circle = turn.circle
    ax.plot(y, x, color=canvas.QUIET, linewidth=1.0, label="track")
    sx, sy = turn.settled
    removed = ", current removed" if any(circle.current) else ""
    ax.plot(sy, sx, ".", markersize=2.5, color="0.35", label=f"settled part{removed}")
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    north, east = circle.centre
    speed = float(np.hypot(*circle.current))
    ax.plot(
        east + circle.radius * np.sin(angle), north + circle.radius * np.cos(angle), color=canvas.SIMULATED, linewidth=1.6,
        label=f"circle R = {circle.radius:.3f} ± {circle.radius_std_error:.3f} m in a current of {speed:.3f} m/s",
    )  # fmt: skip
    ax.plot([east], [north], "+", color=canvas.SIMULATED, markersize=10)
    canvas.dress(ax, x="east y, m", y="north x, m")
    ax.set_aspect("equal", adjustable="box")
    reach = 2.2 * circle.radius
    ax.set_xlim(east - reach, east + reach)
    ax.set_ylim(north - reach, north + reach)
