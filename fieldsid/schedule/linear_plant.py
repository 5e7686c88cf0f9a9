"""The linear plant a controller meets at one speed: fin command to angle, over draws of the identified parameters.

y'' = -a y' - k y + b delta + m x,   x' = -c x - c_q x|x| - c_r y' + c_f delta
angle/fin = (b (s + c) + m c_f) / ((s^2 + a s + k)(s + c) + m c_r s),   fin/command = exp(-T s) / (lag s + 1)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

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
from fieldsid.records.keys import Key

PARTS = (
    "damping", "stiffness", "authority", "offset", "quadratic", "beyond_square", "cross_damping", "cross_rate",
    "cross_fin", "cross_quadratic", "cross_share", "strip_moment", "strip_force", "strip_flow", "lag", "delay",
    "fin_rate", "powers", "speed_loss",
)  # fmt: skip
POWERS = ("damping", "authority", "cross_damping", "cross_rate", "cross_fin", "cross_quadratic")
"""What goes with a power of the speed, in the order of a plant's `powers`."""
NEARBY = 0.9
"""Share of the speed at which the powers of an effect's own scaling are read off."""

ACTUATOR = ("lag", "delay", "max_rate")
"""Coefficients of the actuator's effects that the plant holds."""
LONGEST_LAG_S = 10.0
"""No fin, link or autopilot that steers takes longer: what is above was meant in ms."""


@dataclass(frozen=True, slots=True)
class LinearPlant:
    """Coefficients (d,) over draws at one speed, the estimate first.

    `quadratic`, `beyond_square`, `cross_quadratic`, the strips, `powers` and `speed_loss` act in time simulations only.
    `offset` is the fin's trim offset (rad): the fin acts as fin + offset. `fin_rate` is inf where not limited. `powers` (d, 6)
    are the exponents of the speed, by POWERS; `speed_loss` (d, 3) is drag a_u (1/m), the fin's and the turn's loss over it.
    Where the draws are those of a vehicle in surge, sway and yaw, `hull` (d, 22) are its coefficients
    (`turning/maneuvering/equations.py`): flights are of these, and the rest is what they are about a straight run.
    """

    axis: Axis
    speed: float
    damping: FloatArray
    stiffness: FloatArray
    authority: FloatArray
    offset: FloatArray
    quadratic: FloatArray
    beyond_square: FloatArray
    cross_damping: FloatArray
    cross_rate: FloatArray
    cross_fin: FloatArray
    cross_quadratic: FloatArray
    cross_share: FloatArray
    strip_moment: FloatArray
    strip_force: FloatArray
    strip_flow: FloatArray
    lag: FloatArray
    delay: FloatArray
    fin_rate: FloatArray
    powers: FloatArray
    speed_loss: FloatArray
    hull: FloatArray | None = None

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
        return replace(self, **parts, hull=None if self.hull is None else self.hull[index])

    def joined(self, other: LinearPlant) -> LinearPlant:
        """Return the draws of both."""
        parts: dict[str, Any] = {n: np.concatenate([getattr(self, n), getattr(other, n)]) for n in PARTS}
        return replace(self, **parts)

    def distinct(self) -> LinearPlant:
        """Return the estimate alone where all draws are alike, else all of them."""
        same = self.hull is None and all(bool((getattr(self, n) == getattr(self, n)[:1]).all()) for n in PARTS)
        return self.one() if same else self

    def response(self, omega: FloatArray) -> ComplexArray:
        """Return angle over fin command at frequencies (w,) rad/s, (d, w)."""
        s = 1j * omega[None, :]
        a, k, b = self.damping[:, None], self.stiffness[:, None], self.authority[:, None]
        c, c_r, c_f = self.cross_damping[:, None], self.moment_of_rate[:, None], self.moment_of_fin[:, None]
        hull = (b * (s + c) + c_f) / ((s * s + a * s + k) * (s + c) + c_r * s)
        return np.asarray(hull * np.exp(-s * self.delay[:, None]) / (self.lag[:, None] * s + 1.0))

    def polynomials(self) -> tuple[FloatArray, FloatArray]:
        """Return numerator (d, m) and denominator (d, n) of angle over command without delay, highest power first."""
        a, k, b = self.damping, self.stiffness, self.authority
        c, c_r, c_f = self.cross_damping, self.moment_of_rate, self.moment_of_fin
        one = np.ones_like(a)
        numerator, denominator = b[:, None], np.column_stack([one, a, k])
        if c_r.any() or c_f.any():
            numerator = np.column_stack([b, b * c + c_f])
            denominator = np.column_stack([one, a + c, k + a * c + c_r, k * c])
        if self.lag.any():
            denominator = products(denominator, np.column_stack([self.lag, one]))
        return numerator, denominator

    @property
    def growth(self) -> FloatArray:
        """Return how fast the hull's least stable motion grows without a pilot, (d,) 1/s; a free heading is not one."""
        a, k, c, c_r = self.damping, self.stiffness, self.cross_damping, self.moment_of_rate
        coupled = bool(c_r.any() or self.moment_of_fin.any())
        own = np.column_stack([np.ones_like(a), a + c, k + a * c + c_r] if coupled else [np.ones_like(a), a])
        if k.any():
            own = np.column_stack([np.ones_like(a), a + c, k + a * c + c_r, k * c] if coupled else [np.ones_like(a), a, k])
        return np.asarray(roots_of(own).real.max(axis=1))

    @property
    def moment_of_rate(self) -> FloatArray:
        """Return what the yaw or pitch rate takes from the moment of the cross state, (d,) 1/s^2 for each second."""
        return np.asarray(self.cross_share * self.cross_rate)

    @property
    def moment_of_fin(self) -> FloatArray:
        """Return what the fin adds to the moment of the cross state, (d,) 1/s^3."""
        return np.asarray(self.cross_share * self.cross_fin)

    @property
    def slow_damping(self) -> FloatArray:
        """Return the damping of the yaw or pitch rate (d,) 1/s once sway or heave has followed."""
        return np.asarray(self.damping + self.moment_of_rate / self.cross_damping)

    @property
    def slow_authority(self) -> FloatArray:
        """Return the authority (d,) 1/s^2 as the slow loop feels it: the fin's own and that through sway or heave."""
        return np.asarray(self.authority + self.moment_of_fin / self.cross_damping)


