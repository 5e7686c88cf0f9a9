"""The identified yaw model as arrays over draws of its parameters, for steady turns at any speed.

The equations are those of models/hull.py, with every coefficient at the speed in the turn by the model's speed law and the
scaling of its effects. The actuator effects enter by the steady fin angle that they lead to for a command at the fin limit. An
effect that depends on a signal of the run, at any stage, is evaluated at the speed at which a turn is entered.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldsid.dynamics.assemble import combined_core, combined_terms, fin_path
from fieldsid.dynamics.free_run import command_record, effects_of
from fieldsid.models.axis import NAMES
from fieldsid.models.effect import TERM_PARTS, Effect, Motion, Terms
from fieldsid.models.hull import OF_ANGLE
from fieldsid.models.model import Model
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray

SETTLE_S, STEP_S = 60.0, 0.05
"""Time in which a fin comes to rest, and time step of a turn: the usual sampling interval of logs, s."""
LEAST_SURGE_M_S = 0.05
"""Lower limit of the surge in a simulation, m/s: a hull at rest has neither rudder nor drag."""
EXPONENT = "damping_exponent"
NEARBY = 0.9
"""Share of the speed at which constants are computed a second time, for the powers of the speed they are proportional to."""
TABLE_RATES = np.linspace(-2.0, 2.0, 81)
"""Rates in rad/s at which the moment of effects outside the core is tabulated, for linear interpolation."""
ABSENT = {"damping_factor": 1.0, "authority_factor": 1.0, "moment": 0.0, "damping": 0.0}
"""Value of each part of the terms without any effect."""


@dataclass(frozen=True, slots=True)
class YawPlant:
    """One model and d draws of its values; draw 0 is the estimate.

    Arrays are (d, 1), or (d, s) at the s entry speeds: `moment` (rad/s^2) always, `damping_added`, `factors` and `fin` where an
    effect depends on a signal of the run. `fin` is the steady fin angle in rad by the sign of the rate. `core` (d, C) are the
    constants of the equations of motion at the reference speed, `powers` (C,) the powers of the speed they are proportional to.
    `own_moment` is, by the sign of the rate, the estimate's moment (s or 1, r) rad/s^2 of effects outside the core at rates (r,)
    in rad/s; empty without such effects. `authority_ratio` is the authority over the estimate's; `damping_added` (1/s) and
    `factors`, of damping and authority, come from the effects' terms. `law` is log speed and b(u)/u^2, (k,) each.
    `cross_share_seen` is the share of the cross state's steady moment that the data covered.
    """

    model: Model
    effects: tuple[Effect, ...]
    damping: FloatArray
    damping_exponent: FloatArray
    authority_ratio: FloatArray
    trim: FloatArray
    core: FloatArray
    powers: FloatArray
    fin: Mapping[float, FloatArray]
    own_moment: Mapping[float, tuple[FloatArray, FloatArray]]
    moment: FloatArray
    damping_added: FloatArray
    factors: tuple[FloatArray, FloatArray]
    law: tuple[FloatArray, FloatArray]
    cross_share_seen: FloatArray

    @property
    def count(self) -> int:
        """Number of draws."""
        return int(self.damping.shape[0])

    def scale(self, speed: FloatArray) -> FloatArray:
        """Return the speed over the model's reference speed, one where the latter is not known."""
        reference = self.model.law.reference
        return speed / reference if np.isfinite(reference) and reference > 0 else np.ones_like(speed)

    def damping_at(self, speed: FloatArray) -> FloatArray:
        """Return a(u), (d, s) 1/s."""
        return np.asarray(self.damping * self.factors[0] * self.scale(speed) ** self.damping_exponent + self.damping_added)

    def authority_at(self, speed: FloatArray) -> FloatArray:
        """Return b(u), (d, s) 1/s^2."""
        level = np.interp(np.log(speed), *self.law) * speed**2
        return np.asarray(self.authority_ratio * self.factors[1] * level)

    def trim_at(self, speed: FloatArray) -> FloatArray:
        """Return C(u), (d, s) rad/s^2."""
        if not self.model.law.trim_of_fin:
            return self.trim
        reference = np.full_like(speed, _known(self.model.law.reference))
        return np.asarray(self.trim * self.factors[1] * self.authority_at(speed) / self.authority_at(reference))

    def one(self, index: int = 0) -> YawPlant:
        """Return the plant of a single draw."""
        keep = slice(index, index + 1)
        return replace(
            self,
            **{f: getattr(self, f)[keep] for f in ARRAYS},
            fin={s: d[keep] for s, d in self.fin.items()},
            factors=(self.factors[0][keep], self.factors[1][keep]),
        )


ARRAYS = ("core", "damping", "damping_exponent", "authority_ratio", "trim", "moment", "damping_added", "cross_share_seen")


