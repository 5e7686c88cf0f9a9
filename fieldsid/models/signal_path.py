"""From parameters to the arrays the compiled core takes: the actuator before it, the sensor after it.

One code path for effects present and absent: every hook of every effect is applied in its stage's order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from fieldsid.logs.run import FloatArray
from fieldsid.models import kernels
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Core, Effect, FinPath, Motion, Terms, Values, held
from fieldsid.models.record import Record

LONGEST_PIECE = 0.3
"""Largest product of step and fastest linear rate of one RK4 piece (relative error below 3e-5 of a step)."""
MOMENT_ROUNDS = 30
MOMENT_TOLERANCE = 1e-9


@dataclass(frozen=True, slots=True)
class Base:
    """Base parameters at a run's own speed: damping (1/s), stiffness (1/s^2), authority (1/s^2), trim (rad/s^2).

    trim_of_fin: the trim is a bent fin's, so that whatever changes the authority within a run changes it too.
    """

    damping: float
    stiffness: float
    authority: float
    trim: float
    trim_of_fin: bool = False


@dataclass(frozen=True, slots=True)
class Assembled:
    """Arrays of the core: drive (n-1, 8), constants (14,), pieces per interval; what they came from: fin path, terms, core."""

    drive: FloatArray
    constants: FloatArray
    pieces: int
    fin: FinPath
    terms: Terms
    core: Core


def fin_path(record: Record, effects: Sequence[Effect], values: Values, commanded: FinPath | None = None) -> FinPath:
    """Return the fin angle over the intervals after the actuator effects, in their order, of the log's or another command."""
    path = record.commanded if commanded is None else commanded
    for effect in sorted((e for e in effects if e.fin is not None), key=lambda e: e.order):
        if effect.fin is not None:
            path = effect.fin(path, values, record)
    return path


def combined_terms(record: Record, effects: Sequence[Effect], values: Values) -> Terms:
    """Return the product of all factors and the sum of all additions of the effects' signal-driven terms."""
    damping_factor: FloatArray | None = None
    authority_factor: FloatArray | None = None
    moment: FloatArray | None = None
    damping: FloatArray | None = None
    cross_factor: FloatArray | None = None
    for effect in effects:
        if effect.terms is None:
            continue
        t = effect.terms(values, record)
        damping_factor = _times(damping_factor, t.damping_factor)
        authority_factor = _times(authority_factor, t.authority_factor)
        moment = _plus(moment, t.moment)
        damping = _plus(damping, t.damping)
        cross_factor = _times(cross_factor, t.cross_factor)
    return Terms(damping_factor, authority_factor, moment, damping, cross_factor)


def combined_core(effects: Sequence[Effect], values: Values, scale: float) -> Core:
    """Return the sum of the effects' coefficients in the core; scale is the run's speed over the model's reference speed."""
    own = [effect.core(values, scale) for effect in effects if effect.core is not None]
    return reduce(Core.plus, own) if own else Core()


def assemble(record: Record, effects: Sequence[Effect], base: Base, values: Values, scale: float) -> Assembled:
    """Return the core's arrays for one run; scale is the run's speed over the model's reference speed."""
    fin = fin_path(record, effects, values)
    terms = combined_terms(record, effects, values)
    core = combined_core(effects, values, scale)
    drive = np.empty((len(record) - 1, len(kernels.DRIVES)))
    for place in range(len(kernels.DRIVES)):
        drive[:, place] = drive_of(place, record, base, fin, terms, core)
    constants = constants_of(core)
    return Assembled(drive, constants, _pieces(record, drive, constants), fin, terms, core)


def drive_of(place: int, record: Record, base: Base, fin: FinPath, terms: Terms, core: Core) -> FloatArray | float:
    """Return one of the core's drives, (n-1,) or the same over every interval."""
    match kernels.DRIVES[place]:
        case "damping":
            damping = base.damping if terms.damping_factor is None else base.damping * held(terms.damping_factor)
            return damping if terms.damping is None else damping + held(terms.damping)
        case "stiffness":
            return base.stiffness
        case "moment_start" | "moment_end" as end:
            return _moment(end, base, fin, terms)
        case "cross_factor":
            return 1.0 if terms.cross_factor is None else held(terms.cross_factor)
        case "cross_push":
            return core.cross_fin * fin.mean if core.cross_fin != 0.0 else 0.0
        case flow:
            return _flow(flow, record) if core.crossflow != 0.0 else 0.0


