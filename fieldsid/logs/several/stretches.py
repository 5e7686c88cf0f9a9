"""The stretches of a log in which the vehicle is under way, and not on deck, adrift, at the surface or idle.

Parts of some length are left out in which the motor is off and the speed is low, in which the vehicle is at the surface in a log
with dives, in which no angle, rate or fin changes at the start or end of the log, or which have no samples. A vehicle that moves
with its motor off, such as a glider, is under way.
"""

from __future__ import annotations

import numpy as np

from fieldsid.logs.convert.conditioning import MAIN, blocks_of
from fieldsid.logs.convert.times.clock_text import FEW_STEPS
from fieldsid.logs.doctor.pair_findings import SLOWEST
from fieldsid.logs.few_of import few_of
from fieldsid.logs.run import MOTORS, Note, Run
from fieldsid.numerics.arrays import BoolArray, FloatArray

OFF_S = 10.0
"""Shortest duration of a part that is left out, and half of that of a stretch."""
IDLE = 0.15
"""Share of the usual speed below which the vehicle counts as stopped."""
DIVES_M, DIVES = 1.0, 0.2
"""Depth in m, and smallest share of the samples below it, in a log with dives."""
SURFACE_M = 0.3


Part = tuple[float, float]
"""Start and end of a stretch in s, as `load_run` takes them."""


def stretches_of(run: Run) -> tuple[tuple[Part, ...], tuple[Note, ...]]:
    """Return the stretches of a run under way, and notes on the parts left out; the complete run where nothing is left out."""
    whole = ((float(run.time[0]), float(run.time[-1])),)
    reasons = {
        "no way is made": _idle(run),
        "at the surface": _surfaced(run),
        "nothing changes": _constant_ends(run),
    }
    off = {why: _lasting_blocks(run.time, mask) for why, mask in reasons.items()}
    away = np.any(np.stack(list(off.values())), axis=0)
    breaks = np.flatnonzero((np.diff(run.time) > max(OFF_S, FEW_STEPS * float(np.median(np.diff(run.time))))) | np.diff(away)) + 1
    parts = [p for p in np.split(np.arange(run.time.size), breaks) if not away[p[0]]]
    found = ((float(run.time[p[0]]), float(run.time[p[-1]])) for p in parts)
    kept = tuple((start, end) for start, end in found if end - start >= 2.0 * OFF_S)
    if not kept or kept == whole:
        return whole, ()
    return kept, (_note(run, kept, off),)


def _note(run: Run, kept: tuple[Part, ...], off: dict[str, BoolArray]) -> Note:
    whys = [f"{why} ({_duration_s(run.time, mask):.0f} s)" for why, mask in off.items() if mask.any()]
    shown = few_of([f"{start:.2f} .. {end:.2f} s" for start, end in kept])
    left = float(run.time[-1] - run.time[0]) - sum(end - start for start, end in kept)
    reasons = "; ".join(whys) or "gaps of the log"
    message = f"under way {shown}; {left:.0f} s are left out: {reasons}; `--whole` keeps them"
    data = {"stretches": [list(part) for part in kept], "left_out_s": left}
    return Note("stretches", message, data)


def _duration_s(time: FloatArray, mask: BoolArray) -> float:
    return float(np.diff(time)[mask[1:]].sum())


def _idle(run: Run) -> BoolArray:
    """Return the mask (n,) of the samples at which the vehicle is stopped and its motor, where logged, is off."""
    speed = np.abs(run["surge_m_s"]) if run.has("surge_m_s") else None
    motor = next((run[m] for m in MOTORS if run.has(m)), None)
    off = np.zeros(run.time.size, dtype=np.bool_)
    if motor is not None:
        full = float(np.nanpercentile(np.abs(motor), 95))
        off = np.abs(motor) <= 0.02 * full if full > 0.0 else off
        off &= np.isfinite(motor)
    usual = float(np.nanpercentile(speed, 75)) if speed is not None else 0.0
    if speed is None or usual < SLOWEST:
        return off
    still = np.isfinite(speed) & (speed < IDLE * usual)
    return still & off if motor is not None and off.any() else still


def _surfaced(run: Run) -> BoolArray:
    depth = run["depth_m"] if run.has("depth_m") else np.zeros(run.time.size)
    has_dives = float(np.mean(depth > DIVES_M)) > DIVES
    return np.asarray(has_dives & (depth < SURFACE_M))


def _constant_ends(run: Run) -> BoolArray:
    """Return the mask (n,) of the samples before the first and after the last change of an angle, a rate or a fin.

    A logger that repeats the last value writes such samples.
    """
    mask = np.zeros(run.time.size, dtype=np.bool_)
    main = [run[s] for s in MAIN if run.has(s)]
    if not main:
        return mask
    changes = np.any([np.abs(np.diff(np.nan_to_num(v))) > 0.0 for v in main], axis=0)
    places = np.flatnonzero(changes)
    if places.size:
        mask[: places[0]] = True
        mask[places[-1] + 2 :] = True
    return mask


def _lasting_blocks(time: FloatArray, mask: BoolArray) -> BoolArray:
    """Return a mask (n,) with only those blocks that last at least OFF_S."""
    kept = mask.copy()
    for begin, end in zip(*blocks_of(mask), strict=True):
        if time[end - 1] - time[begin] < OFF_S:
            kept[begin:end] = False
    return kept
