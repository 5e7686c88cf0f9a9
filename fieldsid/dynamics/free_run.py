"""Free-run simulation of a model from the fin and the inputs of a record, with the sensor effects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from fieldsid.dynamics.assemble import Base, assemble, integrate_record, measured, with_moments
from fieldsid.errors import DivergenceError, EffectError, ModelError
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.effect import Effect, Motion, as_fitted, effect_held
from fieldsid.models.model import Model
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray

LAW_PARAMETER = "damping_exponent"
"""The parameter of the speed law that a model of runs at several speeds has among its values."""
LIMITING_EFFECT = "quadratic_damping"
"""The effect that bounds a rate which grows under the linear damping."""


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Simulated samples (n,): time s, measured angle rad, measured rate rad/s, cross state, fin angle rad."""

    time: FloatArray
    angle: FloatArray
    rate: FloatArray
    cross: FloatArray
    fin: FloatArray


def effects_of(model: Model) -> tuple[Effect, ...]:
    """Return the effects of a model, in the variants that it was fitted with.

    Raises EffectError for an effect or a variant that is not known here, ModelError where the value of a coefficient is missing.
    """
    effects = tuple(as_fitted(effect_held(name, model.own), model.values) for name in model.effects)
    known = {*NAMES[model.axis].base, LAW_PARAMETER, *(c.name for e in effects for c in e.shared)}
    unknown = [n for n in model.values if n not in known and "@" not in n]
    for effect in effects:
        missing = [c.name for c in effect.shared if c.name not in model.values]
        if unknown:
            without = f", without `{missing[0]}`" if missing else ""
            raise EffectError(
                f"the model holds `{effect.name}` in a form that is no longer known: with `{unknown[0]}`{without}",
                found=", ".join(model.values),
                hint=f"identify again: `sysid identify RUN... --axis {model.axis.value} --effects {','.join(model.effects)}`",
            )
        if missing:
            raise ModelError(
                f"the model holds `{effect.name}`, and no value of its `{missing[0]}`",
                found=", ".join(model.values),
                hint=f"add `{missing[0]}` under `parameters` of its file, or identify again",
            )
    return effects


def base_at(model: Model, speed: float) -> Base:
    """Return the model's base parameters at a speed (m/s)."""
    names = NAMES[model.axis]
    v = model.at_speed(speed)
    stiffness = 0.0 if names.stiffness is None else v[names.stiffness]
    return Base(v[names.damping], stiffness, v[names.authority], v[names.trim], model.law.trim_of_fin)


def growing_hint(model: Model) -> str:
    """Return the hint of the error for a motion that grows without bound: add the limiting effect where the model lacks it."""
    if LIMITING_EFFECT in model.effects:
        return "the model is unstable there: identify again, from runs that reach as far"
    effects = ",".join((*model.effects, LIMITING_EFFECT))
    return f"the model is unstable there: `sysid identify RUN... --axis {model.axis.value} --effects {effects}`"


def simulate(
    model: Model,
    record: Record,
    *,
    state: tuple[float, float, float] | None = None,
    nuisance: Mapping[str, float] = MappingProxyType({}),
    effects: tuple[Effect, ...] | None = None,
) -> Trajectory:
    """Return the free run of a model from the fin and the inputs of a record.

    state is the initial (angle rad, rate rad/s, cross state); by default the first measured angle and rate and zero.
    nuisance holds the per-run coefficients (wave phase, event time); those it lacks have their start values.
    Raises DivergenceError when the motion grows without bound.
    """
    parts = effects_of(model) if effects is None else effects
    values = {c.name: c.start for e in parts for c in e.nuisance} | dict(model.values) | dict(nuisance)
    values["damping_exponent"] = model.law.damping_exponent
    if state is None:
        state = (
            float(record.angle[np.argmax(record.angle_ok)]),
            float(record.rate[np.argmax(record.rate_ok)]) if record.rate_ok.any() else 0.0,
            0.0,
        )
    start = np.array(state, dtype=np.float64)
    at_law_speed = record.at_speed(model.law.effective(record.speed))
    inputs = assemble(at_law_speed, parts, base_at(model, record.speed), values, model.law.scale(record.speed))
    inputs = with_moments(record, inputs, parts, values, start)
    out = integrate_record(record, inputs, start)
    if not np.isfinite(out).all():
        at = float(record.time[np.argmin(np.isfinite(out[:, 1]))])
        raise DivergenceError(
            f"the {model.axis.value} model grows without bound on run {record.name!r}",
            found=f"diverged at t = {at:.2f} s",
            hint=growing_hint(model),
        )
    motion = measured(Motion(out[:, 0], out[:, 1]), record, parts, values)
    fin = np.append(inputs.fin.start, inputs.fin.end[-1])
    return Trajectory(record.time, motion.angle, motion.rate, out[:, 2], fin)


def command_record(
    axis: Axis,
    time: npt.ArrayLike,
    fin: npt.ArrayLike,
    *,
    speed: float,
    signals: Mapping[str, FloatArray] = MappingProxyType({}),
    name: str = "command",
    measures: bool = False,
) -> Record:
    """Return a record of a zero-order-hold fin command without measurements, time (n,) s and fin (n,) rad, at a speed in m/s.

    Signals that are not given are those of a steady straight run: surge at `speed`, all others zero. `measures` marks angle and
    rate as measured; both are zero throughout.
    """
    t = np.ascontiguousarray(time, dtype=np.float64)
    is_measured = np.full(t.size, measures)
    steady = {role: np.zeros(t.size) for role in ("thrust", "roll", "depth")} | {"surge": np.full(t.size, speed)}
    return Record(
        name=name,
        axis=axis,
        time=t,
        fin=np.ascontiguousarray(fin, dtype=np.float64),
        fin_is_held=True,
        fin_is_measured=False,
        angle=np.zeros(t.size),
        rate=np.zeros(t.size),
        angle_ok=is_measured,
        rate_ok=is_measured,
        cross=np.zeros(t.size),
        cross_ok=np.zeros(t.size, dtype=bool),
        signals=MappingProxyType(steady | dict(signals)),
        speed=speed,
    )
