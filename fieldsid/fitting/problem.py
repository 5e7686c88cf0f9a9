"""A joint fit as a function: parameters in, free-run residuals and exact sensitivities of every run out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from math import isfinite

import numpy as np

from fieldsid.fitting.effort import count
from fieldsid.fitting.layout import START_NAMES, Layout, group_name, layout_of
from fieldsid.fitting.pushes import Pushes
from fieldsid.logs.run import FloatArray
from fieldsid.models.axis import NAMES
from fieldsid.models.effect import Effect, FinPath, Motion, Values
from fieldsid.models.record import Record, first_part
from fieldsid.models.signal_path import (
    Assembled,
    Base,
    assemble,
    combined_core,
    measured,
    run_core,
    with_moments,
)
from fieldsid.models.speed_law import over_reference

REMEMBERED = 20_000
"""Samples of the longest run whose arrays are kept for the next call."""


@dataclass(frozen=True, slots=True)
class RunResult:
    """One run's free run: measured-like angle and rate (n,); stack (1 + P, 2, n) of its residual and sensitivities of `slots`."""

    angle: FloatArray
    rate: FloatArray
    slots: tuple[int, ...]
    stack: FloatArray
    base: Base

    @property
    def residual(self) -> FloatArray:
        """Measured minus simulated, (2, n), zero where nothing was measured."""
        return np.asarray(self.stack[0])

    @property
    def sensitivity(self) -> FloatArray:
        """Derivatives of what the sensors show by the slots, (P, 2, n)."""
        return np.asarray(self.stack[1:])


