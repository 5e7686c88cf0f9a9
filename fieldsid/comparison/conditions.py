"""The conditions of a run: phase of the maneuver, fin angle, rate, speed, heading, side, depth, time; each a set of samples.

They are named in plain words: `phase: onset`, `side: port`. There are no conditions of a signal that hardly changes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.models.axis import Axis
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray

Mask = npt.NDArray[np.bool_]

ONSET_S = 1.0
"""Time after a fin movement that counts as the onset phase."""
MIN_MOVE_RANGE_SHARE = 0.1
"""Least change of the fin that is a movement, and least angle off trim, as shares of the fin's range."""
MIN_TURNING_RATE_SHARE = 0.1
"""Rate below which the vehicle goes straight, as a share of the largest rate."""
LEAST_SPREAD = {"surge": 0.05, "depth": 0.5}
"""Least spread of a signal (surge: as a share of its median; depth: in m) for which there are conditions."""
QUARTERS = 4
WIDEST_HEADING = np.pi / 2


@dataclass(frozen=True, slots=True)
class Condition:
    """One condition: its words, and the samples (n,) at which it holds."""

    words: str
    mask: Mask


def conditions(record: Record, rate: FloatArray, trim: float) -> tuple[Condition, ...]:
    """Return every condition of a record; rate (n,) rad/s is the simulated one, free of noise, trim the fin at rest in rad."""
    return (
        *_phases(record, trim),
        *_thirds("fin", np.abs(record.fin - trim), "rad off trim"),
        *_thirds("rate", np.abs(rate), "rad/s"),
        *_side(record, rate),
        *_helpers(record),
        *_heading(record),
        *_time(record),
    )


def _phases(record: Record, trim: float) -> Iterator[Condition]:
    reach = float(np.ptp(record.fin))
    if reach == 0.0:
        return
    moved = np.abs(np.diff(record.fin, prepend=record.fin[0])) > MIN_MOVE_RANGE_SHARE * reach
    last = np.maximum.accumulate(np.where(moved, record.time, -np.inf))
    onset = record.time - last < ONSET_S
    away = np.abs(record.fin - trim) > MIN_MOVE_RANGE_SHARE * reach
    begun = np.maximum.accumulate(moved | away)
    yield Condition("phase: before", ~begun)
    yield Condition("phase: onset", begun & onset)
    yield Condition("phase: hold", begun & ~onset & away)
    yield Condition("phase: recovery", begun & ~onset & ~away)


def _thirds(what: str, size: FloatArray, unit: str) -> Iterator[Condition]:
    top = float(np.quantile(size, 0.99))
    if top <= 0.0:
        return
    low, high = top / 3, 2 * top / 3
    yield Condition(f"{what}: below {low:.2g} {unit}", size < low)
    yield Condition(f"{what}: {low:.2g} .. {high:.2g} {unit}", (size >= low) & (size < high))
    yield Condition(f"{what}: above {high:.2g} {unit}", size >= high)


def _side(record: Record, rate: FloatArray) -> Iterator[Condition]:
    least = MIN_TURNING_RATE_SHARE * float(np.max(np.abs(rate)))
    up, down = ("starboard", "port") if record.axis is Axis.YAW else ("nose up", "nose down")
    yield Condition(f"side: {up}", rate > least)
    yield Condition(f"side: {down}", rate < -least)
    yield Condition("side: straight", np.abs(rate) <= least)


def _helpers(record: Record) -> Iterator[Condition]:
    for role, word, unit in (("surge", "speed", "m/s"), ("depth", "depth", "m")):
        if role not in record.signals:
            continue
        values = record.signals[role]
        ends = np.quantile(values, (0.02, 0.98))
        if float(np.ptp(ends)) < LEAST_SPREAD[role] * (abs(float(np.median(values))) if role == "surge" else 1.0):
            continue
        middle = 0.5 * float(np.sum(ends))
        yield Condition(f"{word}: below {middle:.2f} {unit}", values < middle)
        yield Condition(f"{word}: above {middle:.2f} {unit}", values >= middle)


def _heading(record: Record) -> Iterator[Condition]:
    if record.axis is not Axis.YAW or not record.angle_ok.any():
        return
    if float(np.ptp(record.angle[record.angle_ok])) < WIDEST_HEADING:
        return
    quarter = np.floor(np.remainder(record.angle + np.pi / 4, 2 * np.pi) / (np.pi / 2)).astype(int) % QUARTERS
    for i, word in enumerate(("north", "east", "south", "west")):
        yield Condition(f"heading: {word}", record.angle_ok & (quarter == i))


def _time(record: Record) -> Iterator[Condition]:
    edges = np.linspace(record.time[0], record.time[-1], QUARTERS + 1)
    for i in range(QUARTERS):
        inside = (record.time >= edges[i]) & ((record.time < edges[i + 1]) | (i == QUARTERS - 1))
        yield Condition(f"time: {edges[i]:.0f} .. {edges[i + 1]:.0f} s", inside)
