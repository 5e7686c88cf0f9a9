"""Gaps in the log of a fin that hide a movement: a fit that assumes a constant fin over such a gap is wrong.

A log with regular steps has a hole where the next sample comes more than FEW_STEPS steps later, whether or not the other signals
continue; a command that is published when it changes has no holes. Where the fin is at another angle after a hole, the run is cut
there, and the part in which the fin moves most is used.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldsid.logs.convert.times.clock_text import FEW_STEPS
from fieldsid.logs.few_of import NEARLY_ALL
from fieldsid.logs.run import Note, Run
from fieldsid.logs.segments import MOVED
from fieldsid.numerics.arrays import BoolArray, FloatArray

JITTER = 0.35
"""Relative deviation from the usual step that is jitter of the clock and not a missing sample."""


@dataclass(frozen=True, slots=True)
class Hole:
    """A hole in the log of a fin: times in s and fin angles in rad of the last sample before it and the first after it."""

    start_s: float
    end_s: float
    before: float
    after: float


def usual_step(steps: FloatArray) -> float | None:
    """Return the usual step of steps (n,) in s; None where they are irregular."""
    if steps.size == 0:
        return None
    usual = float(np.median(steps))
    return usual if is_usual(np.abs(steps - usual) < JITTER * usual) else None


def is_usual(regular: BoolArray) -> bool:
    """Return whether NEARLY_ALL steps are usual: `regular` (n,) marks those that differ from their median by jitter only."""
    return bool(np.count_nonzero(regular) > NEARLY_ALL * regular.size)


def holes_of(time: FloatArray, fin: FloatArray) -> tuple[Hole, ...]:
    """Return the holes in a fin (n,) in rad at times (n,) in s; NaN marks a missing sample."""
    seen = np.flatnonzero(np.isfinite(fin))
    steps = np.diff(time[seen])
    usual = usual_step(steps)
    if usual is None:
        return ()
    places = np.flatnonzero(steps > FEW_STEPS * usual)
    return tuple(
        Hole(float(time[i]), float(time[j]), float(fin[i]), float(fin[j]))
        for i, j in ((seen[p], seen[p + 1]) for p in places.tolist())
    )


def hiding(time: FloatArray, fin: FloatArray) -> tuple[Hole, ...]:
    """Return the holes of a fin (n,) rad after which it is at another angle, or that last longer than it ever rests."""
    rest = _longest_rest(time, fin)
    return tuple(h for h in holes_of(time, fin) if _has_moved(h, fin) or _length(h) > rest)


def _has_moved(hole: Hole, fin: FloatArray) -> bool:
    return abs(hole.after - hole.before) > _least_move(fin)


def _least_move(fin: FloatArray) -> float:
    return MOVED * float(np.nanmax(fin) - np.nanmin(fin))


def _longest_rest(time: FloatArray, fin: FloatArray) -> float:
    """Return the longest logged time in s between two moves of a fin (n,) from sample to sample, without its holes."""
    seen = np.isfinite(fin)
    steps = np.diff(time[seen], prepend=time[seen][0])
    logged = np.cumsum(np.where(steps > FEW_STEPS * np.median(steps), 0.0, steps))
    moved = np.flatnonzero(np.abs(np.diff(fin[seen])) > _least_move(fin))
    return float(np.max(np.diff(logged[[0, *moved, -1]])))


def unbroken(run: Run, signal: str) -> Run:
    """Return the part of a run, between holes that hide a movement of the fin, in which the fin moves most."""
    hidden = hiding(run.time, run[signal])
    if not hidden:
        return run
    starts = [float(run.time[0]), *(h.end_s for h in hidden)]
    ends = [*(h.start_s for h in hidden), float(run.time[-1])]
    kept = [(a, b) for a, b in zip(starts, ends, strict=True) if b > a]
    parts = [run.between(a, b) for a, b in kept]
    return max(parts, key=lambda part: float(np.sum(np.abs(np.diff(part[signal][np.isfinite(part[signal])]))))) if parts else run


def hole_notes(run: Run, signal: str) -> tuple[Note, ...]:
    """Return notes on the consequences of the holes in a fin signal for a fit; a gap of all signals is not one of them."""
    holes = holes_of(run.time, run[signal])
    hidden = hiding(run.time, run[signal])
    taken_as_constant = [h for h in holes if h not in hidden and ((run.time > h.start_s) & (run.time < h.end_s)).any()]
    notes = []
    if hidden:
        used, h = unbroken(run, signal), max(hidden, key=_length)
        moved = _has_moved(h, run[signal])
        says = f" and is at {h.after:.3g} rad then, not at {h.before:.3g}" if moved else ", longer than it ever rests"
        part = f": when it moved is not in the log, so that only {used.time[0]:.2f} .. {used.time[-1]:.2f} s are used"
        notes.append(_note("fin_unknown", run, signal, hidden, says + part))
    if taken_as_constant:
        notes.append(_note("fin_missing", run, signal, taken_as_constant, ": taken as held"))
    return tuple(notes)


def _note(code: str, run: Run, signal: str, holes: Sequence[Hole], says: str) -> Note:
    longest = max(holes, key=_length)
    more = f", one of {len(holes)} such holes," if len(holes) > 1 else ""
    where = f"run {run.name!r}: `{signal}` is missing for {_length(longest):.2f} s from {longest.start_s:.2f} s{more}"
    return Note(
        code,
        where + says,
        {"value": _length(longest), "start_s": longest.start_s, "count": len(holes), "signal": signal, "run": run.name},
    )


def _length(hole: Hole) -> float:
    return hole.end_s - hole.start_s