@dataclass(frozen=True, slots=True)
class Problem:
    """Records and the layout of what is estimated from them; `known` holds each run's arrays of the last call."""

    records: tuple[Record, ...]
    layout: Layout
    known: dict[int, tuple[tuple[object, ...], Assembled]] = field(default_factory=dict, compare=False, repr=False)

    def first(self, samples: int) -> Problem:
        """Return the problem on the first samples of every run; itself where none is longer."""
        if all(len(r) <= samples for r in self.records):
            return self
        return Problem(tuple(first_part(r, samples) for r in self.records), self.layout)

    def with_effects(self, effects: Sequence[Effect]) -> Problem:
        """Return the problem of the same records and speed groups with other effects."""
        return Problem(self.records, layout_of(self.records, self.layout.axis, effects, self.layout.groups))

    def base_of(self, x: FloatArray, run: int) -> Base:
        """Return a run's base parameters."""
        return self._base(dict(zip(self.layout.names, x[: self.layout.shared].tolist(), strict=True)), run)

    def _base(self, v: Values, run: int) -> Base:
        names, layout = NAMES[self.layout.axis], self.layout
        share, ratio = self.scales(run)
        authority = v[self.authority_of(run)] * ratio**2
        return Base(
            v[names.damping] * share ** v.get("damping_exponent", layout.groups.exponent),
            0.0 if names.stiffness is None else v[names.stiffness],
            authority,
            v[names.trim] * (over_reference(authority, v[names.authority]) if layout.groups.trim_of_fin else 1.0),
            layout.groups.trim_of_fin,
        )

    def scales(self, run: int) -> tuple[float, float]:
        """Return speed over reference speed, and speed over the one that the run's authority slot belongs to."""
        g = self.layout.groups
        speed = g.run_speeds[run]
        if not isfinite(speed) or not isfinite(g.speeds[g.reference]):
            return 1.0, 1.0
        return speed / g.speeds[g.reference], g.over_group(run)

    def values_of(self, x: FloatArray, run: int) -> dict[str, float]:
        """Return the effects' coefficients as a run sees them."""
        layout, numbers = self.layout, x.tolist()
        values = {"damping_exponent": layout.groups.exponent} | dict(zip(layout.names, numbers, strict=False))
        for place in layout.of_run(run):
            values[layout.every[place]] = numbers[place]
        return values

    def state_of(self, x: FloatArray, run: int) -> tuple[float, float, float]:
        """Return a run's initial state: angle, rate, and the cross state that the rate before the run has led to."""
        angle, rate, cross = self._start_of(self.values_of(x, run), run)
        return float(angle), float(rate), float(cross)

    def _start_of(self, values: Values, run: int) -> FloatArray:
        before = values.get("rate_before")
        core = None if before is None else combined_core(self.layout.effects, values, self.scales(run)[0])
        return np.array([values["angle0"], values["rate0"], 0.0 if core is None or before is None else core.settled(before)])

    def _arrays(self, base: Base, values: Values, run: int) -> Assembled:
        """Return the core's arrays, those of the last call where nothing but the run's start has changed."""
        key = (base, *(v for name, v in values.items() if name not in START_NAMES))
        last, record = self.known.get(run), self.records[run]
        if last is not None and last[0] == key:
            return last[1]
        arrays = assemble(record, self.layout.effects, base, values, self.scales(run)[0])
        if len(record) <= REMEMBERED:
            self.known[run] = key, arrays
        return arrays

    def simulate(self, x: FloatArray, run: int) -> tuple[Motion, Base]:
        """Return one run's free run as the sensors would show it."""
        count()
        record, effects = self.records[run], self.layout.effects
        values = self.values_of(x, run)
        base, start = self._base(values, run), self._start_of(values, run)
        arrays = with_moments(record, self._arrays(base, values, run), effects, values, start)
        out = run_core(record, arrays, start)
        return measured(Motion(out[:, 0], out[:, 1]), record, effects, values), base

    def residual(self, x: FloatArray, run: int) -> tuple[FloatArray, Base]:
        """Return measured minus simulated, (2, n), zero where nothing was measured; and the run's base."""
        motion, base = self.simulate(x, run)
        return _difference(self.records[run], motion, np.empty((2, len(self.records[run])))), base

    def linearise(self, x: FloatArray, run: int, free: Sequence[int] | None = None) -> RunResult:
        """Return one run's free run with its sensitivities to the free slots that touch it."""
        count()
        slots, pushes = self._pushes(x, run, free)
        out, stack = pushes.integrate(slots)
        shown = pushes.through_sensors(Motion(out[:, 0], out[:, 1]), slots, stack[1:])
        _difference(self.records[run], shown, stack[0])
        return RunResult(shown.angle, shown.rate, slots, stack, pushes.base)

    def along(self, x: FloatArray, run: int, commanded: Sequence[FinPath]) -> FloatArray:
        """Return how one run's free run would move with each of K other commands, to first order, (K, 2, n)."""
        return self._pushes(x, run, ())[1].along(commanded)

    def pieces(
        self, x: FloatArray, run: int, free: Sequence[int], length: int
    ) -> tuple[tuple[int, ...], Iterator[tuple[slice, FloatArray, FloatArray]]]:
        """Return the free slots that touch a run, and its samples in pieces: which, motion (m, 3), sensitivities (P, 2, m).

        For effects without sensor and extra states only: a piece starts from the angle and rate the last one ended at.
        """
        slots, pushes = self._pushes(x, run, free)
        return slots, pushes.integrate_pieces(slots, length)

    def _pushes(self, x: FloatArray, run: int, free: Sequence[int] | None) -> tuple[tuple[int, ...], Pushes]:
        record, layout = self.records[run], self.layout
        values = self.values_of(x, run)
        base, start = self._base(values, run), self._start_of(values, run)
        wanted = range(len(x)) if free is None else set(free)
        slots = tuple(i for i in (*self._shared_of(run), *layout.of_run(run)) if i in wanted)
        arrays = with_moments(record, self._arrays(base, values, run), layout.effects, values, start)
        return slots, Pushes(record, layout, self.scales(run), self.authority_of(run), base, values, start, arrays)

    def authority_of(self, run: int) -> str:
        """Return the name of a run's authority slot."""
        g = self.layout.groups
        return group_name(NAMES[self.layout.axis].authority, g, g.of_run[run])

    def _shared_of(self, run: int) -> Sequence[int]:
        """Return the shared slots that enter a run: another speed group's authority does not, unless the trim refers to it."""
        layout, g = self.layout, self.layout.groups
        if g.by_law or len(g.speeds) == 1:
            return range(layout.shared)
        authority, own = NAMES[layout.axis].authority, {self.authority_of(run)}
        if g.trim_of_fin:
            own.add(authority)
        return [i for i, n in enumerate(layout.names) if n in own or not (n == authority or n.startswith(f"{authority}@"))]

    def start(self) -> FloatArray:
        """Return the start vector of the layout."""
        return np.array([s.start for s in self.layout.slots])


def _difference(record: Record, motion: Motion, out: FloatArray) -> FloatArray:
    """Fill out (2, n) with measured minus shown, zero where nothing was measured, and return it."""
    np.subtract(record.angle, motion.angle, out=out[0])
    np.subtract(record.rate, motion.rate, out=out[1])
    if not record.is_whole:
        out[~record.ok] = 0.0
    return out
