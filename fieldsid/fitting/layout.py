"""Which numbers a fit estimates: base and effect parameters shared by runs, and each run's own start and nuisances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from fieldsid.logs.run import BoolArray, FloatArray
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.effect import Effect
from fieldsid.models.record import Record
from fieldsid.models.speed_law import GROUP_WIDTH, TRIM_OF_FIN, SpeedLaw, with_speed

START_NAMES = ("angle0", "rate0", "rate_before")
"""What a run starts from: its angle, its rate, and the steady rate before it that left its cross state where it starts."""
BEFORE, FASTEST = 1.5, 2.0
"""Largest rate before a run over the largest of the records, and in rad/s where no rate was measured."""

SNAP_WIDTH = 0.12
"""A run this near to a group counts as of it, where the training runs showed that a group shares its parameters."""
BASE_BOUNDS = {"damping": (-10.0, 100.0), "stiffness": (-20.0, 100.0), "authority": (-500.0, 500.0), "trim": (-50.0, 50.0)}


@dataclass(frozen=True, slots=True)
class Slot:
    """One estimated number: name, unit, bounds, start, and the run it belongs to (-1 when shared)."""

    name: str
    unit: str
    low: float
    high: float
    start: float
    run: int = -1


@dataclass(frozen=True, slots=True)
class Groups:
    """Speed groups: mean speed of each, group and speed of each run; `reference` is the group the law refers to.

    `snapped` runs count as being at their group's speed; trim_of_fin: the trim moment goes with the authority; by_law: all
    groups share one authority that goes with the square of the speed, else each has its own; exponent: the damping's power of
    the speed where it is not one of the slots.
    """

    speeds: tuple[float, ...]
    of_run: tuple[int, ...]
    reference: int
    run_speeds: tuple[float, ...]
    snapped: bool = False
    trim_of_fin: bool = False
    by_law: bool = False
    exponent: float = 1.0

    def over_group(self, run: int) -> float:
        """Return a run's speed over the one its authority slot belongs to."""
        return self.run_speeds[run] / self.speeds[self.reference if self.by_law else self.of_run[run]]

    def over_reference(self, group: int) -> float:
        """Return a group's speed over the reference's."""
        return self.speeds[group] / self.speeds[self.reference]


def speed_groups(records: Sequence[Record], *, snapped: bool = False, trim_of_fin: bool | None = None) -> Groups:
    """Return the runs' speed groups by single linkage in log speed; one group when any speed is not known.

    trim_of_fin is by default the axis's own.
    """
    trim = TRIM_OF_FIN[records[0].axis] if trim_of_fin is None else trim_of_fin
    own = tuple(r.speed for r in records)
    speeds = np.array([r.speed for r in records])
    if not np.isfinite(speeds).all() or (speeds <= 0).any():
        known = speeds[np.isfinite(speeds)]
        return Groups((float(known.mean()) if known.size else float("nan"),), (0,) * len(records), 0, own, snapped, trim)
    order = np.argsort(speeds)
    labels = np.zeros(len(records), dtype=int)
    for previous, index in pairwise(order):
        labels[index] = labels[previous] + int(np.log(speeds[index] / speeds[previous]) > GROUP_WIDTH)
    means = tuple(float(speeds[labels == g].mean()) for g in range(labels.max() + 1))
    reference = int(np.argmin(np.abs(np.log(np.array(means) / np.median(means)))))
    of_run = tuple(int(g) for g in labels)
    return Groups(means, of_run, reference, _run_speeds(own, means, of_run, snapped=snapped), snapped, trim)


def _run_speeds(own: Sequence[float], means: Sequence[float], of_run: Sequence[int], *, snapped: bool) -> tuple[float, ...]:
    """Return the speed each run counts as flown at."""
    near = SNAP_WIDTH if snapped else 0.0
    return tuple(means[g] if abs(np.log(u / means[g])) <= near else u for u, g in zip(own, of_run, strict=True))


