"""The linear plant a controller meets at one speed: fin command to angle, over draws of the identified parameters.

y'' = -a y' - k y + b delta + x,   x' = -c x - c_q x|x| - c_r y' + c_f delta
angle/fin = (b (s + c) + c_f) / ((s^2 + a s + k)(s + c) + c_r s),   fin/command = exp(-T s) / (lag s + 1)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from fieldsid.dynamics.free_run import effects_of
from fieldsid.errors import UsageError
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.effect import CORE_FIELDS, Core, Effect, Stage
from fieldsid.models.model import Model
from fieldsid.numerics.arrays import ComplexArray, FloatArray
from fieldsid.plant.parameter_source import ParameterSource, draw_values
from fieldsid.plant.yaw_plant import EXPONENT, follows_the_run, straight_moment

PARTS = (
    "damping", "stiffness", "authority", "offset", "quadratic", "beyond_square", "crossflow", "cross_damping",
    "cross_rate", "cross_fin", "cross_quadratic", "lag", "delay", "fin_rate",
)  # fmt: skip

ACTUATOR = ("lag", "delay", "max_rate")
"""Coefficients of the actuator's effects that the plant holds."""


@dataclass(frozen=True, slots=True)
class LinearPlant:
    """Coefficients (d,) over draws at one speed, the estimate first.

    `quadratic`, `beyond_square`, `crossflow` and `cross_quadratic` act in time simulations only.
    `offset` is the fin's trim offset (rad): the fin acts as fin + offset. `fin_rate` is inf where not limited.
    """

    axis: Axis
    speed: float
    damping: FloatArray
    stiffness: FloatArray
    authority: FloatArray
    offset: FloatArray
    quadratic: FloatArray
    beyond_square: FloatArray
    crossflow: FloatArray
    cross_damping: FloatArray
    cross_rate: FloatArray
    cross_fin: FloatArray
    cross_quadratic: FloatArray
    lag: FloatArray
    delay: FloatArray
    fin_rate: FloatArray

    @property
    def count(self) -> int:
        """Number of draws."""
        return int(self.damping.size)

    def one(self, index: int = 0) -> LinearPlant:
        """Return one draw alone."""
        return self.pick(np.array([index]))

    def pick(self, index: npt.NDArray[np.int_]) -> LinearPlant:
        """Return some draws."""
        parts: dict[str, Any] = {n: getattr(self, n)[index] for n in PARTS}
        return replace(self, **parts)

    def joined(self, other: LinearPlant) -> LinearPlant:
        """Return the draws of both."""
        parts: dict[str, Any] = {n: np.concatenate([getattr(self, n), getattr(other, n)]) for n in PARTS}
        return replace(self, **parts)

    def response(self, omega: FloatArray) -> ComplexArray:
        """Return angle over fin command at frequencies (w,) rad/s, (d, w)."""
        s = 1j * omega[None, :]
        a, k, b = self.damping[:, None], self.stiffness[:, None], self.authority[:, None]
        c, c_r, c_f = self.cross_damping[:, None], self.cross_rate[:, None], self.cross_fin[:, None]
        hull = (b * (s + c) + c_f) / ((s * s + a * s + k) * (s + c) + c_r * s)
        return np.asarray(hull * np.exp(-s * self.delay[:, None]) / (self.lag[:, None] * s + 1.0))

    def polynomials(self) -> tuple[FloatArray, FloatArray]:
        """Return numerator and denominator of angle over command without the delay, draw 0, highest power first."""
        a, k, b = float(self.damping[0]), float(self.stiffness[0]), float(self.authority[0])
        c, c_r, c_f = float(self.cross_damping[0]), float(self.cross_rate[0]), float(self.cross_fin[0])
        numerator, denominator = np.array([b]), np.array([1.0, a, k])
        if c_r != 0.0 or c_f != 0.0:
            numerator = np.array([b, b * c + c_f])
            denominator = np.polyadd(np.polymul(denominator, [1.0, c]), [c_r, 0.0])
        if self.lag[0] > 0.0:
            denominator = np.polymul(denominator, [float(self.lag[0]), 1.0])
        return numerator, np.asarray(denominator)


@dataclass(frozen=True, slots=True)
class FinLimits:
    """What the fin can do, where the vehicle or the user says so (s, rad/s); None leaves it to the model's effects."""

    lag: float | None = None
    delay: float | None = None
    rate: float | None = None

    def record(self) -> dict[str, float | None]:
        """Return what is said, by the names a schedule's file has."""
        return {"lag_s": self.lag, "delay_s": self.delay, "fin_rate_rad_s": self.rate}


def plants_at(source: ParameterSource, speed: float, limits: FinLimits, draws: int, seed: int) -> list[tuple[LinearPlant, float]]:
    """Return the plants next to a speed, scaled to it, with weights that sum to one: one per neighbouring model."""
    if not source.models:
        return [(_plant_of_points(source, speed, limits, draws, seed), 1.0)]
    centre = source.centred_at(speed)
    near = [(source.models[i], seed + i, share) for i, share in source.near(speed)]
    return [(_plant_of_model(model, speed, limits, draws, own_seed, centre), share) for model, own_seed, share in near]