def products(left: FloatArray, right: FloatArray) -> FloatArray:
    """Return the products of polynomials, row by row: (d, m) and (d, n) give (d, m + n - 1)."""
    out = np.zeros((left.shape[0], left.shape[1] + right.shape[1] - 1))
    for j in range(right.shape[1]):
        out[:, j : j + left.shape[1]] += left * right[:, j : j + 1]
    return out


def roots_of(polynomials: FloatArray) -> ComplexArray:
    """Return the roots (d, n) of polynomials (d, n + 1), as eigenvalues of their companion matrices.

    A leading coefficient of zero, as of a draw whose fin does not lag, is a root at -infinity: very fast.
    """
    first = polynomials[:, :1]
    least = 1e-9 * np.max(np.abs(polynomials), axis=1, keepdims=True)
    monic = polynomials / np.where(np.abs(first) > least, first, least)
    size = monic.shape[1] - 1
    companion = np.zeros((monic.shape[0], size, size))
    companion[:, 0, :] = -monic[:, 1:]
    companion[:, np.arange(1, size), np.arange(size - 1)] = 1.0
    return np.asarray(np.linalg.eigvals(companion), dtype=np.complex128)


@dataclass(frozen=True, slots=True)
class FinLimits:
    """What the fin can do, where the vehicle or the user says so (s, rad/s); None leaves it to the model's effects.

    `latency` (s) is the autopilot's own, from sensor to command with half its period: no log of commands holds it, so it
    comes on top of the delay.
    """

    lag: Annotated[float | None, Key("Time constant.", "lag_s")] = None
    delay: Annotated[float | None, Key("Dead time.", "delay_s")] = None
    rate: Annotated[float | None, Key("Fastest rate; null where it is not limited.", "fin_rate_rad_s")] = None
    latency: Annotated[float | None, Key("The autopilot's own.", "latency_s")] = None

    def refuse_impossible(self) -> None:
        """Raise UsageError for times below zero or longer than any fin or autopilot takes, and for a fin that does not move."""
        times = {"--fin-lag": self.lag, "--delay": self.delay, "--latency": self.latency}
        for option, value in times.items():
            if value is not None and not 0.0 <= value <= LONGEST_LAG_S:
                thousandth = 1e-3 * value if LONGEST_LAG_S < value <= 1e3 * LONGEST_LAG_S else 0.1
                raise UsageError(
                    f"`{option}` must be a number, 0 to {LONGEST_LAG_S:g} s",
                    found=f"{option} {value:g}",
                    hint=f"in s: `{option} {thousandth:.4g}` is {1e3 * thousandth:.4g} ms; or leave it out",
                )
        if self.rate is not None and not 0.0 < self.rate < np.inf:
            raise UsageError(
                "`--fin-rate` must be a number, above zero",
                found=f"--fin-rate {self.rate:g} rad/s",
                hint="write `--fin-rate 60deg`, or leave it out to take the models' own",
            )