def yaw_plant(
    model: Model, draws: Sequence[Mapping[str, float]], fin_limit: float, exponents: FloatArray, entry: FloatArray
) -> YawPlant:
    """Return the plant of a model for draws of its values (the first the estimate), at a fin command of +/-fin_limit rad.

    `exponents` (d,) are the damping exponents of the draws, `entry` (s,) the entry speeds of the turns in m/s: the thrust stays
    that of the straight run at the entry speed. Raises the errors of the effects' hooks.
    """
    names = NAMES[model.axis]
    parts = effects_of(model)
    starts = {c.name: c.start for e in parts for c in e.nuisance}
    values = [starts | {EXPONENT: float(e)} | dict(d) for d, e in zip(draws, exponents, strict=True)]
    limit = (float(np.sign(model.base[names.authority])) or 1.0) * fin_limit
    terms = straight_terms(model, parts, values, entry)
    core, powers = scaled_cores(parts, values, 1.0)

    def column(numbers: Sequence[float]) -> FloatArray:
        return np.array(numbers, dtype=np.float64)[:, None]

    return YawPlant(
        model=model,
        effects=parts,
        damping=column([v[names.damping] for v in values]),
        damping_exponent=exponents[:, None],
        authority_ratio=column([v[names.authority] / model.values[names.authority] for v in values]),
        trim=column([v[names.trim] for v in values]),
        core=core,
        powers=powers[0],
        fin={s: steady_fins(model, parts, values, s * limit, entry) for s in (1.0, -1.0)},
        own_moment={s: _moment_table(model, parts, s * limit, entry) for s in (1.0, -1.0)},
        moment=np.broadcast_to(terms.moment, (len(values), entry.size)),
        damping_added=terms.damping,
        factors=(terms.damping_factor, terms.authority_factor),
        law=_law_table(model),
        cross_share_seen=column([_seen_share(model, v) for v in values]),
    )


@dataclass(frozen=True, slots=True)
class StraightTerms:
    """The means of effects' terms on straight runs (models/effect.py): (d, s), or (d, 1) where all speeds have the same."""

    damping_factor: FloatArray
    authority_factor: FloatArray
    moment: FloatArray
    damping: FloatArray


def straight_terms(
    model: Model, parts: Sequence[Effect], values: Sequence[Mapping[str, float]], speeds: FloatArray
) -> StraightTerms:
    """Return the terms of effects on straight runs at speeds (s,) in m/s with the fin at zero.

    Effects that depend on no signal of the run are evaluated at the reference speed.
    """
    out = {name: np.full((len(values), 1), absent) for name, absent in ABSENT.items()}
    for follows in (False, True):
        own = [e for e in parts if e.terms is not None and follows_the_run(e) == follows]
        if own:
            records = [straight_record(model, speed, *_step(0.0)) for speed in _distinct_speeds(model, own, speeds)]
            means = np.array([[_means(combined_terms(record, own, v)) for record in records] for v in values])
            out = {name: TERM_PARTS[name](out[name], means[:, :, i]) for i, name in enumerate(ABSENT)}
    return StraightTerms(**out)


def follows_the_run(effect: Effect) -> bool:
    """Return whether an effect depends on thrust, depth or surge, which are not zero on a straight run."""
    return bool({"thrust", "depth", "surge"} & set(effect.needs))


def _distinct_speeds(model: Model, effects: Sequence[Effect], speeds: FloatArray) -> list[float]:
    """Return the speeds in m/s at which effects differ: all where one follows the run, else the reference speed alone."""
    return [float(s) for s in speeds] if any(map(follows_the_run, effects)) else [_known(model.law.reference)]


def straight_record(model: Model, speed: float, time: FloatArray, fin: FloatArray) -> Record:
    """Return a straight run at a speed in m/s with a fin (n,) in rad, at the mean depth of the model's runs and their thrust.

    The thrust is the power of the speed that those runs showed, where it was fitted, else their mean.
    """
    known = model.trained
    thrust, depth = known.get("thrust_mean", 0.0), known.get("depth_mean", 0.0)
    if "thrust_at_1_m_s" in known:
        thrust = known["thrust_at_1_m_s"] * speed ** known["thrust_exponent"]
    signals = {r: np.full(time.size, v) for r, v in (("thrust", thrust), ("depth", depth)) if np.isfinite(v)}
    return command_record(model.axis, time, fin, speed=speed, signals=signals)


