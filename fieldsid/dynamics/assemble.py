"""The input arrays of the compiled core from a model's parameters, with the actuator effects before it and the sensor after it.

Every hook of every effect is applied in the order of the stages; a model without effects takes the same path.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from math import ceil, sqrt
from operator import attrgetter

import numpy as np

from fieldsid.dynamics import integrate
from fieldsid.dynamics.nonlinear_kernel import MAX_PIECES
from fieldsid.models.effect import Effect, Motion, Terms, Values, over_intervals
from fieldsid.models.fin_path import FinPath
from fieldsid.models.hull import CROSS_FACTOR, DAMPING, DRIVES, FIN, MOMENT_END, MOMENT_START, STIFFNESS, Core
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray

MAX_RATE_STEP_PRODUCT = 0.3
"""Largest product of the length of an RK4 step and the fastest linear rate in it (relative error below 3e-5 a step)."""
MOMENT = (MOMENT_START, MOMENT_END)
NO_CORE, NO_TERMS = Core(), Terms()
MAX_MOMENT_ITERATIONS = 30
MOMENT_TOLERANCE = 1e-9


@dataclass(frozen=True, slots=True)
class Base:
    """Base parameters at the speed of a run: damping (1/s), stiffness (1/s^2), authority (1/s^2), trim (rad/s^2).

    `trim_of_fin`: the trim is an offset of the fin, so that it changes with the authority within a run.
    """

    damping: float
    stiffness: float
    authority: float
    trim: float
    trim_of_fin: bool = False


@dataclass(frozen=True, slots=True)
class KernelInputs:
    """The core's inputs: drive (n-1, 6), constants (C,), RK4 steps per interval; and their sources: fin path, terms, core."""

    drive: FloatArray
    constants: FloatArray
    pieces: int
    fin: FinPath
    terms: Terms
    core: Core


def fin_path(record: Record, effects: Sequence[Effect], values: Values, commanded: FinPath | None = None) -> FinPath:
    """Return the path of the fin angle: that of the log, or of another command, after all actuator effects in their order."""
    path = record.commanded if commanded is None else commanded
    for effect in in_order(effects):
        if effect.fin is not None:
            path = effect.fin(path, values, record)
    return path


def in_order(effects: Sequence[Effect]) -> list[Effect]:
    """Return the actuator effects in the order in which the command passes through them."""
    actuators = [e for e in effects if e.fin is not None]
    return actuators if len(actuators) < 2 else sorted(actuators, key=attrgetter("order"))


def combined_terms(record: Record, effects: Sequence[Effect], values: Values) -> Terms:
    """Return the product of all factors and the sum of all additions of the effects' signal-driven terms."""
    return reduce(Terms.combined_with, (e.terms(values, record) for e in effects if e.terms is not None), NO_TERMS)


def combined_core(effects: Sequence[Effect], values: Values, scale: float) -> Core:
    """Return the sum of the effects' constants of the core; scale is the run's speed over the model's reference speed."""
    cores = [effect.core(values, scale) for effect in effects if effect.core is not None]
    return reduce(Core.plus, cores) if cores else NO_CORE


def assemble(record: Record, effects: Sequence[Effect], base: Base, values: Values, scale: float) -> KernelInputs:
    """Return the core's inputs for one run; scale is the run's speed over the model's reference speed."""
    fin = fin_path(record, effects, values)
    terms = combined_terms(record, effects, values)
    core = combined_core(effects, values, scale)
    drive = np.empty((len(record) - 1, len(DRIVES)))
    drive[:, DAMPING] = damping = damping_of(base, terms)
    drive[:, STIFFNESS] = base.stiffness
    drive[:, MOMENT[0]], drive[:, MOMENT[1]] = moments_of(base, fin, terms)
    drive[:, CROSS_FACTOR] = cross_factor_of(terms)
    drive[:, FIN] = fin.mean
    return KernelInputs(drive, np.array(core), _pieces(record, damping, base.stiffness, core), fin, terms, core)


def damping_of(base: Base, terms: Terms) -> FloatArray | float:
    """Return the damping (1/s) over each interval, (n-1,), or one number where it is constant."""
    damping = base.damping if terms.damping_factor is None else base.damping * over_intervals(terms.damping_factor)
    return damping if terms.damping is None else damping + over_intervals(terms.damping)


def moments_of(base: Base, fin: FinPath, terms: Terms) -> tuple[FloatArray, FloatArray]:
    """Return the moment (rad/s^2) at the start and the end of each interval, (n-1,) each."""
    start, end = (base.authority * side for side in scaled_fin(fin, terms))
    if base.trim_of_fin and terms.authority_factor is not None:
        trim = base.trim * terms.authority_factor
        start, end = start + trim[:-1], end + trim[1:]
    elif base.trim != 0.0:
        start, end = start + base.trim, end + base.trim
    return (start, end) if terms.moment is None else (start + terms.moment[:-1], end + terms.moment[1:])