def plants_at(source: ParameterSource, speed: float, limits: FinLimits, draws: int, seed: int) -> list[tuple[LinearPlant, float]]:
    """Return the plants next to a speed, scaled to it, with weights that sum to one: one per neighbouring model."""
    if not source.models:
        return [(_plant_of_points(source, speed, limits, draws, seed), 1.0)]
    centre = source.centred_at(speed)
    near = [(source.models[i], seed + i, share) for i, share in source.near(speed)]
    return [(_plant_of_model(model, speed, limits, draws, own_seed, centre), share) for model, own_seed, share in near]


def between(near: Sequence[tuple[LinearPlant, float]]) -> LinearPlant:
    """Return the plant that lies between some by their weights, draw by draw."""
    first = near[0][0]
    if len(near) == 1:
        return first
    parts: dict[str, Any] = {n: np.sum([share * getattr(plant, n) for plant, share in near], axis=0) for n in PARTS}
    return replace(first, **parts)


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
    authority = base[names.authority]
    zero = np.zeros(draws)
    lag, delay, fin_rate = _actuator({}, limits, draws)
    return LinearPlant(
        source.axis, speed, base[names.damping], stiffness, authority, base[names.trim] / authority,
        zero, zero, zero + 1.0, zero, zero, zero, zero + 1.0, zero, zero, zero, lag, delay, fin_rate,
        _powers(zero + 1.0, {}), np.zeros((draws, 3)),
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
    cores, slower = (
        [_core(parts, {EXPONENT: float(e)} | v, at) for v, e in zip(values, exponents, strict=True)]
        for at in (scale, NEARBY * scale)
    )

    def column(name: str) -> FloatArray:
        return np.array([v[name] for v in values])

    def cored(name: str) -> FloatArray:
        return np.array([getattr(c, name) for c in cores])

    def power(name: str) -> FloatArray:
        there = np.array([getattr(c, name) for c in slower])
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.nan_to_num(np.log(there / cored(name)) / np.log(NEARBY)))

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
        cross_damping=np.where(coupled > 0, coupled, 1.0),
        cross_rate=cored("cross_rate"),
        cross_fin=cored("cross_fin"),
        cross_quadratic=cored("cross_quadratic"),
        cross_share=cored("cross_share"),
        strip_moment=cored("strip_moment"),
        strip_force=cored("strip_force"),
        strip_flow=cored("strip_flow"),
        **dict(zip(("lag", "delay", "fin_rate"), _actuator(shared, limits, draws), strict=True)),
        powers=_powers(exponents, {name: power(name) for name in POWERS[2:]}),
        speed_loss=np.zeros((draws, 3)),
    )


def _core(parts: Sequence[Effect], values: Mapping[str, float], scale: float) -> Core:
    core = Core()
    for effect in parts:
        if effect.core is not None:
            core = core.plus(effect.core(values, scale))
    return core


def _powers(damping: FloatArray, own: Mapping[str, FloatArray]) -> FloatArray:
    """Return the exponents (d, 6) of the speed: damping's, two of the fin's lift, and the cross state's own."""
    lift, none = np.full_like(damping, 2.0), np.zeros_like(damping)
    return np.column_stack([damping, lift, *(own.get(name, none) for name in POWERS[2:])])


def _actuator(shared: Mapping[str, FloatArray], limits: FinLimits, draws: int) -> Sequence[FloatArray]:
    stated = (limits.lag, limits.delay, limits.rate)
    absent = (0.0, 0.0, np.inf)
    out = []
    for name, said, none in zip(ACTUATOR, stated, absent, strict=True):
        out.append(np.full(draws, said) if said is not None else shared.get(name, np.full(draws, none)))
    out[1] = out[1] + (limits.latency or 0.0)
    return out


def not_counted(models: Sequence[Model]) -> tuple[str, ...]:
    """Return the effects of models that bend the path from fin to motion in a way a linear plant does not hold."""
    return tuple(sorted({e.name for m in models for e in effects_of(m) if not _counted(e, m)}))


def _counted(effect: Effect, model: Model) -> bool:
    if effect.stage is Stage.SENSOR:
        return True
    if effect.core is not None:
        core = effect.core({EXPONENT: model.law.damping_exponent} | dict(model.values), 1.0)
        return all(getattr(core, n) == getattr(Core(), n) for n in CORE_FIELDS if n not in PARTS)
    own = {c.name for c in effect.every if c.name in model.values}
    return own <= set(ACTUATOR) or follows_the_run(effect)