def steady_fins(
    model: Model, parts: Sequence[Effect], values: Sequence[Mapping[str, float]], command: float, speeds: FloatArray
) -> FloatArray:
    """Return the steady fin angle, rad, for every draw, after a command step from zero at speeds (s,) in m/s.

    It is (d, s), or (d, 1) where no actuator follows the run.
    """
    acting = [e for e in parts if e.fin is not None]
    if not acting:
        return np.full((len(values), 1), command)
    records = [straight_record(model, speed, *_step(command)) for speed in _distinct_speeds(model, acting, speeds)]
    return np.array([[fin_path(record, acting, v).end[-1] for record in records] for v in values], dtype=np.float64)


def fins_after_step(plant: YawPlant, side: float, command: float, speeds: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Return, for each entry speed, time (n,) s and the estimate's fin angle (n,) rad after a step to `command` rad at time 0.

    There is a single pair where no actuator effect depends on a signal of the run.
    """
    model, acting = plant.model, [e for e in plant.effects if e.fin is not None]
    sign = float(np.sign(model.base[NAMES[model.axis].authority])) or 1.0
    values = {c.name: c.start for e in plant.effects for c in e.nuisance} | dict(model.values)
    records = [straight_record(model, speed, *_step(side * sign * command)) for speed in _distinct_speeds(model, acting, speeds)]
    paths = [fin_path(record, acting, values) for record in records]
    return [(r.time[1:] - STEP_S, np.append(p.start[1:], p.end[-1])) for r, p in zip(records, paths, strict=True)]


def _moment_table(model: Model, parts: Sequence[Effect], command: float, speeds: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return rates (r,) and the moment at them of the estimate's effects with a `moment` hook, the mean over all headings.

    The moment is (s, r), or (1, r) where no such effect depends on a signal of the run; both are empty without such effects.
    """
    own = [e for e in parts if e.moment is not None]
    if not own:
        return np.zeros(0), np.zeros((1, 0))
    time: FloatArray = 0.1 * np.arange(40, dtype=np.float64)
    angle = np.linspace(0.0, 2.0 * np.pi, time.size, endpoint=False)
    values = {c.name: c.start for e in parts for c in e.nuisance} | dict(model.values)
    records = [straight_record(model, speed, time, np.full(time.size, command)) for speed in _distinct_speeds(model, own, speeds)]
    turning = [Motion(angle, np.full(time.size, rate)) for rate in TABLE_RATES]
    hooks = [e.moment for e in own if e.moment is not None]
    means = [[sum(float(np.mean(hook(motion, values, r))) for hook in hooks) for motion in turning] for r in records]
    return TABLE_RATES, np.array(means)


def _seen_share(model: Model, values: Mapping[str, float]) -> float:
    """Return the share of the cross state's steady moment that is used: one, or what it had reached in the longest turn.

    A sway mode that is slower than the longest turn of the runs and makes the straight course unstable is not covered by the
    data: its moment is then used as far as it had grown by the end of that turn.
    """
    damping, longest_turn = values.get("cross_damping", 0.0), model.trained.get("held_s", np.inf)
    if damping <= 0.0 or not damping * longest_turn < 1.0:
        return 1.0
    of_cross = values.get("strip_munk", 1.0) * values.get("cross_rate", 0.0) / damping
    settled = values[NAMES[model.axis].damping] + of_cross
    return 1.0 if settled > 0.0 else float(-np.expm1(-damping * longest_turn))


def _law_table(model: Model) -> tuple[FloatArray, FloatArray]:
    """Return log speed and b(u)/u^2 of the model's speed law, (k,) each, for linear interpolation in log speed."""
    speeds = np.unique(np.concatenate([np.geomspace(0.02, 50.0, 400), [s for s, _ in model.law.points]]))
    base = model.base[NAMES[model.axis].authority]
    return np.log(speeds), np.array([model.law.authority(float(u), base) for u in speeds]) / speeds**2


def _step(command: float) -> tuple[FloatArray, FloatArray]:
    time = np.arange(0.0, SETTLE_S, STEP_S)
    return time, np.where(time < 0.5 * STEP_S, 0.0, command)


def scaled_cores(parts: Sequence[Effect], values: Sequence[Mapping[str, float]], scale: float) -> tuple[FloatArray, FloatArray]:
    """Return the constants (d, C) of draws at `scale` times the reference speed, and the powers (d, C) of the speed they follow.

    The constants of the terms in the angle (OF_ANGLE) are set to zero.
    """
    cores, slower = (np.array([combined_core(parts, v, at) for v in values]) for at in (scale, NEARBY * scale))
    cores[:, OF_ANGLE] = 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        return cores, np.nan_to_num(np.log(slower / cores) / np.log(NEARBY), posinf=0.0, neginf=0.0)


def _means(terms: Terms) -> list[float]:
    """Return the mean of each part of terms."""
    parts = ((getattr(terms, name), absent) for name, absent in ABSENT.items())
    return [absent if values is None else float(np.mean(values)) for values, absent in parts]


def _known(speed: float) -> float:
    return speed if np.isfinite(speed) else 1.0