@dataclass(frozen=True, slots=True)
class Layout:
    """The slots of a fit in their order, and where the parts of the vector are."""

    axis: Axis
    effects: tuple[Effect, ...]
    groups: Groups
    slots: tuple[Slot, ...]
    shared: int
    names: tuple[str, ...] = field(init=False)
    """Names of the shared slots."""
    every: tuple[str, ...] = field(init=False)
    """Names of all slots."""
    low: FloatArray = field(init=False, compare=False)
    """Lower bounds, (N,)."""
    high: FloatArray = field(init=False, compare=False)
    """Upper bounds, (N,)."""
    own: Mapping[int, tuple[int, ...]] = field(init=False, compare=False)
    """The positions of each run's own slots."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "every", tuple(s.name for s in self.slots))
        object.__setattr__(self, "names", self.every[: self.shared])
        object.__setattr__(self, "low", np.array([s.low for s in self.slots]))
        object.__setattr__(self, "high", np.array([s.high for s in self.slots]))
        own: dict[int, list[int]] = {}
        for i, slot in enumerate(self.slots[self.shared :], self.shared):
            own.setdefault(slot.run, []).append(i)
        object.__setattr__(self, "own", MappingProxyType({run: tuple(places) for run, places in own.items()}))

    def of_run(self, run: int) -> tuple[int, ...]:
        """Return the positions of a run's own slots."""
        return self.own.get(run, ())

    def shown(self, name: str) -> str:
        """Return a shared slot's name as it is printed: that of several runs with the speed it belongs to."""
        g = self.groups
        return with_speed(name, self.axis, g.speeds[g.reference], trim_of_fin=g.trim_of_fin) if len(g.of_run) > 1 else name

    def law(self, values: dict[str, float]) -> SpeedLaw:
        """Return the speed law of a vector of shared values."""
        names = NAMES[self.axis]
        g = self.groups
        reference, snap = g.speeds[g.reference], SNAP_WIDTH if g.snapped else 0.0
        if len(g.speeds) == 1:
            return SpeedLaw(reference, g.exponent, snap=snap, trim_of_fin=g.trim_of_fin)
        lifts = [g.over_reference(i) ** 2 if g.by_law else 1.0 for i in range(len(g.speeds))]
        points = tuple((u, lifts[i] * values[group_name(names.authority, g, i)]) for i, u in enumerate(g.speeds))
        return SpeedLaw(reference, values["damping_exponent"], 2.0, points, snap, g.trim_of_fin)


def group_name(authority: str, groups: Groups, index: int) -> str:
    """Return the name of a group's authority; the reference group's, or the one all share, is the plain name."""
    return authority if groups.by_law or index == groups.reference else f"{authority}@{groups.speeds[index]:.3g}"


def layout_of(records: Sequence[Record], axis: Axis, effects: Sequence[Effect], groups: Groups | None = None) -> Layout:
    """Return the slots of a joint fit of records with effects."""
    names, groups = NAMES[axis], speed_groups(records) if groups is None else groups
    slots = [Slot(names.damping, "1/s", *BASE_BOUNDS["damping"], 1.0)]
    if names.stiffness is not None:
        slots.append(Slot(names.stiffness, "1/s^2", *BASE_BOUNDS["stiffness"], 0.1))
    authorities = dict.fromkeys(group_name(names.authority, groups, i) for i in range(len(groups.speeds)))
    slots += [Slot(name, "1/s^2", *BASE_BOUNDS["authority"], 0.0) for name in authorities]
    slots.append(Slot(names.trim, "rad/s^2", *BASE_BOUNDS["trim"], 0.0))
    if len(groups.speeds) > 1:
        slots.append(Slot("damping_exponent", "1", -1.0, 3.0, 1.0))
    slots += [Slot(c.name, c.unit, c.low, c.high, c.start) for e in effects for c in e.shared]
    shared = len(slots)
    before = _fastest_before(records)
    for i, record in enumerate(records):
        slots += _own_slots(i, record, effects, before)
    return Layout(axis, tuple(effects), groups, tuple(slots), shared)


def _own_slots(run: int, record: Record, effects: Sequence[Effect], before: float) -> list[Slot]:
    angle = _first(record.angle, record.angle_ok)
    rate = _first(record.rate, record.rate_ok)
    slots = [Slot("angle0", "rad", -1e4, 1e4, angle, run), Slot("rate0", "rad/s", -10.0, 10.0, rate, run)]
    if any(e.extra_states for e in effects):
        slots.append(Slot("rate_before", "rad/s", -before, before, 0.0, run))
    return slots + [Slot(c.name, c.unit, c.low, c.high, c.start, run) for e in effects for c in e.nuisance]


def _fastest_before(records: Sequence[Record]) -> float:
    """Return the largest steady rate that may have gone before a run."""
    fastest = max((float(np.max(np.abs(r.rate[r.rate_ok]))) for r in records if r.rate_ok.any()), default=0.0)
    return BEFORE * fastest if fastest > 0.0 else FASTEST


def _first(values: FloatArray, ok: BoolArray) -> float:
    """Return the mean of the first few measured samples."""
    index = np.flatnonzero(ok)[:5]
    return float(values[index].mean()) if index.size else 0.0
