"""The linear plant at one speed, from fin command to angle, over draws of the identified parameters.

It is the linearisation of the equations of motion (models/hull.py) on a straight run; simulations use the equations themselves.
y'' = -a y' - k y + b delta + m x,   x' = -c x - c_r y' + c_f delta
angle/fin = (b (s + c) + m c_f) / ((s^2 + a s + k)(s + c) + m c_r s),   fin/command = exp(-T s) / (lag s + 1)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any

import numpy as np

from fieldsid.dynamics.free_run import effects_of
from fieldsid.dynamics.steady_kernel import straight_slopes
from fieldsid.errors import UsageError
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.effect import Effect, Stage
from fieldsid.models.hull import CROSS_DAMPING, OF_ANGLE, Core
from fieldsid.models.model import Model
from fieldsid.numerics.arrays import ComplexArray, FloatArray
from fieldsid.plant.parameter_source import ParameterSource, draw_values
from fieldsid.plant.yaw_plant import EXPONENT, follows_the_run, scaled_cores, straight_terms
from fieldsid.records.keys import Key

PARTS = ("damping", "stiffness", "authority", "offset", "core", "lag", "delay", "fin_rate", "powers", "speed_loss")
WITHOUT_EFFECTS = np.array(Core(cross_damping=1.0))
"""The constants of a plant without effects: its cross state has no input and is stable."""
ACTUATOR = ("lag", "delay", "max_rate")
"""Coefficients of actuator effects that are part of the plant."""
LONGEST_LAG_S = 10.0
"""Largest time constant or delay of a fin, link or autopilot that is accepted: a larger number was meant in ms."""


@dataclass(frozen=True)
class LinearPlant:
    """Coefficients (d,) over draws at one speed, the estimate first.

    `core` (d, C) are the constants of the equations of motion; their nonlinear terms, `powers` and `speed_loss` act in time
    simulations only. `offset` is the trim offset of the fin (rad): the fin acts as fin + offset. `fin_rate` is inf where it is
    not limited. `powers` (d, 2 + C) are the exponents of the speed for damping, authority and the constants; `speed_loss` (d, 3)
    is the drag a_u (1/m) and the losses by fin and turn over it. Where the draws are of a vehicle in surge, sway and yaw, `hull`
    (d, 22) are its coefficients (`turning/maneuvering/equations.py`): simulations use these, and the other fields are the
    linearisation.
    """

    axis: Axis
    speed: float
    damping: FloatArray
    stiffness: FloatArray
    authority: FloatArray
    offset: FloatArray
    core: FloatArray
    lag: FloatArray
    delay: FloatArray
    fin_rate: FloatArray
    powers: FloatArray
    speed_loss: FloatArray
    hull: FloatArray | None = None
    path_lag: float = 0.0
    level_pitch: float = 0.0

    @property
    def count(self) -> int:
        """Number of draws."""
        return int(self.damping.size)

    def one(self, index: int = 0) -> LinearPlant:
        """Return a single draw."""
        parts: dict[str, Any] = {n: getattr(self, n)[[index]] for n in PARTS}
        return replace(self, **parts, hull=None if self.hull is None else self.hull[[index]])

    def distinct(self) -> LinearPlant:
        """Return the estimate only where all draws are equal, else the plant itself."""
        same = self.hull is None and all(bool((getattr(self, n) == getattr(self, n)[:1]).all()) for n in PARTS)
        return self.one() if same else self

    def response(self, omega: FloatArray) -> ComplexArray:
        """Return angle over fin command at frequencies (w,) rad/s, (d, w)."""
        s, b = 1j * omega[None, :], self.authority[:, None]
        a, k, c, c_r, c_f = self.straight[:, :, None]
        hull = (b * (s + c) + c_f) / ((s * s + a * s + k) * (s + c) + c_r * s)
        return np.asarray(hull * np.exp(-s * self.delay[:, None]) / (self.lag[:, None] * s + 1.0))

    @cached_property
    def polynomials(self) -> tuple[FloatArray, FloatArray]:
        """Numerator (d, m) and denominator (d, n) of angle over command, highest power first; a delay by second-order Pade."""
        (a, k, c, c_r, c_f), b = self.straight, self.authority
        one = np.ones_like(a)
        numerator, denominator = b[:, None], np.column_stack([one, a, k])
        if c_r.any() or c_f.any():
            numerator = np.column_stack([b, b * c + c_f])
            denominator = np.column_stack([one, a + c, k + a * c + c_r, k * c])
        if self.lag.any():
            denominator = products(denominator, np.column_stack([self.lag, one]))
        if self.delay.any():
            square, half = self.delay**2 / 12.0, self.delay / 2.0
            numerator = products(numerator, np.column_stack([square, -half, one]))
            denominator = products(denominator, np.column_stack([square, half, one]))
        return numerator, denominator

    @property
    def growth(self) -> FloatArray:
        """Return the largest real part (d,) 1/s of the open-loop poles of the hull, without the integrator of the heading."""
        a, k, c, c_r, c_f = self.straight
        parts = [np.ones_like(a), a + c, k + a * c + c_r, k * c] if c_r.any() or c_f.any() else [np.ones_like(a), a, k]
        return np.asarray(roots_of(np.column_stack(parts if k.any() else parts[:-1])).real.max(axis=1))

    @cached_property
    def straight(self) -> FloatArray:
        """Return a, k, c, m c_r and m c_f of the equations above, (5, d): the linearised equations of motion."""
        out = straight_slopes(np.ascontiguousarray(self.core))
        out[0] += self.damping
        out[1] += self.stiffness
        return out

    @property
    def slow_damping(self) -> FloatArray:
        """Return the damping of the yaw or pitch rate (d,) 1/s with the cross state in equilibrium."""
        a, _, c, c_r, _ = self.straight
        return np.asarray(a + c_r / c)

    @property
    def slow_authority(self) -> FloatArray:
        """Return the authority (d,) 1/s^2 with the cross state in equilibrium: that of the fin and that through sway or heave."""
        _, _, c, _, c_f = self.straight
        return np.asarray(self.authority + c_f / c)

    @property
    def reference_gain(self) -> float:
        """Return the fin (rad) per rad of reference that cancels the estimate's stiffness."""
        return float(self.stiffness[0]) / float(self.slow_authority[0])

    def steady_fin(self, angle: float) -> float:
        """Return the fin (rad) with which the estimate holds an angle (rad) against its stiffness and trim."""
        return self.reference_gain * angle - float(self.offset[0])


