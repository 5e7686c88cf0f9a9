"""Is the fin flown by a controller? Its changes explained by changes of angle and rate a delay before.

    fin(t) - fin(t - W) = k_angle [angle(t - d) - angle(t - d - W)] + k_rate [rate(t - d) - rate(t - d - W)]
Changes, so that a commanded heading that stays does not matter; the few largest, where it moves, are left out, and so is
what starts or ends where the fin is at its stop, where no controller moves it. Under feedback the fin follows noise and
disturbance, and an estimate without it can mistake the controller for the vehicle.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldsid.logs.run import Note
from fieldsid.models.axis import NAMES
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray

SMOOTHING_WINDOW_S = 0.3
MAX_DELAY_S = 1.0
MIN_EXPLAINED_SHARE = 0.9
TRIMMED_SHARE = 0.05
MIN_MOVING_SHARE = 0.5
"""Share of the record over which the fin must move for a controller to be looked for."""


def closed_loop_note(record: Record) -> Iterator[Note]:
    """Yield the finding that the angle explains the fin, with gain and delay."""
    best = controller(record)
    if best is None or best[0] < MIN_EXPLAINED_SHARE:
        return
    share, gain, damping, delay = best
    names = NAMES[record.axis]
    yield Note(
        "feedback",
        f"run {record.name!r}: {100 * share:.0f} % of the fin's changes follow {names.angle} {delay:.2f} s before (limit "
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
    """Return the share explained, gains on angle and rate (s) and delay (s) of the best controller; None where none can be."""
    if not (record.angle_ok.all() and record.rate_ok.all()):
        return None
    step = float(np.median(record.steps))
    width = max(1, round(SMOOTHING_WINDOW_S / step))
    longest = min(round(MAX_DELAY_S / step), len(record) // 4)
    moved = record.fin[width:] - record.fin[:-width]
    if np.mean(np.abs(moved) > 1e-3 * max(float(np.ptp(record.fin)), 1e-9)) < MIN_MOVING_SHARE:
        return None
    best: tuple[float, float, float, float] | None = None
    for lag in range(longest + 1):
        found = _explained(record, moved, width, lag, longest)
        if best is None or found[0] > best[0]:
            best = (*found, lag * step)
    return best


def _explained(record: Record, moved: FloatArray, width: int, lag: int, longest: int) -> tuple[float, float, float]:
    """Return the share of the fin's changes explained at one lag, robustly, and both gains."""
    target = moved[longest:]
    columns = np.column_stack([(v[width:] - v[:-width])[longest - lag : moved.size - lag] for v in (record.angle, record.rate)])
    free = (record.fin > record.fin.min()) & (record.fin < record.fin.max())
    free = (free[width:] & free[:-width])[longest:]
    if free.sum() < MIN_MOVING_SHARE * free.size:
        return 0.0, 0.0, 0.0
    keep = free & (np.abs(target) <= np.quantile(np.abs(target[free]), 1.0 - TRIMMED_SHARE))
    gains = np.linalg.lstsq(columns[keep], target[keep], rcond=1e-9)[0]
    left = target[keep] - columns[keep] @ gains
    power = float(target[keep] @ target[keep])
    return (1.0 - float(left @ left) / power if power > 0.0 else 0.0), float(gains[0]), float(gains[1])
