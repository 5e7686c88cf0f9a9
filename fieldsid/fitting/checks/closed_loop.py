"""Whether a controller moves the fin: a regression of its changes on the changes of angle and rate a delay earlier.

    fin(t) - fin(t - W) = k_angle [angle(t - d) - angle(t - d - W)] + k_rate [rate(t - d) - rate(t - d - W)]
Changes are used so that a constant goal heading does not matter. The few largest changes, where the goal moves, are left out, and
so are changes that start or end with the fin at its stop. Where the log has the goal, the angle is its deviation from the goal,
the short way round, and no change is left out; a goal that moves excites the vehicle, and the run is not refused. Under feedback
the fin follows noise and disturbance, and an estimate may mistake the controller for the vehicle.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fieldsid.errors import DataError
from fieldsid.logs.convert.faults.spikes import last_digit
from fieldsid.logs.run import Note
from fieldsid.models.axis import NAMES
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.white_noise import white_noise_std

SMOOTHING_WINDOW_S = 0.3
MAX_DELAY_S = 1.0
MIN_EXPLAINED_SHARE = 0.9
TRIMMED_SHARE = 0.05
MAX_NOISE_SHARE = 0.5
"""Share of the least residual variance under independent sensor noise, below which the fin follows the sensor noise."""
MIN_MOVING_SHARE = 0.5
"""Share of the record over which the fin must move for the regression: a controller that has reached its goal is at rest."""


def closed_loop_note(record: Record) -> Iterator[Note]:
    """Yield the finding that a controller moves the fin, with its gains and delay."""
    best = controller(record)
    if best is None or best[0] < MIN_EXPLAINED_SHARE:
        return
    share, gain, damping, delay = best
    yield Note(
        "feedback",
        f"run {record.name!r}: {100 * share:.0f} % of the fin's changes follow {_tracked(record)} {delay:.2f} s before (limit "
        f"{100 * MIN_EXPLAINED_SHARE:.0f} %), {gain:+.2f} rad per rad and {damping:+.2f} rad per rad/s: a controller flies the "
        "fin; "
        "fly pulses on top of it, or with it off",
        {
            "value": share,
            "limit": MIN_EXPLAINED_SHARE,
            "gain": gain,
            "rate_gain_s": damping,
            "delay_s": delay,
            "run": record.name,
        },
    )


def controller(record: Record) -> tuple[float, float, float, float] | None:
    """Return the share explained, gains on angle and rate (s), and delay (s) of the best controller; None where none fits."""
    best = (
        _best_controller(record, record.angle, TRIMMED_SHARE, MIN_MOVING_SHARE)
        if record.goal is None
        else _best_controller(record, _deviation_from_goal(record), 0.0, 0.0)
    )
    return None if best is None else (best[0].share, *best[0].gains, best[1])


def refuse_feedback_alone(records: Sequence[Record]) -> None:
    """Raise DataError where in every run of a joint fit the fin is feedback of the logged angle and rate and nothing else.

    There are two conditions, both on all changes of the fin. First, at least MIN_EXPLAINED_SHARE of the changes is explained.
    Second, the residual variance, less that of the fin's rounding, is smaller than sensor noise would leave if the fin did not
    follow the noise: a fin y regressed on x + n with gain k, n independent of y, has a residual variance of at least k^2 var n.
    Slow open-loop motion that happens to resemble the fin meets the first condition but not the second.
    """
    errors = [_feedback_alone(record) for record in records]
    alone = [error for error in errors if error is not None]
    if alone and len(alone) == len(errors):
        raise alone[0]


def _feedback_alone(record: Record) -> DataError | None:
    best = _best_controller(record, record.angle, 0.0, MIN_MOVING_SHARE)
    if best is None or best[0].share < MIN_EXPLAINED_SHARE or not best[0].residual < MAX_NOISE_SHARE * best[0].noise:
        return None
    found, delay = best
    names = NAMES[record.axis]
    return DataError(
        f"run {record.name!r} does not identify {record.axis.value}: its fin is feedback of `{names.angle}`",
        found=f"{100 * found.share:.0f} % of the fin's changes follow it {delay:.2f} s before, with the sensor's noise "
        f"({found.gains[0]:+.2f} rad per rad, {found.gains[1]:+.2f} rad per rad/s)",
        hint="fly pulses on top of the controller, or with it off",
    )


def _tracked(record: Record) -> str:
    """Return the input of a record's controller in words."""
    names = NAMES[record.axis]
    return f"`{names.angle}`" if record.goal is None else f"`{names.angle}` less `{names.goal}`"