def products(left: FloatArray, right: FloatArray) -> FloatArray:
    """Return the products of polynomials, row by row: (d, m) and (d, n) give (d, m + n - 1)."""
    out = np.zeros((left.shape[0], left.shape[1] + right.shape[1] - 1))
    for j in range(right.shape[1]):
        out[:, j : j + left.shape[1]] += left * right[:, j : j + 1]
    return out


def roots_of(polynomials: FloatArray) -> ComplexArray:
    """Return the roots (d, n) of polynomials (d, n + 1), as eigenvalues of their companion matrices.

    A leading coefficient of zero, as of a draw whose fin has no lag, is replaced by a small one: the root is fast.
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
    """Lag, delay (s) and rate limit (rad/s) of the fin as stated by vehicle or user; None leaves them to the model's effects.

    `latency` (s) is that of the autopilot, from sensor to command plus half its period: a log of commands does not contain it,
    and it is added to the delay.
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
    """Return the plants of the models next to a speed, scaled to it, with weights that sum to one."""
    if not source.models:
        return [(_plant_of_points(source, speed, limits, draws, seed), 1.0)]
    centre = source.centred_at(speed)
    near = [(source.models[i], seed + i, share) for i, share in source.near(speed)]
    return [(_plant_of_model(model, speed, limits, draws, model_seed, centre), share) for model, model_seed, share in near]


def between(near: Sequence[tuple[LinearPlant, float]]) -> LinearPlant:
    """Return the weighted mean of plants, draw by draw."""
    first = near[0][0]
    if len(near) == 1:
        return first
    parts: dict[str, Any] = {n: np.sum([share * getattr(plant, n) for plant, share in near], axis=0) for n in PARTS}
    return replace(first, **parts)


def family_at(source: ParameterSource, speed: float, limits: FinLimits, draws: int, seed: int) -> LinearPlant:
    """Return the uncertainty set at a speed: the draws of all neighbouring models."""
    plants = [p for p, _ in plants_at(source, speed, limits, draws, seed)]
    parts: dict[str, Any] = {n: np.concatenate([getattr(p, n) for p in plants]) for n in PARTS}
    return replace(plants[0], **parts)


