"""The hold-out: the choice of training and validation runs where the user names no validation runs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from fieldsid.logs.run import Note
from fieldsid.models.record import Record, part_of
from fieldsid.numerics.arrays import FloatArray
from fieldsid.rounding import nine_digits

TRAINING_SHARE = 0.65
MIN_PART_S = 12.0
QUIET_SPAN_S = 1.5
QUIET_RATE_SHARE = 0.15


def holdout_split(records: Sequence[Record]) -> tuple[tuple[Record, ...], tuple[Record, ...], tuple[Note, ...]]:
    """Return training and validation records from one set, and a note on the choice.

    With three runs or more, the run of median speed is the validation run. With fewer runs, the last third of
    the excitation of each run is. Where that is too short for a validation, all runs are used for training.
    """
    if len(records) >= 3:
        speeds = [nine_digits(r.speed) for r in records]
        # runs of equal speed keep their order
        by_speed = sorted(range(len(records)), key=speeds.__getitem__)
        middle = by_speed[len(records) // 2] if np.isfinite(speeds).all() else len(records) - 1
        rest = tuple(r for i, r in enumerate(records) if i != middle)
        text = f"no validation run was given: {records[middle].name} was held back to judge by"
        return rest, (records[middle],), (Note("held_back", text, {"run": records[middle].name}),)
    parts = [_cut(r) for r in records]
    if any(p is None for p in parts):
        text = "no validation run was given and the runs are too short to hold a part back: judged on the runs fitted to"
        return tuple(records), (), (Note("nothing_held_back", text, {"shortest_s": MIN_PART_S, "hint": "--validate RUN"}),)
    whole = [p for p in parts if p is not None]
    text = f"no validation run was given: the last part of {', '.join(r.name for r in records)} was held back to judge by"
    return tuple(a for a, _ in whole), tuple(b for _, b in whole), (Note("held_back", text, {"share": 1 - TRAINING_SHARE}),)


def _cut(record: Record) -> tuple[Record, Record] | None:
    """Return both parts of a record; None where they are too short.

    The cut is where the fin is at rest and its cumulated activity is nearest to TRAINING_SHARE.

    A cut inside a pulse would start the second part with a fin and a hull in motion.
    """
    off = np.abs(record.fin - np.median(record.fin))
    if not off.any():
        return None
    activity = np.cumsum(off)
    wanted = record.time[int(np.searchsorted(activity, TRAINING_SHARE * activity[-1]))]
    resting = quiet_before(record, off)
    if not resting.any():
        return None
    index = int(np.flatnonzero(resting)[np.argmin(np.abs(record.time[resting] - wanted))])
    first, last = record.time[index] - record.time[0], record.time[-1] - record.time[index]
    if first < MIN_PART_S or last < 0.5 * MIN_PART_S or float(np.ptp(record.fin[index:])) < QUIET_RATE_SHARE * float(off.max()):
        return None
    return part_of(record, slice(0, index)), part_of(record, slice(index, None))


def quiet_before(record: Record, off: FloatArray) -> npt.NDArray[np.bool_]:
    """Return the mask (n,) of the samples before which the fin was at rest near its median for QUIET_SPAN_S."""
    moving = off > QUIET_RATE_SHARE * float(off.max())
    last_moved = np.maximum.accumulate(np.where(moving, record.time, record.time[0] - QUIET_SPAN_S))
    return np.asarray(record.time - last_moved >= QUIET_SPAN_S)
