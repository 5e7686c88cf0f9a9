"""The parameters of a fit: base and effect parameters shared by runs, and each run's initial state and nuisances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.effect import Coefficient, Effect, is_on_bound, with_one_cross_state
from fieldsid.models.record import Record
from fieldsid.models.speed_law import GROUP_WIDTH, TRIM_OF_FIN, SpeedLaw, with_speed
from fieldsid.numerics.arrays import BoolArray, FloatArray

START_NAMES = ("angle0", "rate0", "rate_before")
"""Parameters of a run's initial state: angle, rate, and the steady rate before the run, which determines the cross state."""
MAX_RATE_BEFORE_RATIO, MAX_RATE_BEFORE_RAD_S = 1.5, 2.0
"""Bound of the rate before a run, relative to the largest rate of the records; and in rad/s where no rate was measured."""

EVENT_UNIT = "run"
"""Unit of the time of an event, a share of its run."""
GROUP_WIDTH_TRAINED = 0.12
"""Relative distance from a group's speed within which a run counts as flown at that speed, where groups are `snapped`."""
BASE_BOUNDS = {"damping": (-10.0, 100.0), "stiffness": (-20.0, 100.0), "authority": (-500.0, 500.0), "trim": (-50.0, 50.0)}


@dataclass(frozen=True, slots=True)
class Parameter:
    """One estimated number: name, unit, bounds, start, and the run it belongs to (-1 when shared)."""

    name: str
    unit: str
    low: float
    high: float
    start: float
    run: int = -1

    @property
    def is_event(self) -> bool:
        """Whether it is the time of an event, as a share of its run."""
        return self.unit == EVENT_UNIT


@dataclass(frozen=True, slots=True)
class SpeedGroups:
    """Speed groups: mean speed of each, group and speed of each run; `reference` is the group to which the law refers.

    `snapped`: runs count as flown at the speed of their group, and changes of the speed within a run are relative to that.
    `faster`: the relative correction of the runs' speed. `trim_of_fin`: the trim moment scales with the authority. `by_law`: all
    groups share one authority, which scales with the square of the speed; else each group has a separate one. `exponent`: the
    exponent of the damping over speed where it is not a parameter.
    """

    speeds: tuple[float, ...]
    of_run: tuple[int, ...]
    reference: int
    run_speeds: tuple[float, ...]
    snapped: bool = False
    trim_of_fin: bool = False
    by_law: bool = False
    exponent: float = 1.0
    faster: float = 0.0

    def flown(self, run: int) -> float:
        """Return the corrected speed of a run."""
        return self.run_speeds[run] * (1.0 + self.faster)

    def over_group(self, run: int) -> float:
        """Return the speed of a run over the speed to which its authority parameter refers."""
        return self.flown(run) / self.speeds[self.reference if self.by_law else self.of_run[run]]

    def over_reference(self, group: int) -> float:
        """Return the speed of a group over that of the reference group."""
        return self.speeds[group] / self.speeds[self.reference]


def speed_groups(
    records: Sequence[Record], *, width: float = GROUP_WIDTH, snapped: bool = False, trim_of_fin: bool | None = None
) -> SpeedGroups:
    """Return the runs' speed groups by single linkage in log speed; one group when any speed is not known.

    width is the log ratio of neighbouring speeds above which a new group begins; trim_of_fin is by default that of the axis.
    """
    trim = TRIM_OF_FIN[records[0].axis] if trim_of_fin is None else trim_of_fin
    own = tuple(r.speed for r in records)
    speeds = np.array([r.speed for r in records])
    if not np.isfinite(speeds).all() or (speeds <= 0).any():
        known = speeds[np.isfinite(speeds)]
        return SpeedGroups((float(known.mean()) if known.size else float("nan"),), (0,) * len(records), 0, own, snapped, trim)
    order = np.argsort(speeds)
    labels = np.zeros(len(records), dtype=int)
    for previous, index in pairwise(order):
        labels[index] = labels[previous] + int(np.log(speeds[index] / speeds[previous]) > width)
    means = tuple(float(speeds[labels == g].mean()) for g in range(labels.max() + 1))
    reference = int(np.argmin(np.abs(np.log(np.array(means) / np.median(means)))))
    of_run = tuple(int(g) for g in labels)
    return SpeedGroups(means, of_run, reference, _run_speeds(own, means, of_run, snapped=snapped), snapped, trim)


def _run_speeds(own: Sequence[float], means: Sequence[float], of_run: Sequence[int], *, snapped: bool) -> tuple[float, ...]:
    """Return the speed of each run, replaced by that of its group where it is near enough."""
    near = GROUP_WIDTH_TRAINED if snapped else 0.0
    return tuple(means[g] if abs(np.log(u / means[g])) <= near else u for u, g in zip(own, of_run, strict=True))