def _moment(end: str, base: Base, fin: FinPath, terms: Terms) -> FloatArray:
    side, of_time = (0, slice(None, -1)) if end == "moment_start" else (1, slice(1, None))
    factor = terms.authority_factor if base.trim_of_fin else None
    trim = base.trim if factor is None else base.trim * factor[of_time]
    moment = base.authority * lift(fin, terms)[side] + trim
    return moment if terms.moment is None else moment + terms.moment[of_time]


def _flow(end: str, record: Record) -> FloatArray:
    # pitch: the local normal speed is w - x q, so that the flow seen by +q is -w
    cross = record["cross"] if record.axis is Axis.YAW else -record["cross"]
    return cross[:-1] if end == "flow_start" else cross[1:]


def constants_of(core: Core) -> FloatArray:
    """Return a core's coefficients as the vector (14,) that the kernel takes; the fin's push on the cross state is a drive."""
    return np.array([getattr(core, name) for name in kernels.CONSTANTS])


def lift(fin: FinPath, terms: Terms) -> tuple[FloatArray, FloatArray]:
    """Return fin angle times the authority factor at both ends of each interval, (n-1,) each."""
    if terms.authority_factor is None:
        return fin.start, fin.end
    return fin.start * terms.authority_factor[:-1], fin.end * terms.authority_factor[1:]


def run_core(record: Record, assembled: Assembled, start: FloatArray) -> FloatArray:
    """Return angle, rate and cross state at the samples, (n, 3)."""
    out = np.empty((len(record), 3))
    kernels.simulate(record.steps, assembled.drive, assembled.constants, start, assembled.pieces, out)
    return out


def with_moments(record: Record, assembled: Assembled, effects: Sequence[Effect], values: Values, start: FloatArray) -> Assembled:
    """Return the arrays with every state-dependent moment the core does not know, iterated to convergence.

    Quasilinearisation: m(y, p) is replaced by its value and slopes along the last trajectory, the slopes joining
    the held stiffness and damping; at the fixed point the slopes cancel (Bellman and Kalaba 1965).
    """
    own = [e for e in effects if e.moment is not None]
    if not own:
        return assembled
    path = run_core(record, assembled, start)
    current = assembled
    for _ in range(MOMENT_ROUNDS):
        if not np.isfinite(path).all():
            return current
        drive = assembled.drive.copy()
        for effect in own:
            _add_moment(drive, effect, Motion(path[:, 0], path[:, 1]), values, record)
        current = replace(assembled, drive=drive, pieces=_pieces(record, drive, assembled.constants))
        new = run_core(record, current, start)
        change = float(np.max(np.abs(new[:, :2] - path[:, :2])))
        path = new
        if change < MOMENT_TOLERANCE * (1.0 + float(np.max(np.abs(new[:, :2])))):
            break
    return current


def measured(motion: Motion, record: Record, effects: Sequence[Effect], values: Values) -> Motion:
    """Return what the sensors show of a motion."""
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
    slope_y, slope_p = held(by_angle), held(by_rate)
    drive[:, 0] -= slope_p
    drive[:, 1] -= slope_y
    drive[:, 2] += value[:-1] - slope_p * motion.rate[:-1] - slope_y * motion.angle[:-1]
    drive[:, 3] += value[1:] - slope_p * motion.rate[1:] - slope_y * motion.angle[1:]


def pieces_for(step: float, *rates: float) -> int:
    """Return the RK4 pieces of an interval of `step` s whose dynamics have these rates (1/s)."""
    return int(min(max(1, np.ceil(step * max(rates) / LONGEST_PIECE)), 200))


def _pieces(record: Record, drive: FloatArray, constants: FloatArray) -> int:
    damping, stiffness = drive[:, 0], drive[:, 1]
    slow = float(np.sqrt(max(float(stiffness.max()), -float(stiffness.min()), 0.0)))
    cross = abs(float(constants[7])), float(np.sqrt(abs(float(constants[8]))))
    return pieces_for(float(record.steps.max()), float(damping.max()), -float(damping.min()), slow, *cross)


def _times(a: FloatArray | None, b: FloatArray | None) -> FloatArray | None:
    if a is None or b is None:
        return a if b is None else b
    return a * b


def _plus(a: FloatArray | None, b: FloatArray | None) -> FloatArray | None:
    if a is None or b is None:
        return a if b is None else b
    return a + b