def _deviation_from_goal(record: Record) -> FloatArray:
    """Return the angle (n,) in rad; where the log has a goal, the deviation from it, the short way round."""
    if record.goal is None:
        return record.angle
    off = record.angle - record.goal
    # unwrapped, as the deviation jumps by a full turn where the vehicle passes the heading opposite to the goal
    return np.unwrap(np.asarray(off - 2.0 * np.pi * np.round(off / (2.0 * np.pi))))


def _best_controller(record: Record, angle: FloatArray, trimmed: float, moving: float) -> tuple[_Regression, float] | None:
    """Return the best controller of an angle (n,) in rad with its delay in s; None where the regression is not possible."""
    if not record.angle_ok.all() or (record.rate_ok.any() and not record.rate_ok.all()):
        return None
    step = float(np.median(record.steps))
    width = max(1, round(SMOOTHING_WINDOW_S / step))
    longest = min(round(MAX_DELAY_S / step), len(record) // 4)
    moved = record.fin[width:] - record.fin[:-width]
    if moved.size <= longest:
        return None
    if np.mean(np.abs(moved) > 1e-3 * max(float(np.ptp(record.fin)), 1e-9)) < moving:
        return None
    tried = [(_regression(record, angle, moved, width, lag, longest, trimmed), lag * step) for lag in range(longest + 1)]
    return max(tried, key=lambda one: one[0].share)


@dataclass(frozen=True, slots=True)
class _Regression:
    """Share of the fin's changes explained, gains on angle and rate (s), residual variance, and least one under sensor noise."""

    share: float
    gains: tuple[float, float]
    residual: float
    noise: float


def _regression(
    record: Record, angle: FloatArray, moved: FloatArray, width: int, lag: int, longest: int, trimmed: float
) -> _Regression:
    """Return the regression of the fin's changes on the motion `lag` samples earlier, without the share `trimmed` of largest."""
    target = moved[longest:]
    step = float(np.median(record.steps))
    measured = bool(record.rate_ok.any())
    # a controller without a rate sensor takes differences of the angle
    rate = record.rate if measured else np.diff(record.angle, prepend=record.angle[0]) / step
    columns = np.column_stack([(v[width:] - v[:-width])[longest - lag : moved.size - lag] for v in (angle, rate)])
    free = (record.fin > record.fin.min()) & (record.fin < record.fin.max())
    free = (free[width:] & free[:-width])[longest:]
    if free.sum() < MIN_MOVING_SHARE * free.size or not (np.isfinite(columns).all() and np.isfinite(target).all()):
        return _Regression(0.0, (0.0, 0.0), 0.0, 0.0)
    keep = free & (np.abs(target) <= np.quantile(np.abs(target[free]), 1.0 - trimmed))
    gains = np.linalg.lstsq(columns[keep], target[keep], rcond=1e-9)[0]
    residual = target[keep] - columns[keep] @ gains
    power = float(target[keep] @ target[keep])
    on_angle, on_rate = float(gains[0]), float(gains[1])
    angle_variance = white_noise_std(record.angle, record.angle_ok) ** 2
    if measured:
        noise = on_angle**2 * angle_variance + on_rate**2 * white_noise_std(record.rate, record.rate_ok) ** 2
    else:
        noise = ((on_angle + on_rate / step) ** 2 + (on_rate / step) ** 2) * angle_variance
    return _Regression(
        1.0 - float(residual @ residual) / power if power > 0.0 else 0.0,
        (on_angle, on_rate),
        max(float(np.mean(residual**2)) - last_digit(record.fin) ** 2 / 6.0, 0.0),
        2.0 * noise,
    )
