"""Forward sensitivities: the derivatives of the kernel's inputs by each parameter, integrated along with the motion."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fieldsid.dynamics import integrate
from fieldsid.dynamics.assemble import (
    MOMENT,
    Base,
    KernelInputs,
    combined_core,
    combined_terms,
    fin_path,
    in_order,
    integrate_record,
    measured,
    scaled_fin,
)
from fieldsid.fitting.problem.parameters import START_NAMES, ParameterLayout
from fieldsid.models.axis import NAMES
from fieldsid.models.effect import TERM_PARTS, Effect, Motion, Terms, Values, over_intervals
from fieldsid.models.fin_path import FinPath
from fieldsid.models.hull import (
    CONSTANTS,
    CROSS_DAMPING,
    CROSS_FACTOR,
    CROSS_QUADRATIC,
    CROSS_RATE,
    DAMPING,
    DRIVES,
    FIN,
    STIFFNESS,
    STRIP_FLOW,
    STRIP_FORCE,
    Core,
)
from fieldsid.models.record import Record
from fieldsid.models.speed_law import over_reference
from fieldsid.numerics.arrays import FloatArray

CROSS = START_NAMES.index("rate_before")
EXPONENT_STEP = 1e-4
"""Half width of the central difference by the exponent of the speed law."""

DriveDerivatives = Mapping[int, tuple[float, FloatArray | None]]
"""The derivatives of the drives by one parameter: a factor, and the array (n-1,) that it multiplies, None for ones."""
UNIT_DRIVE = (1.0, None)


@dataclass(frozen=True, slots=True)
class Sensitivities:
    """The derivatives of one record's kernel inputs by each parameter, from which the sensitivities are integrated.

    `scales` are the speed of the record over the reference speed and over the speed of its group; `authority` is the name of its
    authority parameter.
    """

    record: Record
    layout: ParameterLayout
    scales: tuple[float, float]
    authority: str
    base: Base
    values: dict[str, float]
    start: FloatArray
    arrays: KernelInputs
    others: dict[str, Terms] = field(default_factory=dict, init=False, repr=False)
    """Cache of the terms of all effects but one, by the name of that one."""
    paths: dict[str, FinPath] = field(default_factory=dict, init=False, repr=False)
    """Cache of the path of the fin at the input of an actuator effect, by its name."""

    def integrate(self, slots: tuple[int, ...]) -> tuple[FloatArray, FloatArray]:
        """Return the motion (n, 3) before the sensors, and a stack (1 + P, 2, n): an empty residual and the sensitivities."""
        drives, d_c, d_start = self._input_jacobians(slots)
        stack = np.empty((1 + len(slots), 2, len(self.record)))
        out = self._integrate_with_sensitivities(slice(0, len(self.record) - 1), drives, d_c, self.start, d_start, stack[1:])
        return out, stack

    def integrate_chunked(self, slots: tuple[int, ...], length: int) -> Iterator[tuple[slice, FloatArray, FloatArray]]:
        """Yield slice, motion and sensitivities in chunks of `length` intervals; that of the cross state begins at zero."""
        drives, d_c, d_start = self._input_jacobians(slots)
        start, last = self.start, len(self.record) - 1
        for first in range(0, last, length):
            part = slice(first, min(first + length, last))
            sens = np.empty((len(slots), 2, part.stop - part.start + 1))
            out = self._integrate_with_sensitivities(part, drives, d_c, start, d_start, sens)
            start, d_start = out[-1].copy(), np.column_stack([sens[:, :, -1], np.zeros(len(slots))])
            end = part.stop + 1 if part.stop == last else part.stop
            yield slice(first, end), out[: end - first], sens[:, :, : end - first]

    def command_sensitivities(self, commanded: Sequence[FinPath]) -> FloatArray:
        """Return the first-order change (K, 2, n) of angle and rate with each of K other commands, sensors included."""
        a, b, count = self.arrays, self.base.authority, len(commanded)
        paths = [fin_path(self.record, self.layout.effects, self.values, c) for c in commanded]
        own = scaled_fin(a.fin, a.terms)
        drives = []
        for path in paths:
            start, end = (new - old for new, old in zip(scaled_fin(path, a.terms), own, strict=True))
            drives.append({MOMENT[0]: (b, start), MOMENT[1]: (b, end), FIN: (1.0, path.mean - a.fin.mean)})
        all_intervals, d_c, sens = (
            slice(0, len(self.record) - 1),
            np.zeros((count, len(CONSTANTS))),
            np.empty((count, 2, len(self.record))),
        )
        out = self._integrate_with_sensitivities(all_intervals, drives, d_c, self.start, np.zeros((count, 3)), sens)
        self.through_sensors(Motion(out[:, 0], out[:, 1]), (), sens)
        return sens

    def _input_jacobians(self, slots: tuple[int, ...]) -> tuple[list[DriveDerivatives], FloatArray, FloatArray]:
        """Return the derivatives by the parameters: of the drives, of the constants (P, C), of the initial states (P, 3)."""
        count = len(slots)
        drives: list[DriveDerivatives] = []
        d_c, d_start = np.zeros((count, len(CONSTANTS))), np.zeros((count, 3))
        for j, slot in enumerate(slots):
            name = self.layout.every[slot]
            if name in START_NAMES:
                part = START_NAMES.index(name)
                d_start[j, part] = 1.0 if part < CROSS else self.arrays.constants[CROSS_RATE] * self._steady_cross_slope()
                drives.append({})
                continue
            push, constants = self._input_jacobian(name)
            drives.append(push)
            if constants is not None:
                d_c[j] = constants
        if "rate_before" in self.values:
            d_start[:, CROSS] += self._initial_state_derivatives(d_c)
        return drives, d_c, d_start

    def _core(self, values: Values) -> Core:
        return combined_core(self.layout.effects, values, self.scales[0])

    def _initial_state_derivatives(self, d_c: FloatArray) -> FloatArray:
        """Return the derivatives (P,) of the initial cross state by the constants (P, C) at a fixed rate before the run."""
        x, before, c = self.start[CROSS], self.values["rate_before"], self.arrays.constants
        by_flow = 2.0 * c[STRIP_FORCE] * c[STRIP_FLOW] * d_c[:, STRIP_FLOW]
        square = d_c[:, CROSS_QUADRATIC] + d_c[:, STRIP_FORCE] * c[STRIP_FLOW] ** 2 + by_flow
        push = d_c[:, CROSS_RATE] * before + d_c[:, CROSS_DAMPING] * x + square * x * abs(x)
        return np.asarray(push * self._steady_cross_slope())

    def _steady_cross_slope(self) -> float:
        """Return the derivative of the initial cross state by an input of its equation."""
        c = self.arrays.constants
        damping, square = c[CROSS_DAMPING], c[CROSS_QUADRATIC] + c[STRIP_FORCE] * c[STRIP_FLOW] ** 2
        return -1.0 / float(damping + 2.0 * square * abs(self.start[CROSS])) if damping > 0.0 else 0.0

    def _integrate_with_sensitivities(
        self,
        part: slice,
        drives: Sequence[DriveDerivatives],
        d_c: FloatArray,
        start: FloatArray,
        d_start: FloatArray,
        sens: FloatArray,
    ) -> FloatArray:
        """Return motion (m + 1, 3) over the m intervals of a part, and fill sens (P, 2, m + 1)."""
        a, steps = self.arrays, self.record.steps[part]
        place, factor = np.zeros((len(drives), len(DRIVES)), dtype=np.intp), np.zeros((len(drives), len(DRIVES)))
        columns: dict[int, FloatArray] = {}
        known = {id(None): 0}
        for j, own in enumerate(drives):
            for drive, (by, column) in own.items():
                if column is not None:
                    columns[id(column)] = column
                place[j, drive], factor[j, drive] = known.setdefault(id(column), len(known)), by
        rows = np.empty((len(known), steps.size))
        rows[0] = 1.0
        for row, column in zip(rows[1:], columns.values(), strict=True):
            row[:] = column[part]
        out = np.empty((steps.size + 1, 3))
        integrate.integrate_with_sensitivities(
            steps, a.drive[part], a.constants, start, a.pieces, rows, place, factor, d_c, d_start, out, sens
        )
        return out

    def _input_jacobian(self, name: str) -> tuple[DriveDerivatives, FloatArray | None]:
        """Return the derivatives of the drives by a parameter, and of the constants (C,) where there are any."""
        names = NAMES[self.layout.axis]
        share, ratio = self.scales
        exponent = self.values.get("damping_exponent", 1.0)
        if name == names.damping:
            return self._damping(share**exponent), None
        if name == "damping_exponent":
            return self._damping_exponent(self.base.damping * float(np.log(share)), exponent)
        if name == names.authority or name.startswith(f"{names.authority}@"):
            return self._authority(name, ratio**2), None
        if name == names.stiffness:
            return {STIFFNESS: UNIT_DRIVE}, None
        if name == names.trim:
            return self._trim(), None
        return self._of_effect(name)

    def _damping_exponent(self, factor: float, exponent: float) -> tuple[DriveDerivatives, FloatArray | None]:
        """Return the derivatives of the drives, and of the constants (C,), by the exponent of the speed law."""
        of_damping = self._damping(factor)
        if all(e.core is None for e in self.layout.effects):
            return of_damping, None
        up, down = (self._core(self.values | {"damping_exponent": exponent + s}) for s in (EXPONENT_STEP, -EXPONENT_STEP))
        return of_damping, (np.array(up) - np.array(down)) / (2 * EXPONENT_STEP)

    def _damping(self, factor: float) -> DriveDerivatives:
        shape = self.arrays.terms.damping_factor
        return {DAMPING: (factor, None if shape is None else over_intervals(shape))}

    def _trim(self) -> DriveDerivatives:
        """Return the derivatives of the drives by the trim: a constant moment, or one that scales with the authority."""
        if not self.layout.groups.trim_of_fin:
            return {MOMENT[0]: UNIT_DRIVE, MOMENT[1]: UNIT_DRIVE}
        over, shape = self._authority_ratio(), self._authority_shape()
        return {MOMENT[0]: (over, shape[0]), MOMENT[1]: (over, shape[1])}

    def _authority_shape(self) -> tuple[FloatArray | None, FloatArray | None]:
        """Return the authority factor at both ends of each interval, (n-1,) each, none where it is one."""
        factor = self.arrays.terms.authority_factor
        return (None, None) if factor is None else (factor[:-1], factor[1:])

    def _authority_ratio(self) -> float:
        return over_reference(self.base.authority, self.values[NAMES[self.layout.axis].authority])

    def _authority(self, name: str, factor: float) -> DriveDerivatives:
        """Return the derivatives of the drives by an authority: of the fin's moment, and of a trim that scales with it."""
        fin_moment, shape = scaled_fin(self.arrays.fin, self.arrays.terms), self._authority_shape()
        own, moved = name == self.authority, self._trim_derivative(name, factor)
        if not own:
            return {place: (moved, trim) for place, trim in zip(MOMENT, shape, strict=True)}
        if moved == 0.0:
            return {place: (factor, fin) for place, fin in zip(MOMENT, fin_moment, strict=True)}
        both = zip(MOMENT, fin_moment, shape, strict=True)
        return {place: (1.0, factor * fin + (moved if trim is None else moved * trim)) for place, fin, trim in both}

    def _trim_derivative(self, name: str, factor: float) -> float:
        """Return the derivative of the run's trim moment C b / b_reference by an authority."""
        names = NAMES[self.layout.axis]
        trim, at_reference = self.values[names.trim], self.values[names.authority]
        if not self.layout.groups.trim_of_fin or self.authority == names.authority or at_reference == 0.0:
            return 0.0
        by_own = trim / at_reference
        return by_own * factor if name == self.authority else -by_own * self._authority_ratio()

    def _of_effect(self, name: str) -> tuple[DriveDerivatives, FloatArray | None]:
        """Return the derivatives by a coefficient: analytic where the effect has them, else central differences."""
        owner, coefficient = self.layout.owners[name]
        if owner.measure is not None:
            return {}, None
        if owner.slope is not None:
            slope = owner.slope(name, self.values, self.record)
            return {MOMENT[0]: (1.0, slope[:-1]), MOMENT[1]: (1.0, slope[1:])}, None
        step = coefficient.step
        high, low = min(self.values[name] + step, coefficient.high), max(self.values[name] - step, coefficient.low)
        ends = (self.values | {name: high}, self.values | {name: low})
        width = high - low
        drives: dict[int, tuple[float, FloatArray | None]] = {
            place: (1.0 / width, change) for place, change in self._changes(owner, *ends).items()
        }
        if owner.core is None:
            return drives, None
        # the core is the sum of the cores of all effects, so that those of the others do not change
        up, down = (owner.core(values, self.scales[0]) for values in ends)
        return drives, (np.array(up) - np.array(down)) / width

    def _changes(self, owner: Effect, above: Values, below: Values) -> dict[int, FloatArray]:
        """Return the changes (n-1,) of the drives, apart from the core, between two sets of an effect's values, by drive."""
        record = self.record
        if owner.fin is not None:
            return self._changes_of_fin(*(self._path_after(owner, values) for values in (above, below)))
        changes = (
            {} if owner.terms is None else self._changes_of_terms(owner, owner.terms(above, record), owner.terms(below, record))
        )
        if owner.moment is not None:
            path = integrate_record(record, self.arrays, self.start)
            motion = Motion(path[:, 0], path[:, 1])
            moment = owner.moment(motion, above, record) - owner.moment(motion, below, record)
            _add_moment(changes, moment)
        return changes

    def _path_after(self, owner: Effect, values: Values) -> FinPath:
        """Return the path of the fin with other values of an actuator effect; the path at its input is computed once."""
        chain = in_order(self.layout.effects)
        place = chain.index(owner)
        if owner.name not in self.paths:
            self.paths[owner.name] = fin_path(self.record, chain[:place], self.values)
        return fin_path(self.record, chain[place:], values, self.paths[owner.name])

    def _changes_of_fin(self, above: FinPath, below: FinPath) -> dict[int, FloatArray]:
        b, terms = self.base.authority, self.arrays.terms
        sides = zip(MOMENT, scaled_fin(above, terms), scaled_fin(below, terms), strict=True)
        changes = {place: b * (up - down) for place, up, down in sides}
        return changes if self.arrays.core.cross_fin == 0.0 else changes | {FIN: above.mean - below.mean}

    def _changes_of_terms(self, owner: Effect, above: Terms, below: Terms) -> dict[int, FloatArray]:
        changes, base, fin = dict[int, FloatArray](), self.base, self.arrays.fin
        change = _difference_of_terms(above, below, self._terms_of_others(owner))
        if (factor := change.authority_factor) is not None:
            trim = base.trim if base.trim_of_fin else 0.0
            changes[MOMENT[0]] = (base.authority * fin.start + trim) * factor[:-1]
            changes[MOMENT[1]] = (base.authority * fin.end + trim) * factor[1:]
        if change.moment is not None:
            _add_moment(changes, change.moment)
        if change.damping_factor is not None:
            _add(changes, DAMPING, base.damping * over_intervals(change.damping_factor))
        if change.damping is not None:
            _add(changes, DAMPING, over_intervals(change.damping))
        if change.cross_factor is not None:
            changes[CROSS_FACTOR] = over_intervals(change.cross_factor)
        return changes

    def _terms_of_others(self, owner: Effect) -> Terms:
        """Return the terms of all effects but one, computed once."""
        if owner.name not in self.others:
            self.others[owner.name] = combined_terms(self.record, [e for e in self.layout.effects if e is not owner], self.values)
        return self.others[owner.name]

    def through_sensors(self, motion: Motion, slots: tuple[int, ...], sens: FloatArray) -> Motion:
        """Return the motion as the sensors show it, and transform the sensitivities (P, 2, n) in place by each sensor effect."""
        for effect in self.layout.effects:
            if effect.measure is None:
                continue
            shown = effect.measure(motion, self.values, self.record)
            sens[:] = self._sensor_jvp(effect, motion, shown, sens)
            own = {c.name: c.step for c in effect.coefficients}
            for j, slot in enumerate(slots):
                if (name := self.layout.every[slot]) in own:
                    sens[j] = self._sensor_slope(effect, motion, name, own[name])
            motion = shown
        return motion

    def _sensor_jvp(self, effect: Effect, motion: Motion, shown: Motion, sens: FloatArray) -> FloatArray:
        """Return the product of a sensor's Jacobian with sensitivities, by differences where the effect has no derivative.

        A step of 1e-6 rad is so small relative to the scale of any sensor law that a one-sided difference is exact to 1e-6.
        """
        if effect.sensor_jvp is not None:
            return effect.sensor_jvp(sens, motion, self.values, self.record)
        out = sens.copy()
        for j, direction in enumerate(sens):
            size = float(np.max(np.abs(direction)))
            step = 1e-6 / size if size > 0 else 1.0
            out[j] = _difference_quotient(
                measured(_perturbed(motion, direction, step), self.record, [effect], self.values), shown, step
            )
        return out

    def _sensor_slope(self, effect: Effect, motion: Motion, name: str, step: float) -> FloatArray:
        """Return the derivative (2, n) of a sensor's output by a coefficient, by differences where it has no analytic one."""
        if effect.sensor_slope is not None:
            return effect.sensor_slope(name, motion, self.values, self.record)
        ends = (self.values | {name: self.values[name] + s} for s in (step, -step))
        plus, minus = (measured(motion, self.record, [effect], values) for values in ends)
        return _difference_quotient(plus, minus, 2.0 * step)