def _plant_of_points(source: ParameterSource, speed: float, limits: FinLimits, draws: int, seed: int) -> LinearPlant:
    names = NAMES[source.axis]
    base = source.base_draws(speed, draws, np.random.default_rng(seed))
    stiffness = np.zeros(draws) if names.stiffness is None else base[names.stiffness]
    authority = base[names.authority]
    core = np.tile(WITHOUT_EFFECTS, (draws, 1))
    lag, delay, fin_rate = _actuator({}, limits, draws)
    return LinearPlant(
        source.axis, speed, base[names.damping], stiffness, authority, base[names.trim] / authority, core, lag, delay, fin_rate,
        _powers(np.ones(draws), np.zeros_like(core)), np.zeros((draws, 3)),
    )  # fmt: skip


def _plant_of_model(
    model: Model, speed: float, limits: FinLimits, draws: int, seed: int, centre: Mapping[str, float]
) -> LinearPlant:
    """Return the plant of a model at a speed; the draws of its base parameters are shifted to have `centre` as the estimate."""
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
    shift = {n: value - at[n] for n, value in centre.items()}
    parts = effects_of(model)
    cores, core_powers = scaled_cores(parts, [{EXPONENT: float(e)} | v for v, e in zip(values, exponents, strict=True)], scale)

    def column(name: str) -> FloatArray:
        return np.array([v[name] for v in values])

    followed = straight_terms(model, [e for e in parts if follows_the_run(e)], values, np.array([speed]))
    authority = column(names.authority) * ratio * followed.authority_factor[:, 0]
    cores[:, CROSS_DAMPING] = np.where(cores[:, CROSS_DAMPING] > 0.0, cores[:, CROSS_DAMPING], 1.0)
    following = {c.name for e in parts if follows_the_run(e) for c in e.shared}
    shared = {n: column(n) for n in ACTUATOR if n in model.values and n not in following}
    trim = column(names.trim) * model.law.trim_factor(speed) + shift.get(names.trim, 0.0)
    trim = trim + followed.moment[:, 0]
    lag, delay, fin_rate = _actuator(shared, limits, draws)
    damping = column(names.damping) * scale**exponents + shift.get(names.damping, 0.0)
    return LinearPlant(
        axis=model.axis,
        speed=speed,
        damping=damping * followed.damping_factor[:, 0] + followed.damping[:, 0],
        stiffness=np.zeros(draws) if names.stiffness is None else column(names.stiffness) + shift.get(names.stiffness, 0.0),
        authority=authority,
        offset=trim / authority,
        core=cores,
        lag=lag,
        delay=delay,
        fin_rate=fin_rate,
        powers=_powers(exponents, core_powers),
        speed_loss=np.zeros((draws, 3)),
    )


def _powers(damping: FloatArray, core: FloatArray) -> FloatArray:
    """Return the exponents (d, 2 + C) of the speed: of damping (d,), of authority, which is 2, and of the constants (d, C)."""
    return np.column_stack([damping, np.full_like(damping, 2.0), core])


def _actuator(shared: Mapping[str, FloatArray], limits: FinLimits, draws: int) -> Sequence[FloatArray]:
    stated = (limits.lag, limits.delay, limits.rate)
    absent = (0.0, 0.0, np.inf)
    out = []
    for name, value, default in zip(ACTUATOR, stated, absent, strict=True):
        out.append(np.full(draws, value) if value is not None else shared.get(name, np.full(draws, default)))
    out[1] = out[1] + (limits.latency or 0.0)
    return out


def not_counted(models: Sequence[Model]) -> dict[str, tuple[str, ...]]:
    """Return by effect the coefficients between fin and motion that are not part of a linear plant."""
    by_effect: dict[str, set[str]] = {}
    for model in models:
        for effect in effects_of(model):
            if names := _left_out(effect, model):
                by_effect.setdefault(effect.name, set()).update(names)
    return {name: tuple(sorted(by_effect[name])) for name in sorted(by_effect)}


def _left_out(effect: Effect, model: Model) -> set[str]:
    if effect.stage is Stage.SENSOR:
        return set()
    names = {c.name for c in effect.all_coefficients if c.name in model.values}
    if effect.core is not None:
        core = effect.core({EXPONENT: model.law.damping_exponent} | dict(model.values), 1.0)
        return names if any(core[place] for place in OF_ANGLE) else set()
    if follows_the_run(effect):
        return set() if effect.terms is not None else names
    return names - set(ACTUATOR)
