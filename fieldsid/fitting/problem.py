"""A joint fit as a function: parameters in, free-run residuals and exact sensitivities of every run out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fieldsid.fitting.layout import START_NAMES, Layout, group_name
from fieldsid.logs.run import FloatArray
from fieldsid.models import kernels
from fieldsid.models.axis import NAMES
from fieldsid.models.effect import Coefficient, Core, Motion, Values
from fieldsid.models.record import Record, first_part
from fieldsid.models.signal_path import (
    Assembled,
    Base,
    assemble,
    combined_core,
    constants_of,
    lift,
    measured,
    run_core,
    with_moments,
)

CROSS = START_NAMES.index("rate_before")
DAMPING, RATE = (kernels.CONSTANTS.index(name) for name in ("cross_damping", "cross_rate"))
EXPONENT = 1e-4
"""Half width of the central difference by the exponent of the speed law."""


@dataclass(frozen=True, slots=True)
class RunResult:
    """One run's free run: measured-like angle and rate (n,), residual (2, n), sensitivities (P, 2, n) of `slots`."""

    angle: FloatArray
    rate: FloatArray
    residual: FloatArray
    slots: tuple[int, ...]
    sensitivity: FloatArray
    base: Base


@dataclass(frozen=True, slots=True)
class Problem:
    """Records and the layout of what is estimated from them."""

    records: tuple[Record, ...]
    layout: Layout

    def first(self, samples: int) -> Problem:
        """Return the problem on the first samples of every run; itself where none is longer."""
        if all(len(r) <= samples for r in self.records):
            return self
        return Problem(tuple(first_part(r, samples) for r in self.records), self.layout)

    def base_of(self, x: FloatArray, run: int) -> Base:
        """Return a run's base parameters."""
        names, layout = NAMES[self.layout.axis], self.layout
        v = dict(zip(layout.names, x[: layout.shared], strict=True))
        group = layout.groups.of_run[run]
        share, ratio = self.scales(run)
        return Base(
            v[names.damping] * share ** v.get("damping_exponent", layout.exponent),
            0.0 if names.stiffness is None else v[names.stiffness],
            v[group_name(names.authority, layout.groups, group)] * ratio**2,
            v[names.trim],
        )

    def scales(self, run: int) -> tuple[float, float]:
        """Return speed over reference speed, and speed over the speed of the run's own group."""
        g = self.layout.groups
        speed = g.run_speeds[run]
        if not np.isfinite(speed) or not np.isfinite(g.speeds[g.reference]):
            return 1.0, 1.0
        return speed / g.speeds[g.reference], speed / g.speeds[g.of_run[run]]

    def values_of(self, x: FloatArray, run: int) -> dict[str, float]:
        """Return the effects' coefficients as a run sees them."""
        layout = self.layout
        own = {layout.slots[i].name: float(x[i]) for i in layout.of_run(run)}
        law = {"damping_exponent": layout.exponent}
        return law | dict(zip(layout.names, x[: layout.shared].tolist(), strict=True)) | own

    def state_of(self, x: FloatArray, run: int) -> tuple[float, float, float]:
        """Return a run's initial state: angle, rate, and the cross state that the rate before the run has led to."""
        values = self.values_of(x, run)
        core = combined_core(self.layout.effects, values, self.scales(run)[0])
        return values["angle0"], values["rate0"], core.settled(values.get("rate_before", 0.0))

    def simulate(self, x: FloatArray, run: int) -> tuple[Motion, Base]:
        """Return one run's free run as the sensors would show it."""
        record, effects = self.records[run], self.layout.effects
        base, values = self.base_of(x, run), self.values_of(x, run)
        start = np.array(self.state_of(x, run))
        arrays = assemble(record, effects, base, values, self.scales(run)[0])
        arrays = with_moments(record, arrays, effects, values, start)
        out = run_core(record, arrays, start)
        return measured(Motion(out[:, 0], out[:, 1]), record, effects, values), base

    def residual(self, x: FloatArray, run: int) -> tuple[FloatArray, Base]:
        """Return measured minus simulated, (2, n), zero where nothing was measured; and the run's base."""
        motion, base = self.simulate(x, run)
        return _difference(self.records[run], motion), base

    def linearise(self, x: FloatArray, run: int, free: Sequence[int] | None = None) -> RunResult:
        """Return one run's free run with its sensitivities to the free slots that touch it."""
        slots, pushes = self._pushes(x, run, free)
        out, sens = pushes.integrate(slots)
        motion = Motion(out[:, 0], out[:, 1])
        shown, sens = pushes.through_sensors(motion, slots, sens)
        return RunResult(shown.angle, shown.rate, _difference(self.records[run], shown), slots, sens, pushes.base)

    def pieces(
        self, x: FloatArray, run: int, free: Sequence[int], length: int
    ) -> tuple[tuple[int, ...], Iterator[tuple[slice, FloatArray, FloatArray]]]:
        """Return the free slots that touch a run, and its samples in pieces: which, motion (m, 3), sensitivities (P, 2, m).

        For effects without sensor and extra states only: a piece starts from the angle and rate the last one ended at.
        """
        slots, pushes = self._pushes(x, run, free)
        return slots, pushes.integrate_pieces(slots, length)

    def _pushes(self, x: FloatArray, run: int, free: Sequence[int] | None) -> tuple[tuple[int, ...], _Pushes]:
        record, layout = self.records[run], self.layout
        values, base = self.values_of(x, run), self.base_of(x, run)
        start, scale = np.array(self.state_of(x, run)), self.scales(run)[0]
        wanted = set(range(len(x)) if free is None else free)
        slots = tuple(i for i in (*range(layout.shared), *layout.of_run(run)) if i in wanted and self._touches(i, run))
        raw = assemble(record, layout.effects, base, values, scale)
        arrays = with_moments(record, raw, layout.effects, values, start)
        return slots, _Pushes(self, run, base, values, start, scale, raw, arrays)

    def authority_of(self, run: int) -> str:
        """Return the name of a run's authority slot."""
        g = self.layout.groups
        return group_name(NAMES[self.layout.axis].authority, g, g.of_run[run])

    def _touches(self, slot: int, run: int) -> bool:
        """Whether a shared slot enters a run: another speed group's authority does not."""
        names, name = NAMES[self.layout.axis], self.layout.slots[slot].name
        if name == names.authority or name.startswith(f"{names.authority}@"):
            return name == self.authority_of(run)
        return True

    def start(self) -> FloatArray:
        """Return the start vector of the layout."""
        return np.array([s.start for s in self.layout.slots])