def _add_moment(changes: dict[int, FloatArray], moment: FloatArray) -> None:
    """Add the change of a moment at the samples (n,) to those of the drives, at both ends of each interval."""
    for place, side in zip(MOMENT, (moment[:-1], moment[1:]), strict=True):
        _add(changes, place, side)


def _add(changes: dict[int, FloatArray], place: int, change: FloatArray) -> None:
    changes[place] = changes[place] + change if place in changes else change


def _difference_of_terms(above: Terms, below: Terms, of_others: Terms) -> Terms:
    """Return the change of each term of one effect between two sets of values; factors are times those of the other effects."""
    changes: dict[str, FloatArray] = {}
    for part, how in TERM_PARTS.items():
        up, down, other = (getattr(terms, part) for terms in (above, below, of_others))
        if up is not None or down is not None:
            is_factor = how is np.multiply
            change = (float(is_factor) if up is None else up) - (float(is_factor) if down is None else down)
            changes[part] = np.asarray(change * other if is_factor and other is not None else change)
    return Terms(**changes)


def _difference_quotient(plus: Motion, minus: Motion, step: float) -> FloatArray:
    """Return the difference quotient of two motions, (2, n)."""
    return np.stack([plus.angle - minus.angle, plus.rate - minus.rate]) / step


def _perturbed(motion: Motion, direction: FloatArray, step: float) -> Motion:
    return Motion(motion.angle + step * direction[0], motion.rate + step * direction[1])