@dataclass(frozen=True, slots=True)
class ParameterLayout:
    """The parameters of a fit in their order, and where the parts of the vector are."""

    axis: Axis
    effects: tuple[Effect, ...]
    groups: SpeedGroups
    parameters: tuple[Parameter, ...]
    shared: int
    names: tuple[str, ...] = field(init=False)
    """Names of the shared parameters."""
    every: tuple[str, ...] = field(init=False)
    """Names of all parameters."""
    low: FloatArray = field(init=False, compare=False)
    """Lower bounds, (N,)."""
    high: FloatArray = field(init=False, compare=False)
    """Upper bounds, (N,)."""
    run_nuisances: Mapping[int, tuple[int, ...]] = field(init=False, compare=False)
    """The positions of each run's nuisances."""
    owners: Mapping[str, tuple[Effect, Coefficient]] = field(init=False, compare=False)
    """The effect and the coefficient of each of the effects' parameters, by its name."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "every", tuple(s.name for s in self.parameters))
        object.__setattr__(self, "names", self.every[: self.shared])
        object.__setattr__(self, "low", np.array([s.low for s in self.parameters]))
        object.__setattr__(self, "high", np.array([s.high for s in self.parameters]))
        own: dict[int, list[int]] = {}
        for i, slot in enumerate(self.parameters[self.shared :], self.shared):
            own.setdefault(slot.run, []).append(i)
        object.__setattr__(self, "run_nuisances", MappingProxyType({run: tuple(places) for run, places in own.items()}))
        object.__setattr__(self, "owners", MappingProxyType({c.name: (e, c) for e in self.effects for c in e.coefficients}))

    def nuisances_of(self, run: int) -> tuple[int, ...]:
        """Return the positions of a run's nuisances."""
        return self.run_nuisances.get(run, ())

    def on_bound(self, x: FloatArray) -> list[Parameter]:
        """Return the shared parameters whose value in x is on a bound."""
        shared = zip(self.parameters[: self.shared], x[: self.shared].tolist(), strict=True)
        return [p for p, value in shared if is_on_bound(value, p.low, p.high)]

    def shown(self, name: str) -> str:
        """Return a shared parameter's name as it is printed: with the speed to which it refers where there are several runs."""
        g = self.groups
        return with_speed(name, self.axis, g.speeds[g.reference], trim_of_fin=g.trim_of_fin) if len(g.of_run) > 1 else name

    def law(self, values: dict[str, float]) -> SpeedLaw:
        """Return the speed law of a vector of shared values."""
        names = NAMES[self.axis]
        g = self.groups
        reference, snap = g.speeds[g.reference], GROUP_WIDTH_TRAINED if g.snapped else 0.0
        if len(g.speeds) == 1:
            return SpeedLaw(reference, g.exponent, snap=snap, trim_of_fin=g.trim_of_fin)
        lifts = [g.over_reference(i) ** 2 if g.by_law else 1.0 for i in range(len(g.speeds))]
        points = tuple((u, lifts[i] * values[group_name(names.authority, g, i)]) for i, u in enumerate(g.speeds))
        return SpeedLaw(reference, values["damping_exponent"], 2.0, points, snap, g.trim_of_fin)


def group_name(authority: str, groups: SpeedGroups, index: int) -> str:
    """Return the name of a group's authority, without a speed for the reference group and for an authority shared by all."""
    return authority if groups.by_law or index == groups.reference else f"{authority}@{groups.speeds[index]:.3g}"


def layout_of(
    records: Sequence[Record], axis: Axis, effects: Sequence[Effect], groups: SpeedGroups | None = None
) -> ParameterLayout:
    """Return the parameters of a joint fit of records with effects; only one of the effects keeps the cross state."""
    effects = with_one_cross_state(effects)
    names, groups = NAMES[axis], speed_groups(records) if groups is None else groups
    slots = [Parameter(names.damping, "1/s", *BASE_BOUNDS["damping"], 1.0)]
    if names.stiffness is not None:
        slots.append(Parameter(names.stiffness, "1/s^2", *BASE_BOUNDS["stiffness"], 0.1))
    authorities = dict.fromkeys(group_name(names.authority, groups, i) for i in range(len(groups.speeds)))
    slots += [Parameter(name, "1/s^2", *BASE_BOUNDS["authority"], 0.0) for name in authorities]
    slots.append(Parameter(names.trim, "rad/s^2", *BASE_BOUNDS["trim"], 0.0))
    if len(groups.speeds) > 1:
        slots.append(Parameter("damping_exponent", "1", -1.0, 3.0, 1.0))
    slots += [Parameter(c.name, c.unit, c.low, c.high, c.start) for e in effects for c in e.shared]
    shared = len(slots)
    before = _fastest_before(records)
    for i, record in enumerate(records):
        slots += _run_nuisances(i, record, effects, before)
    return ParameterLayout(axis, effects, groups, tuple(slots), shared)


def _run_nuisances(run: int, record: Record, effects: Sequence[Effect], before: float) -> list[Parameter]:
    angle = _first(record.angle, record.angle_ok)
    rate = _first(record.rate, record.rate_ok)
    slots = [Parameter("angle0", "rad", -1e4, 1e4, angle, run), Parameter("rate0", "rad/s", -10.0, 10.0, rate, run)]
    if any(e.extra_states for e in effects):
        slots.append(Parameter("rate_before", "rad/s", -before, before, 0.0, run))
    return slots + [Parameter(c.name, c.unit, c.low, c.high, c.start, run) for e in effects for c in e.nuisance]


def _fastest_before(records: Sequence[Record]) -> float:
    """Return the bound of the steady rate before a run."""
    fastest = max((float(np.max(np.abs(r.rate[r.rate_ok]))) for r in records if r.rate_ok.any()), default=0.0)
    return MAX_RATE_BEFORE_RATIO * fastest if fastest > 0.0 else MAX_RATE_BEFORE_RAD_S


def _first(values: FloatArray, ok: BoolArray) -> float:
    """Return the mean of the first few measured samples."""
    index = np.flatnonzero(ok)[:5]
    return float(values[index].mean()) if index.size else 0.0