def _difference(record: Record, motion: Motion) -> FloatArray:
    return np.stack(
        [
            np.where(record.angle_ok, record.angle - motion.angle, 0.0),
            np.where(record.rate_ok, record.rate - motion.rate, 0.0),
        ]
    )


Push = Callable[[slice, FloatArray], None]
"""Fills a part (m, 8), zero before, with the derivatives of the drives by one number."""


@dataclass(frozen=True, slots=True)
class _Pushes:
    """What each slot does to the core's arrays of one run: the input of its tangents."""

    problem: Problem
    run: int
    base: Base
    values: dict[str, float]
    start: FloatArray
    scale: float
    raw: Assembled
    arrays: Assembled

    @property
    def record(self) -> Record:
        return self.problem.records[self.run]

    def integrate(self, slots: tuple[int, ...]) -> tuple[FloatArray, FloatArray]:
        """Return motion (n, 3) and sensitivities (P, 2, n) before the sensor."""
        rows, which, d_c, d_start = self._directions(slots)
        return self._march(slice(0, len(self.record) - 1), rows, which, d_c, self.start, d_start)

    def integrate_pieces(self, slots: tuple[int, ...], length: int) -> Iterator[tuple[slice, FloatArray, FloatArray]]:
        """Yield the same in pieces of `length` intervals, without the cross state's sensitivity from piece to piece."""
        rows, which, d_c, d_start = self._directions(slots)
        start, last = self.start, len(self.record) - 1
        for first in range(0, last, length):
            part = slice(first, min(first + length, last))
            out, sens = self._march(part, rows, which, d_c, start, d_start)
            start, d_start = out[-1].copy(), np.column_stack([sens[:, :, -1], np.zeros(len(slots))])
            end = part.stop + 1 if part.stop == last else part.stop
            yield slice(first, end), out[: end - first], sens[:, :, : end - first]

    def _directions(self, slots: tuple[int, ...]) -> tuple[list[Push], FloatArray, FloatArray, FloatArray]:
        """Return what the slots push: drives of a part, whose they are (P,), constants (P, 9), initial states (P, 3)."""
        count = len(slots)
        rows: list[Push] = []
        which, d_c, d_start = np.full(count, -1.0), np.zeros((count, len(kernels.CONSTANTS))), np.zeros((count, 3))
        for j, slot in enumerate(slots):
            name = self.problem.layout.slots[slot].name
            if name in START_NAMES:
                part = START_NAMES.index(name)
                d_start[j, part] = 1.0 if part < CROSS else self._core(self.values).settled(1.0)
                continue
            push, d_c[j] = self._push(name)
            d_start[j, CROSS] = self._moves_start(d_c[j])
            if push is not None:
                which[j] = len(rows)
                rows.append(push)
        return rows, which, d_c, d_start

    def _core(self, values: Values) -> Core:
        return combined_core(self.problem.layout.effects, values, self.scale)

    def _moves_start(self, d_c: FloatArray) -> float:
        """Return how the start of the cross state moves with the core's constants (9,), the rate before the run held."""
        damping, d_damping, d_rate = self.arrays.constants[DAMPING], d_c[DAMPING], d_c[RATE]
        before = self.values.get("rate_before", 0.0)
        return -float(d_rate * before + d_damping * self.start[CROSS]) / damping if damping > 0.0 else 0.0

    def _march(
        self, part: slice, rows: list[Push], which: FloatArray, d_c: FloatArray, start: FloatArray, d_start: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return motion (m + 1, 3) and sensitivities (P, 2, m + 1) over the m intervals of a part."""
        a, steps = self.arrays, self.record.steps[part]
        drives = np.zeros((len(rows), steps.size, len(kernels.DRIVES)))
        for row, push in zip(drives, rows, strict=True):
            push(part, row)
        out, sens = np.empty((steps.size + 1, 3)), np.empty((which.size, 2, steps.size + 1))
        kernels.tangents(steps, a.drive[part], a.constants, start, a.pieces, drives, which, d_c, d_start, out, sens)
        return out, sens

    def _push(self, name: str) -> tuple[Push | None, FloatArray]:
        names = NAMES[self.problem.layout.axis]
        none = np.zeros(len(kernels.CONSTANTS))
        share, ratio = self.problem.scales(self.run)
        exponent = self.values.get("damping_exponent", 1.0)
        if name == names.damping:
            return self._damping(share**exponent), none
        if name == "damping_exponent":
            return self._damping(self.base.damping * float(np.log(share))), self._by_exponent(exponent)
        if name == names.authority or name.startswith(f"{names.authority}@"):
            return self._authority(ratio**2), none
        if name == names.stiffness:
            return _constant(slice(1, 2)), none
        if name == names.trim:
            return _constant(slice(2, 4)), none
        return self._of_effect(name)

    def _by_exponent(self, exponent: float) -> FloatArray:
        """Return how the core's constants move with the exponent of the damping's speed law, (9,)."""
        ends = [constants_of(self._core(self.values | {"damping_exponent": exponent + s})) for s in (EXPONENT, -EXPONENT)]
        return (ends[0] - ends[1]) / (2 * EXPONENT)

    def _damping(self, factor: float) -> Push:
        shape = self.arrays.terms.damping_factor

        def push(part: slice, row: FloatArray) -> None:
            row[:, 0] = factor if shape is None else factor * 0.5 * (shape[:-1][part] + shape[1:][part])

        return push

    def _authority(self, factor: float) -> Push:
        start, end = lift(self.arrays.fin, self.arrays.terms)

        def push(part: slice, row: FloatArray) -> None:
            row[:, 2], row[:, 3] = factor * start[part], factor * end[part]

        return push

    def _of_effect(self, name: str) -> tuple[Push | None, FloatArray]:
        """Central difference of the arrays by an effect's coefficient; they are cheap, and no motion enters."""
        layout, coefficient = self.problem.layout, self._coefficient(name)
        owner = next(e for e in layout.effects if any(c.name == name for c in e.coefficients))
        if owner.measure is not None:
            return None, np.zeros(len(kernels.CONSTANTS))
        step = coefficient.step
        high, low = min(self.values[name] + step, coefficient.high), max(self.values[name] - step, coefficient.low)
        if owner.fin is None and owner.terms is None and owner.moment is None and owner.core is not None:
            ends = [owner.core(self.values | {name: value}, self.scale) for value in (high, low)]
            if ends[0].cross_fin == ends[1].cross_fin:
                return None, (constants_of(ends[0]) - constants_of(ends[1])) / (high - low)
        assembled = []
        for value in (high, low):
            shifted = self.values | {name: value}
            arrays = assemble(self.record, layout.effects, self.base, shifted, self.scale, self.arrays.pieces)
            assembled.append(self._with_own_moment(arrays, shifted))
        d_drive = (assembled[0].drive - assembled[1].drive) / (high - low)
        d_c = (assembled[0].constants - assembled[1].constants) / (high - low)
        return (_known(d_drive) if d_drive.any() else None), d_c

    def _with_own_moment(self, arrays: Assembled, values: dict[str, float]) -> Assembled:
        """Add the state-dependent moments along the converged motion, their slopes left out of the difference."""
        own = [e for e in self.problem.layout.effects if e.moment is not None]
        if not own:
            return arrays
        path = run_core(self.record, self.arrays, self.start)
        drive = arrays.drive.copy()
        for effect in own:
            if effect.moment is not None:
                value = effect.moment(Motion(path[:, 0], path[:, 1]), values, self.record)
                drive[:, 2] += value[:-1]
                drive[:, 3] += value[1:]
        return Assembled(drive, arrays.constants, arrays.pieces, arrays.fin, arrays.terms)

    def _coefficient(self, name: str) -> Coefficient:
        return next(c for e in self.problem.layout.effects for c in e.coefficients if c.name == name)

    def through_sensors(self, motion: Motion, slots: tuple[int, ...], sens: FloatArray) -> tuple[Motion, FloatArray]:
        """Return what the sensors show, with the sensitivities carried through them by directional differences."""
        effects = self.problem.layout.effects
        if all(e.measure is None for e in effects):
            return motion, sens
        shown = measured(motion, self.record, effects, self.values)
        out = np.empty_like(sens)
        sensor_names = {c.name: c for e in effects if e.measure is not None for c in e.coefficients}
        for j, slot in enumerate(slots):
            name = self.problem.layout.slots[slot].name
            if name in sensor_names:
                step = sensor_names[name].step
                plus = measured(motion, self.record, effects, self.values | {name: self.values[name] + step})
                minus = measured(motion, self.record, effects, self.values | {name: self.values[name] - step})
            else:
                size = float(np.max(np.abs(sens[j])))
                step = 1e-6 / size if size > 0 else 1.0
                plus = measured(_moved(motion, sens[j], step), self.record, effects, self.values)
                minus = measured(_moved(motion, sens[j], -step), self.record, effects, self.values)
            out[j, 0] = (plus.angle - minus.angle) / (2 * step)
            out[j, 1] = (plus.rate - minus.rate) / (2 * step)
        return shown, out


def _constant(columns: slice) -> Push:
    def push(_part: slice, row: FloatArray) -> None:
        row[:, columns] = 1.0

    return push


def _known(d_drive: FloatArray) -> Push:
    def push(part: slice, row: FloatArray) -> None:
        row[:] = d_drive[part]

    return push


def _moved(motion: Motion, direction: FloatArray, step: float) -> Motion:
    return Motion(motion.angle + step * direction[0], motion.rate + step * direction[1])