def family_at(source: ParameterSource, speed: float, limits: FinLimits, draws: int, seed: int) -> LinearPlant:
    """Return the whole uncertainty set at a speed: the draws of every neighbouring model."""
    plants = [p for p, _ in plants_at(source, speed, limits, draws, seed)]
    family = plants[0]
    for other in plants[1:]:
        family = family.joined(other)
    return family


def _plant_of_points(source: ParameterSource, speed: float, limits: FinLimits, draws: int, seed: int) -> LinearPlant:
    names = NAMES[source.axis]
    base = source.base_draws(speed, draws, np.random.default_rng(seed))
    stiffness = np.zeros(draws) if names.stiffness is None else base[names.stiffness]
    authority = _same_sign(base[names.authority])
    zero = np.zeros(draws)
    actuator = _actuator({}, limits, draws)
    return LinearPlant(
        source.axis, speed, _same_sign(base[names.damping]), stiffness, authority, base[names.trim] / authority,
        zero, zero, zero, zero + 1.0, zero, zero, zero, *actuator,
    )  # fmt: skip


def _plant_of_model(
    model: Model, speed: float, limits: FinLimits, draws: int, seed: int, centre: Mapping[str, float]
) -> LinearPlant:
    """Return the plant of a model at a speed, its base parameters moved, draws and all, to where laws have them (`centre`)."""
    names = NAMES[model.axis]
    values, exponents = draw_values(model, draws, np.random.default_rng(seed))
    scale = model.law.scale(speed)
    at = model.at_speed(speed)
    ratio = centre.get(names.authority, at[names.authority]) / model.values[names.authority]
    if ratio <= 0.0:
        raise UsageError(
            f"the law of {names.authority} crosses zero before {speed:.3g} m/s",
            found=f"{names.authority} = {centre[names.authority]:.4g} there",
            hint="leave that speed out of `--speeds`, or give a law: `--law "
            f"{names.authority}=0,{at[names.authority] / speed**2:.3g}`",
        )
    moved = {n: value - at[n] for n, value in centre.items()}
    parts = effects_of(model)
    cores = []
    for v, exponent in zip(values, exponents, strict=True):
        core = Core()
        for effect in parts:
            if effect.core is not None:
                core = core.plus(effect.core({EXPONENT: float(exponent)} | v, scale))
        cores.append(core)

    def column(name: str) -> FloatArray:
        return np.array([v[name] for v in values])

    def cored(name: str) -> FloatArray:
        return np.array([getattr(c, name) for c in cores])

    authority = column(names.authority) * ratio
    coupled = cored("cross_damping")
    shared = {n: np.array([v[n] for v in values]) for n in ACTUATOR if n in model.values}
    trim = column(names.trim) * model.law.trim_factor(speed) + moved.get(names.trim, 0.0)
    trim = trim + straight_moment(model, parts, values, np.array([speed]))[:, 0]
    return LinearPlant(
        axis=model.axis,
        speed=speed,
        damping=column(names.damping) * scale**exponents + moved.get(names.damping, 0.0),
        stiffness=np.zeros(draws) if names.stiffness is None else column(names.stiffness) + moved.get(names.stiffness, 0.0),
        authority=authority,
        offset=trim / authority,
        quadratic=cored("quadratic"),
        beyond_square=cored("beyond_square"),
        crossflow=cored("crossflow"),
        cross_damping=np.where(coupled > 0, coupled, 1.0),
        cross_rate=cored("cross_rate"),
        cross_fin=cored("cross_fin"),
        cross_quadratic=cored("cross_quadratic"),
        **dict(zip(("lag", "delay", "fin_rate"), _actuator(shared, limits, draws), strict=True)),
    )


def _actuator(shared: Mapping[str, FloatArray], limits: FinLimits, draws: int) -> Sequence[FloatArray]:
    stated = (limits.lag, limits.delay, limits.rate)
    absent = (0.0, 0.0, np.inf)
    out = []
    for name, said, none in zip(ACTUATOR, stated, absent, strict=True):
        out.append(np.full(draws, said) if said is not None else shared.get(name, np.full(draws, none)))
    return out


def _same_sign(draws: FloatArray) -> FloatArray:
    sign = np.sign(draws[0])
    return np.asarray(sign * np.maximum(sign * draws, 0.05 * abs(draws[0])))


def not_counted(models: Sequence[Model]) -> tuple[str, ...]:
    """Return the effects of models that bend the path from fin to motion in a way a linear plant does not hold."""
    return tuple(sorted({e.name for m in models for e in effects_of(m) if not _counted(e, m)}))


def _counted(effect: Effect, model: Model) -> bool:
    if effect.stage is Stage.SENSOR:
        return True
    if effect.core is not None:
        core = effect.core({EXPONENT: model.law.damping_exponent} | dict(model.values), 1.0)
        return all(getattr(core, n) == getattr(Core(), n) for n in CORE_FIELDS if n not in PARTS and n != "length")
    own = {c.name for c in effect.every if c.name in model.values}
    return own <= set(ACTUATOR) or follows_the_run(effect)
