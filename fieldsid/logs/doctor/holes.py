"""Holes in a fin's log that hide a move: what the fin did meanwhile nobody knows, and a fit that takes it as held is wrong.

A log with a usual step has a hole where the next sample comes more than FEW_STEPS steps later, whether the other signals go on
or not; a command that is published when it changes has none. Where the fin is at another angle after a hole the run is cut
there, and the part in which the fin moves most is used.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldsid.logs.convert.times.clock_text import FEW_STEPS
from fieldsid.logs.run import Note, Run
from fieldsid.numerics.arrays import BoolArray, FloatArray

JITTER = 0.35
"""Share of the usual step within which steps differ by the clock's jitter, not by a sample that is missing."""
REGULAR = 0.9
"""Share of the steps that are the usual one, but for jitter, from which on a longer one has lost samples."""
MOVED = 0.25
"""Share of the fin's range from which on a change is a move; over a hole less is held, or taken as half way."""


@dataclass(frozen=True, slots=True)
class Hole:
    """A hole in a fin's log: its last sample before and the first after, in s, and the fin there, in rad."""

    start_s: float
    end_s: float
    before: float
    after: float


def usual_step(steps: FloatArray) -> float | None:
    """Return the usual one of steps (n,) in s, None where there is none."""
    if steps.size == 0:
        return None
    usual = float(np.median(steps))
    return usual if is_usual(np.abs(steps - usual) < JITTER * usual) else None


def is_usual(regular: BoolArray) -> bool:
    """Whether the median of some steps is their usual one, told by which of them differ from it by jitter alone (n,)."""
    return bool(np.count_nonzero(regular) > REGULAR * regular.size)


def holes_of(time: FloatArray, fin: FloatArray) -> tuple[Hole, ...]:
    """Return the holes of a fin (n,) in rad, NaN where its log has nothing, at times (n,) in s."""
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


def hiding(holes: Sequence[Hole], fin: FloatArray) -> tuple[Hole, ...]:
    """Return the holes of a fin (n,) rad after which it is at another angle."""
    least = MOVED * float(np.nanmax(fin) - np.nanmin(fin))
    return tuple(h for h in holes if abs(h.after - h.before) > least)


def unbroken(run: Run, signal: str) -> Run:
    """Return the part of a run between holes that hide a move of a fin's signal, that in which the fin moves most."""
    hidden = hiding(holes_of(run.time, run[signal]), run[signal])
    if not hidden:
        return run
    starts = [float(run.time[0]), *(h.end_s for h in hidden)]
    ends = [*(h.start_s for h in hidden), float(run.time[-1])]
    kept = [(a, b) for a, b in zip(starts, ends, strict=True) if b > a]
    parts = [run.between(a, b) for a, b in kept]
    return max(parts, key=lambda part: float(np.sum(np.abs(np.diff(part[signal][np.isfinite(part[signal])]))))) if parts else run


def hole_notes(run: Run, signal: str) -> tuple[Note, ...]:
    """Return what the holes of a fin's signal mean for a fit of the run; one without samples at all is the clock's."""
    holes = holes_of(run.time, run[signal])
    hidden = hiding(holes, run[signal])
    held = [h for h in holes if h not in hidden and ((run.time > h.start_s) & (run.time < h.end_s)).any()]
    notes = []
    if hidden:
        used, h = unbroken(run, signal), max(hidden, key=_length)
        says = f" and is at {h.after:.3g} rad then, not at {h.before:.3g}: when it moved is not in the log, so that only "
        part = f"{used.time[0]:.2f} .. {used.time[-1]:.2f} s are used"
        notes.append(_note("fin_unknown", run, signal, hidden, says + part))
    if held:
        notes.append(_note("fin_missing", run, signal, held, ": taken as held"))
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
