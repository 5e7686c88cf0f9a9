"""The stretches of a log in which the vehicle is under way: what lies between is on deck, adrift, at the surface or idle.

Left out is where for some time the motor is off and no speed is made, the vehicle floats at the surface of a log that dives,
or no angle, rate or fin changes any more at an end; and where the log has nothing at all. A motor that is off on a vehicle
that still moves is a way of flying.
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
"""Shorter than this nothing is left out."""
LEAST_S = 20.0
"""A stretch shorter than this is none."""
IDLE = 0.15
"""Share of the usual speed below which no way is made."""
DIVES_M, DIVES = 1.0, 0.2
"""Depth in m, and share of the log below it, from which on a log is one of dives."""
SURFACE_M = 0.3


Part = tuple[float, float]
"""Start and end of a stretch in s, as `load_run` takes them."""


def stretches_of(run: Run) -> tuple[tuple[Part, ...], tuple[Note, ...]]:
    """Return the stretches of a run under way, and notes on what lies outside of them; the whole run where there is none else."""
    whole = ((float(run.time[0]), float(run.time[-1])),)
    reasons = {
        "no way is made": _idle(run),
        "at the surface": _at_surface(run),
        "nothing changes": _tails(run),
    }
    off = {why: _long(run.time, mask) for why, mask in reasons.items()}
    away = np.any(np.stack(list(off.values())), axis=0)
    breaks = np.flatnonzero((np.diff(run.time) > max(OFF_S, FEW_STEPS * float(np.median(np.diff(run.time))))) | np.diff(away)) + 1
    parts = [p for p in np.split(np.arange(run.time.size), breaks) if not away[p[0]]]
    found = ((float(run.time[p[0]]), float(run.time[p[-1]])) for p in parts)
    kept = tuple((start, end) for start, end in found if end - start >= LEAST_S)
    if not kept or kept == whole:
        return whole, ()
    return kept, (_note(run, kept, off),)


def _note(run: Run, kept: tuple[Part, ...], off: dict[str, BoolArray]) -> Note:
    whys = [f"{why} ({_seconds(run.time, mask):.0f} s)" for why, mask in off.items() if mask.any()]
    shown = few_of([f"{start:.2f} .. {end:.2f} s" for start, end in kept])
    left = float(run.time[-1] - run.time[0]) - sum(end - start for start, end in kept)
    reasons = "; ".join(whys) or "gaps of the log"
    message = f"under way {shown}; {left:.0f} s are left out: {reasons}; `--whole` keeps them"
    data = {"stretches": [list(part) for part in kept], "left_out_s": left}
    return Note("stretches", message, data)


def _seconds(time: FloatArray, mask: BoolArray) -> float:
    return float(np.diff(time)[mask[1:]].sum())


def _idle(run: Run) -> BoolArray:
    """Where no way is made and the motor, if it is in the log, is off."""
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


def _at_surface(run: Run) -> BoolArray:
    if not run.has("depth_m"):
        return np.zeros(run.time.size, dtype=np.bool_)
    depth = run["depth_m"]
    dives = float(np.nanmean(depth > DIVES_M)) > DIVES
    return np.isfinite(depth) & (depth < SURFACE_M) if dives else np.zeros(run.time.size, dtype=np.bool_)


def _tails(run: Run) -> BoolArray:
    """Before the first and after the last change of an angle, a rate or a fin; a logger that holds the last value writes such."""
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


def _long(time: FloatArray, mask: BoolArray) -> BoolArray:
    """Return only those runs of a mask (n,) that last."""
    kept = mask.copy()
    for begin, end in zip(*blocks_of(mask), strict=True):
        if time[end - 1] - time[begin] < OFF_S:
            kept[begin:end] = False
    return kept
