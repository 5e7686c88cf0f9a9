"""The circle of a measured run: its settled part, the robust circle through it, and the fin and speed it was flown with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from fieldsid.display import Plotted
from fieldsid.errors import DataError
from fieldsid.logs.convert.conditioning import blocks_of
from fieldsid.logs.run import Run
from fieldsid.models.record import knows_speed
from fieldsid.numerics.arrays import BoolArray, FloatArray
from fieldsid.records.keys import INLINE, Key, Number, Side
from fieldsid.settled import settled_band
from fieldsid.turning.measured.circle import LEAST_TURN_FOR_CURRENT_RAD, Circle, fit_circle

TURNING_SHARE = 0.5
SMOOTH_S = 2.0
APPROACH_S = 5.0
LEAST_TURN_RAD_S = 0.005
"""Yaw rate below which a run has no turn: a ship turns with a third of a degree a second."""


@dataclass(frozen=True, slots=True, repr=False)
class MeasuredTurn(Plotted):
    """A measured circle: side, fin flown (rad, signed), entry and path speed (m/s, NaN where unknown), settled span (s).

    `track` is x and y (m) of the whole run, `settled` those of the settled part with the current taken out.
    """

    run: Annotated[str, Key("The run.")]
    side: Annotated[str, Key("The side.", of=Side)]
    circle: Annotated[Circle, INLINE]
    fin: Annotated[Number, Key("The fin it was flown with.", "fin_rad")]
    entry_speed: Annotated[Number, Key("Speed before the turn.", "entry_speed_m_s")]
    path_speed: Annotated[Number, Key("Speed along the circle.", "path_speed_m_s")]
    start_s: Annotated[float, Key("Start of the settled part.", "settled_from_s")]
    end_s: Annotated[float, Key("End of it.", "settled_to_s")]
    track: tuple[FloatArray, FloatArray]
    settled: tuple[FloatArray, FloatArray]

    @property
    def flown_at(self) -> float:
        """The entry speed of the turn (m/s), or the path speed where that is unknown."""
        return self.entry_speed if np.isfinite(self.entry_speed) else self.path_speed


def measure_turn(run: Run) -> MeasuredTurn:
    """Fit the circle of a run's settled turn, found in the yaw rate.

    Raises DataError when positions or heading are missing, when there is no turn, or it is too short an arc.
    """
    _need_positions(run)
    raw = _yaw_rate(run)
    rate = _smooth(run.time, raw, SMOOTH_S)
    first, last = _settled(run, rate)
    span = slice(first, last)
    circle = fit_circle(run.time[span], run["x_m"][span], run["y_m"][span], _heading(run, raw)[span])
    turn_start = _turn_start(rate, first)
    since = run.time[span] - run.time[first]
    return MeasuredTurn(
        run=run.name,
        side="starboard" if float(np.median(rate[span])) > 0 else "port",
        circle=circle,
        fin=_fin(run, span),
        entry_speed=_entry_speed(run, turn_start),
        path_speed=circle.radius * float(np.median(np.abs(rate[span]))),
        start_s=float(run.time[first]),
        end_s=float(run.time[last - 1]),
        track=(run["x_m"], run["y_m"]),
        settled=(run["x_m"][span] - circle.current[0] * since, run["y_m"][span] - circle.current[1] * since),
    )


def is_circle(run: Run) -> bool:
    """Whether a run contains a settled circle of LEAST_TURN_FOR_CURRENT_RAD or more."""
    try:
        return measure_turn(run).circle.turned >= LEAST_TURN_FOR_CURRENT_RAD
    except DataError:  # no positions, no turn, or too short an arc
        return False


def _need_positions(run: Run) -> None:
    missing = [n for n in ("x_m", "y_m") if not run.has(n)]
    if missing:
        raise DataError(
            f"run {run.name!r} has no position, so no circle can be fitted",
            found=", ".join(k for k in run.signals if run.has(k)) or "no signals",
            hint=f"map {' and '.join(missing)} on import, where the log has them",
        )


def _yaw_rate(run: Run) -> FloatArray:
    """Return the yaw rate (n,): measured, or the derivative of the heading."""
    for name in ("yaw_rate_rad_s", "yaw_rad"):
        if run.has(name):
            ok = np.isfinite(run[name])
            values = np.unwrap(run[name][ok]) if name == "yaw_rad" else run[name][ok]
            full = np.interp(run.time, run.time[ok], values)
            return np.asarray(np.gradient(full, run.time)) if name == "yaw_rad" else full
    raise DataError(f"run {run.name!r} has neither heading nor yaw rate", found="positions only", hint="map `yaw_rad` on import")


def _heading(run: Run, rate: FloatArray) -> FloatArray:
    """Return the unwrapped heading (n,), or the integral of the rate if it was not measured."""
    if run.has("yaw_rad"):
        ok = np.isfinite(run["yaw_rad"])
        return np.asarray(np.interp(run.time, run.time[ok], np.unwrap(run["yaw_rad"][ok])))
    steps = np.diff(run.time, prepend=run.time[0])
    return np.asarray(np.cumsum(rate * steps))


def _settled(run: Run, rate: FloatArray) -> tuple[int, int]:
    """Return first and last sample of the settled part of the longest turn: rate within 5 % of that of its second half."""
    peak = float(np.percentile(np.abs(rate), 95))
    if peak < LEAST_TURN_RAD_S:
        raise DataError(
            f"run {run.name!r} does not turn", found=f"yaw rate up to {peak:.4f} rad/s", hint="give the run of a turning circle"
        )
    first, last = _longest(np.abs(rate) > TURNING_SHARE * peak)
    middle = (first + last) // 2
    level = float(np.median(rate[middle:last]))
    allowed = settled_band(level, 3.0 * float(np.std(rate[middle:last])))
    off = np.flatnonzero(np.abs(rate[first:last] - level) > allowed)
    early = off[off < middle - first]
    late = off[off >= middle - first]
    start = first + (int(early[-1]) + 1 if early.size else 0)
    end = first + (int(late[0]) if late.size else last - first)
    return start, max(end, start + 2)


def _longest(mask: BoolArray) -> tuple[int, int]:
    starts, ends = blocks_of(mask)
    best = int(np.argmax(ends - starts))
    return int(starts[best]), int(ends[best])


def _turn_start(rate: FloatArray, first: int) -> int:
    """Return the sample before the turn where the rate was last small."""
    level = 0.1 * abs(float(rate[first]))
    calm = np.flatnonzero(np.abs(rate[:first]) < level)
    return int(calm[-1]) if calm.size else 0


def _fin(run: Run, span: slice) -> float:
    for name in ("rudder_measured_rad", "rudder_rad"):
        if run.has(name):
            return float(np.nanmedian(run[name][span]))
    return float("nan")


def _entry_speed(run: Run, turn_start: int) -> float:
    """Return the speed before the turn: the measured surge, else the speed over ground, NaN where the log starts in the turn."""
    since = float(run.time[turn_start]) - APPROACH_S
    span = slice(int(np.searchsorted(run.time, since)), turn_start + 1)
    if turn_start < 10:
        return float("nan")
    if knows_speed(run):
        return float(np.nanmedian(run["surge_m_s"][span]))
    x, y, t = run["x_m"][span], run["y_m"][span], run.time[span]
    ok = np.isfinite(x) & np.isfinite(y)
    return float(np.hypot(np.polyfit(t[ok], x[ok], 1)[0], np.polyfit(t[ok], y[ok], 1)[0])) if ok.sum() > 5 else float("nan")


def _smooth(time: FloatArray, values: FloatArray, width_s: float) -> FloatArray:
    half = max(1, round(0.5 * width_s / float(np.median(np.diff(time)))))
    kernel = np.ones(2 * half + 1) / (2 * half + 1)
    padded = np.concatenate([np.full(half, values[0]), values, np.full(half, values[-1])])
    return np.convolve(padded, kernel, mode="valid")