def cross_factor_of(terms: Terms) -> FloatArray | float:
    """Return g of the cross state's equation, the speed over the run's speed, over each interval, (n-1,), or 1."""
    return 1.0 if terms.cross_factor is None else over_intervals(terms.cross_factor)


def scaled_fin(fin: FinPath, terms: Terms) -> tuple[FloatArray, FloatArray]:
    """Return fin angle times authority factor at the start and the end of each interval, (n-1,) each."""
    if terms.authority_factor is None:
        return fin.start, fin.end
    return fin.start * terms.authority_factor[:-1], fin.end * terms.authority_factor[1:]


def integrate_record(record: Record, assembled: KernelInputs, start: FloatArray) -> FloatArray:
    """Return angle, rate and cross state at the samples, (n, 3)."""
    out = np.empty((len(record), 3))
    integrate.integrate_motion(record.steps, assembled.drive, assembled.constants, start, assembled.pieces, out)
    return out


def with_moments(
    record: Record, assembled: KernelInputs, effects: Sequence[Effect], values: Values, start: FloatArray
) -> KernelInputs:
    """Return the inputs with the state-dependent moments that the core does not compute, iterated to convergence.

    Quasilinearisation: m(y, p) is linearised about the last trajectory, with its slopes added to stiffness and damping, which are
    constant over an interval; at the fixed point the linear terms cancel (Bellman and Kalaba 1965).
    """
    with_moment = [e for e in effects if e.moment is not None]
    if not with_moment:
        return assembled
    path = integrate_record(record, assembled, start)
    current = assembled
    for _ in range(MAX_MOMENT_ITERATIONS):
        if not np.isfinite(path).all():
            return current
        drive = assembled.drive.copy()
        for effect in with_moment:
            _add_moment(drive, effect, Motion(path[:, 0], path[:, 1]), values, record)
        current = replace(assembled, drive=drive, pieces=_pieces(record, drive[:, DAMPING], drive[:, STIFFNESS], assembled.core))
        new = integrate_record(record, current, start)
        change = float(np.max(np.abs(new[:, :2] - path[:, :2])))
        path = new
        if change < MOMENT_TOLERANCE * (1.0 + float(np.max(np.abs(new[:, :2])))):
            break
    return current


def measured(motion: Motion, record: Record, effects: Sequence[Effect], values: Values) -> Motion:
    """Return the motion as the sensors measure it, after all sensor effects."""
    for effect in effects:
        if effect.measure is not None:
            motion = effect.measure(motion, values, record)
    return motion


def _add_moment(drive: FloatArray, effect: Effect, motion: Motion, values: Values, record: Record) -> None:
    if effect.moment is None:
        return
    step = 1e-5
    value = effect.moment(motion, values, record)
    by_angle = (
        effect.moment(Motion(motion.angle + step, motion.rate), values, record)
        - effect.moment(Motion(motion.angle - step, motion.rate), values, record)
    ) / (2 * step)
    by_rate = (
        effect.moment(Motion(motion.angle, motion.rate + step), values, record)
        - effect.moment(Motion(motion.angle, motion.rate - step), values, record)
    ) / (2 * step)
    slope_y, slope_p = over_intervals(by_angle), over_intervals(by_rate)
    drive[:, DAMPING] -= slope_p
    drive[:, STIFFNESS] -= slope_y
    drive[:, MOMENT_START] += value[:-1] - slope_p * motion.rate[:-1] - slope_y * motion.angle[:-1]
    drive[:, MOMENT_END] += value[1:] - slope_p * motion.rate[1:] - slope_y * motion.angle[1:]


def pieces_for(step: float, *rates: float) -> int:
    """Return the number of RK4 steps for an interval of `step` s whose dynamics have these rates (1/s)."""
    return ceil(min(max(1.0, step * max(rates) / MAX_RATE_STEP_PRODUCT), MAX_PIECES))


def _pieces(record: Record, damping: FloatArray | float, stiffness: FloatArray | float, core: Core) -> int:
    cross = abs(core.cross_damping), sqrt(abs(core.cross_rate))
    return pieces_for(record.longest, _largest(damping), sqrt(_largest(stiffness)), *cross)


def _largest(values: FloatArray | float) -> float:
    """Return the largest absolute value of an array or a number."""
    return max(float(values.max()), -float(values.min())) if isinstance(values, np.ndarray) else abs(values)
