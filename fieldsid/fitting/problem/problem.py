"""A joint fit as a function: parameters in, free-run residuals and exact sensitivities of every run out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import isfinite

import numpy as np

from fieldsid.dynamics.assemble import Base, KernelInputs, assemble, combined_core, integrate_record, measured, with_moments
from fieldsid.fitting.problem.kernel_input_cache import KernelInputCache
from fieldsid.fitting.problem.parameters import START_NAMES, ParameterLayout, SpeedGroups, group_name, layout_of
from fieldsid.fitting.problem.sensitivities import Sensitivities
from fieldsid.models.axis import NAMES
from fieldsid.models.effect import Effect, Motion, Values
from fieldsid.models.fin_path import FinPath
from fieldsid.models.hull import Core
from fieldsid.models.record import Record, part_of
from fieldsid.models.speed_law import over_reference
from fieldsid.numerics.arrays import FloatArray
from fieldsid.runtime.evaluation_counter import EvaluationCounter

MAX_CACHED_SAMPLES = 20_000
"""Samples of the longest run whose kernel inputs are cached."""


@dataclass(frozen=True, slots=True)
class RunResult:
    """One run's free run: angle and rate (n,) as the sensors show them.

    `stack` (1 + P, 2, n) has the residual, then the sensitivities to the parameters at `columns`.
    """

    angle: FloatArray
    rate: FloatArray
    columns: tuple[int, ...]
    stack: FloatArray
    base: Base

    @property
    def residual(self) -> FloatArray:
        """Measured minus simulated, (2, n), zero where nothing was measured."""
        return np.asarray(self.stack[0])

    @property
    def sensitivity(self) -> FloatArray:
        """Derivatives of the simulated sensor signals by the parameters, (P, 2, n)."""
        return np.asarray(self.stack[1:])


@dataclass(frozen=True, slots=True)
class Problem:
    """Records and the parameters estimated from them.

    `evaluations` counts the simulations; a problem made by `replace` has the same counter and a new cache.
    """

    records: tuple[Record, ...]
    layout: ParameterLayout
    evaluations: EvaluationCounter = field(default_factory=EvaluationCounter, compare=False, repr=False)
    cache: KernelInputCache = field(default_factory=KernelInputCache, init=False, compare=False, repr=False)
    counted: tuple[Record, ...] = field(init=False, compare=False, repr=False)
    """The records at the speeds of the groups, to which changes of the speed within a run are relative."""
    scales: tuple[tuple[float, float], ...] = field(init=False, compare=False, repr=False)
    """The speed of each run over the reference speed, and over the speed to which its authority parameter refers."""

    def __post_init__(self) -> None:
        g = self.layout.groups
        counted = tuple(r.at_speed(speed) for r, speed in zip(self.records, g.run_speeds, strict=True))
        object.__setattr__(self, "counted", counted)
        object.__setattr__(self, "scales", tuple(_scales(g, run) for run in range(len(self.records))))

    def first(self, samples: int) -> Problem:
        """Return the problem on the first `samples` samples of every run; this problem where no run is longer."""
        if all(len(r) <= samples for r in self.records):
            return self
        return replace(self, records=tuple(part_of(r, slice(0, samples)) for r in self.records))

    def with_effects(self, effects: Sequence[Effect]) -> Problem:
        """Return the problem of the same records and speed groups with other effects."""
        return replace(self, layout=layout_of(self.records, self.layout.axis, effects, self.layout.groups))

    def base_of(self, x: FloatArray, run: int) -> Base:
        """Return a run's base parameters."""
        return self._base(dict(zip(self.layout.names, x[: self.layout.shared].tolist(), strict=True)), run)

    def _base(self, v: Values, run: int) -> Base:
        names, layout = NAMES[self.layout.axis], self.layout
        share, ratio = self.scales[run]
        authority = v[self.authority_of(run)] * ratio**2
        return Base(
            v[names.damping] * share ** v.get("damping_exponent", layout.groups.exponent),
            0.0 if names.stiffness is None else v[names.stiffness],
            authority,
            v[names.trim] * self._trim_factor(v, authority),
            layout.groups.trim_of_fin,
        )

    def _trim_factor(self, v: Values, authority: float) -> float:
        return over_reference(authority, v[NAMES[self.layout.axis].authority]) if self.layout.groups.trim_of_fin else 1.0

    def trim_factor(self, x: FloatArray, run: int) -> float:
        """Return a run's trim moment over the trim parameter."""
        v = dict(zip(self.layout.names, x[: self.layout.shared].tolist(), strict=True))
        return self._trim_factor(v, v[self.authority_of(run)] * self.scales[run][1] ** 2)

    def values_of(self, x: FloatArray, run: int) -> dict[str, float]:
        """Return the values of shared parameters and of a run's nuisances by name."""
        layout, numbers = self.layout, x.tolist()
        values = {"damping_exponent": layout.groups.exponent} | dict(zip(layout.names, numbers, strict=False))
        for place in layout.nuisances_of(run):
            values[layout.every[place]] = numbers[place]
        return values

    def state_of(self, x: FloatArray, run: int) -> tuple[float, float, float]:
        """Return a run's initial state: angle, rate, and the steady cross state at the rate before the run."""
        values = self.values_of(x, run)
        angle, rate, cross = _start_of(values, combined_core(self.layout.effects, values, self.scales[run][0]))
        return float(angle), float(rate), float(cross)

    def _arrays(self, record: Record, base: Base, values: Values, run: int) -> KernelInputs:
        """Return the kernel inputs of a run, from the cache where only its initial state has changed since the last call."""
        key = (base, *(v for name, v in values.items() if name not in START_NAMES))
        make = partial(assemble, record, self.layout.effects, base, values, self.scales[run][0])
        return self.cache.get(run, key, make) if len(record) <= MAX_CACHED_SAMPLES else make()

    def simulate(self, x: FloatArray, run: int) -> tuple[Motion, Base]:
        """Return one run's free run as the sensors would show it."""
        self.evaluations.add()
        record = self.counted[run]
        values, base, start, arrays = self._inputs(x, run)
        out = integrate_record(record, arrays, start)
        return measured(Motion(out[:, 0], out[:, 1]), record, self.layout.effects, values), base

    def _inputs(self, x: FloatArray, run: int) -> tuple[dict[str, float], Base, FloatArray, KernelInputs]:
        """Return the inputs of a run's simulation: coefficients, base parameters, initial state (3,) and kernel inputs."""
        record, values = self.counted[run], self.values_of(x, run)
        base = self._base(values, run)
        arrays = self._arrays(record, base, values, run)
        start = _start_of(values, arrays.core)
        return values, base, start, with_moments(record, arrays, self.layout.effects, values, start)

    def residual(self, x: FloatArray, run: int) -> tuple[FloatArray, Base]:
        """Return measured minus simulated, (2, n), zero where nothing was measured; and the run's base."""
        motion, base = self.simulate(x, run)
        return _difference(self.records[run], motion, np.empty((2, len(self.records[run])))), base

    def linearise(self, x: FloatArray, run: int, free: Sequence[int] | None = None) -> RunResult:
        """Return one run's free run with its sensitivities to the free parameters that affect it."""
        self.evaluations.add()
        slots, sensitivities = self._sensitivities(x, run, free)
        out, stack = sensitivities.integrate(slots)
        simulated = sensitivities.through_sensors(Motion(out[:, 0], out[:, 1]), slots, stack[1:])
        _difference(self.records[run], simulated, stack[0])
        return RunResult(simulated.angle, simulated.rate, slots, stack, sensitivities.base)

    def command_sensitivities(self, x: FloatArray, run: int, commanded: Sequence[FinPath]) -> FloatArray:
        """Return the first-order change (K, 2, n) of one run's free run with each of K other commands."""
        return self._sensitivities(x, run, ())[1].command_sensitivities(commanded)

    def linearise_chunked(
        self, x: FloatArray, run: int, free: Sequence[int], length: int
    ) -> tuple[tuple[int, ...], Iterator[tuple[slice, FloatArray, FloatArray]]]:
        """Return the free parameters that affect a run, and its samples in chunks: slice, motion (m, 3), sensitivities (P, 2, m).

        Only for effects without sensor terms and extra states: a chunk starts from the last angle and rate of the previous one.
        """
        slots, sensitivities = self._sensitivities(x, run, free)
        return slots, sensitivities.integrate_chunked(slots, length)

    def _sensitivities(self, x: FloatArray, run: int, free: Sequence[int] | None) -> tuple[tuple[int, ...], Sensitivities]:
        record, layout = self.counted[run], self.layout
        wanted = range(len(x)) if free is None else set(free)
        slots = tuple(i for i in (*self._shared_of(run), *layout.nuisances_of(run)) if i in wanted)
        values, base, start, arrays = self._inputs(x, run)
        return slots, Sensitivities(record, layout, self.scales[run], self.authority_of(run), base, values, start, arrays)

    def authority_of(self, run: int) -> str:
        """Return the name of a run's authority parameter."""
        g = self.layout.groups
        return group_name(NAMES[self.layout.axis].authority, g, g.of_run[run])

    def _shared_of(self, run: int) -> Sequence[int]:
        """Return the shared parameters that affect a run, less the authorities of groups to which it does not refer."""
        layout, g = self.layout, self.layout.groups
        if g.by_law or len(g.speeds) == 1:
            return range(layout.shared)
        authority, own = NAMES[layout.axis].authority, {self.authority_of(run)}
        if g.trim_of_fin:
            own.add(authority)
        return [i for i, n in enumerate(layout.names) if n in own or not (n == authority or n.startswith(f"{authority}@"))]

    def start(self) -> FloatArray:
        """Return the start vector of the layout."""
        return np.array([s.start for s in self.layout.parameters])


def _scales(groups: SpeedGroups, run: int) -> tuple[float, float]:
    speed, reference = groups.flown(run), groups.speeds[groups.reference]
    known = isfinite(speed) and isfinite(reference)
    return (speed / reference, groups.over_group(run)) if known else (1.0, 1.0)


def _start_of(values: Values, core: Core) -> FloatArray:
    """Return the initial state (3,): angle, rate, and the steady cross state at the rate before the run."""
    return np.array([values["angle0"], values["rate0"], core.steady_cross_state(values.get("rate_before", 0.0))])


def _difference(record: Record, motion: Motion, out: FloatArray) -> FloatArray:
    """Fill out (2, n) with measured minus simulated, zero where nothing was measured, and return it."""
    np.subtract(record.angle, motion.angle, out=out[0])
    np.subtract(record.rate, motion.rate, out=out[1])
    if not record.is_whole:
        out[~record.ok] = 0.0
    return out
