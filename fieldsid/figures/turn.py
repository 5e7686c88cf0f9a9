"""Turning: radius and u-turn time over speed with bands and measured points, and a track with its circle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from fieldsid.figures.panel import Band, Panel, Picture, Series
from fieldsid.numerics.arrays import FloatArray
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
    speeds = np.array([r["speed_m_s"] for r in body["rows"]], dtype=float)
    span = float(np.mean(speeds)) * np.array([1.0 - LEAST_HALF_SPAN, 1.0 + LEAST_HALF_SPAN])
    ends = Series(span, np.full(2, np.nan), "quiet")
    radius, bands = _sides(body, ("predicted_m", "predicted95"), ("radius_m", "interval95"), ", predicted")
    time, time_bands = _sides(body, ("u_turn_time_s", "u_turn_time95_s"), ("u_turn_time_s", ""), "")
    circles = [
        Series(
            np.array([c.get("entry_speed_m_s") or c.get("path_speed_m_s") for c in of_side], dtype=float),
            np.array([c["radius_m"] for c in of_side], dtype=float),
            side,
            f"measured circle, {side}, {_fins(of_side)} of rudder",
            "rings",
            TWO_SIDED_95 * np.array([c["std_error_m"] for c in of_side], dtype=float),
        )
        for side in SIDES
        if (of_side := [c for c in body.get("measured", ()) if c["side"] == side])
    ]
    x = "speed before the turn, m/s"
    above = Panel("radius, m", (ends, *radius, *circles), bands, 190, from_zero=True)
    return above, Panel("time to turn 180°, s", (ends, *time), time_bands, 120, from_zero=True, x=x)


def _fins(circles: Sequence[Mapping[str, Any]]) -> str:
    """Return the fin angles that circles were flown with."""
    return ", ".join(sorted({f"{np.degrees(abs(c['fin_rad'])):.0f}°" for c in circles}))


def _sides(
    body: Mapping[str, Any], keys: tuple[str, str], otherwise: tuple[str, str], of: str
) -> tuple[list[Series], list[Band]]:
    """Return a value of each side over speed with its band, by its keys, or by other ones where a row lacks it.

    At few speeds the band is drawn as error bars.
    """
    series, bands = [], []
    for side, sign in SIDES.items():
        rows = sorted((r for r in body["rows"] if r["side"] == side), key=lambda r: float(r["speed_m_s"]))
        if not rows:
            continue

        def column(key: str, other: str, i: int | None = None, rows: list[Any] = rows) -> FloatArray:
            found = [r.get(key) or r.get(other) for r in rows]
            return np.array([v if i is None or v is None else v[i] for v in found], dtype=float)

        x, y = column("speed_m_s", ""), column(keys[0], otherwise[0])
        low, high = (column(keys[1], otherwise[1], i) for i in (0, 1))
        few = len(rows) <= FEW
        x = x * (1.0 + SHIFT * sign) if few else x
        error = np.maximum(np.stack([y - low, high - y]), 0.0)
        series.append(Series(x, y, side, f"{side}{of}", dashed=not few and side == "starboard"))
        series += [Series(x, y, side, form="points", error=np.nan_to_num(error))] if few else []
        bands += [] if few else [Band(x, low, high, side)]
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
