"""Find fill values of a compass at an end of the heading's range, 0 or 360 deg, and distinguish them from true headings.

A true heading that reaches an end of its range continues at the other end: modulo one turn it does not jump. A fill value makes
the heading jump to the same number and back again and again, while the samples between the fills, taken alone, form a
continuous heading. This does not hold for a heading that stays near its wrap and was interpolated the long way round
(`heading_unwrap.py`): the samples between its visits of the end do not continue one another.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fieldsid.logs.convert.clock import Track
from fieldsid.logs.convert.conditioning import blocks_of
from fieldsid.logs.convert.faults.dropouts import FEWEST, SENSED
from fieldsid.logs.convert.heading_unwrap import FASTEST_RAD_S, MIN_JUMP_RAD, NOISES, noise_of_steps, within_half_turn
from fieldsid.logs.few_of import FEW, MOSTLY
from fieldsid.logs.run import Note
from fieldsid.numerics.arrays import BoolArray, FloatArray

END_RAD = 1e-6
"""Largest distance of a fill value from a multiple of a right angle; every frame turns an end of the range into one."""
GOES_ON = 0.8
"""Smallest share of the jumps across which the other samples must form a continuous heading."""


def without_fills(heading: Track) -> tuple[Track, list[Note]]:
    """Return a heading (n,) in rad with fill values at the ends of its range missing, and notes that say so."""
    values, notes = heading.values, list[Note]()
    seen = np.flatnonzero(np.isfinite(values))
    if seen.size <= 2 * FEWEST:
        return heading, notes
    for end in sorted({float(values[seen].min()), float(values[seen].max())}):
        if abs(math.remainder(end, 0.5 * math.pi)) > END_RAD:
            continue
        fills = seen[_fills(heading.time[seen], values[seen], end)]
        if fills.size:
            values = values.copy()
            values[fills] = np.nan
            seen = np.flatnonzero(np.isfinite(values))
            notes.append(_note(end, fills.size, values.size))
    return Track(heading.time, values, heading.label), notes


def without_standing_start(tracks: Mapping[str, Track]) -> tuple[dict[str, Track], list[Note]]:
    """Return tracks without the samples before the compass was ready, and the note that says so.

    Until then the heading stands at an end of its range, from which it jumps; other sensors that are exactly zero as long are not
    ready either.
    """
    ready_s = _ready_s(tracks["yaw_rad"])
    early = {s: t.time < ready_s for s, t in tracks.items() if s in SENSED}
    out = {s: e for s, e in early.items() if e.any() and (s == "yaw_rad" or not tracks[s].values[e].any())}
    changed = {s: replace(t, values=np.where(out[s], np.nan, t.values)) for s, t in tracks.items() if s in out}
    if not changed:
        return dict(tracks), []
    number, count = float(tracks["yaw_rad"].values[out["yaw_rad"]][0]), int(out["yaw_rad"].sum())
    message = (
        f"{', '.join(out)}: the heading stands at exactly {number:.6g} until {ready_s:.2f} s and jumps then: its compass was not "
        f"ready before, and the first {count} samples are missing now"
    )
    data = {"signal": "yaw_rad", "value": count, "limit": FEWEST, "number": number, "samples": count}
    return {**tracks, **changed}, [Note("dropouts", message, data)]


def _ready_s(heading: Track) -> float:
    """Return the time in s of the first jump of a heading (n,) that stands at an end of its range until then; else -inf."""
    seen = np.isfinite(heading.values)
    time, values = heading.time[seen], heading.values[seen]
    first = int(np.argmax(values != values[0])) if values.size else 0
    if first < FEWEST or abs(math.remainder(float(values[0]), 0.5 * math.pi)) > END_RAD:
        return -math.inf
    limit = MIN_JUMP_RAD + FASTEST_RAD_S * float(time[first] - time[first - 1])
    jump = abs(math.remainder(float(values[first] - values[0]), math.tau))
    return float(time[first]) if jump > limit else -math.inf


def _note(end: float, count: int, of: int) -> Note:
    message = (
        f"yaw_rad jumps to exactly {end:.6g} and back, an end of its range: {count} of {of} samples, taken as what is written "
        "where a compass has nothing (now missing)"
    )
    return Note("dropouts", message, {"signal": "yaw_rad", "value": count, "limit": FEWEST, "number": end, "samples": count})


@np.errstate(over="ignore", invalid="ignore")
def _fills(time: FloatArray, values: FloatArray, end: float) -> BoolArray:
    """Return a mask (n,) of the samples that are fill values at an end of the range.

    Where they are most of the samples the vehicle is on that heading. Its fastest motion is 1.5 times that of all but FEW steps.
    """
    at_end: BoolArray = np.asarray(values == end)
    begins, stops = blocks_of(at_end)
    inside = (begins > 0) & (stops < values.size)
    before, after = begins[inside] - 1, stops[inside]
    others = ~at_end
    none = np.zeros(values.size, dtype=np.bool_)
    if others.sum() < 3 or before.size < FEWEST or at_end[before[0] : after[-1]].mean() > MOSTLY:
        return none
    steps, dt = within_half_turn(np.diff(values[others])), np.diff(time[others])
    least = max(MIN_JUMP_RAD, NOISES * math.sqrt(2.0) * noise_of_steps(steps))
    jumped = (np.abs(within_half_turn(values[before] - end)) > least + FASTEST_RAD_S * (time[before + 1] - time[before])) & (
        np.abs(within_half_turn(values[after] - end)) > least + FASTEST_RAD_S * (time[after] - time[after - 1])
    )
    fastest = 1.5 * float(np.quantile(np.abs(steps) / dt, 1.0 - FEW))
    across = np.abs(within_half_turn(values[after] - values[before])) <= least + fastest * (time[after] - time[before])
    if jumped.sum() < FEWEST or across[jumped].mean() < GOES_ON:
        return none
    return at_end
