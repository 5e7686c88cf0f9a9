"""The identified yaw model as arrays over draws of its parameters, ready for steady turns at any speed.

Its equations are those of motion (models/hull.py), with every coefficient at the speed kept in the turn, by the model's own
speed law and its effects' own scaling.
The actuator's effects are taken as they leave a fin that was told to stay at its limit. What follows a signal of the run, at any
stage, is taken as it is at the speed that a turn is entered at.
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

SETTLE_S = 60.0
STEP_S = 0.05
EXPONENT = "damping_exponent"
NEARBY = 0.9
"""Share of the speed at which the powers of an effect's own scaling are read off."""
TABLE_RATES = np.linspace(-2.0, 2.0, 81)
"""Rates in rad/s at which the moment of effects outside the core is known; it is straight between them."""
ABSENT = {"damping_factor": 1.0, "authority_factor": 1.0, "moment": 0.0, "damping": 0.0}
"""What stands for each part of terms where no effect has it."""


@dataclass(frozen=True, slots=True)
class YawPlant:
    """One model, d draws of its values; draw 0 is the estimate itself.

    Arrays are (d, 1), or (d, s) at the speeds that turns are entered at: `moment` always, `damping_more`, `factors` and the `fin`
    by rate sign (rad) where an effect follows the run.

    `core` (d, C) are the constants of the equations of motion at the reference speed, `powers` (C,) those of the speed they go
    with; `own_moment` by rate sign is the estimate's moment (s or 1, r) rad/s^2 of effects outside the core at rates (r,) rad/s,
    empty where there are none.
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
    damping_more: FloatArray
    factors: tuple[FloatArray, FloatArray]
    law: tuple[FloatArray, FloatArray]
    sway_seen: FloatArray

    @property
    def count(self) -> int:
        """Number of draws."""
        return int(self.damping.shape[0])

    def scale(self, speed: FloatArray) -> FloatArray:
        """Return speed over the model's reference speed, one where that is not known."""
        reference = self.model.law.reference
        return speed / reference if np.isfinite(reference) and reference > 0 else np.ones_like(speed)

    def damping_at(self, speed: FloatArray) -> FloatArray:
        """Return a(u), (d, s) 1/s."""
        return np.asarray(self.damping * self.factors[0] * self.scale(speed) ** self.damping_exponent + self.damping_more)

    def authority_at(self, speed: FloatArray) -> FloatArray:
        """Return b(u), (d, s) 1/s^2."""
        level = np.interp(np.log(speed), *self.law) * speed**2
        return np.asarray(self.authority_ratio * self.factors[1] * level)

    def trim_at(self, speed: FloatArray) -> FloatArray:
        """Return C(u), (d, s) rad/s^2."""
        if not self.model.law.trim_of_fin:
            return self.trim
        there = np.full_like(speed, _known(self.model.law.reference))
        return np.asarray(self.trim * self.factors[1] * self.authority_at(speed) / self.authority_at(there))

    def one(self, index: int = 0) -> YawPlant:
        """Return the plant of one draw alone."""
        keep = slice(index, index + 1)
        return replace(
            self,
            **{f: getattr(self, f)[keep] for f in ARRAYS},
            fin={s: d[keep] for s, d in self.fin.items()},
            factors=(self.factors[0][keep], self.factors[1][keep]),
        )


ARRAYS = ("core", "damping", "damping_exponent", "authority_ratio", "trim", "moment", "damping_more", "sway_seen")


def yaw_plant(
    model: Model, draws: Sequence[Mapping[str, float]], fin_limit: float, exponents: FloatArray, entry: FloatArray
) -> YawPlant:
    """Return the plant of a model for draws of its values (the first its own), at a fin command of +/-fin_limit rad.

    `exponents` (d,) are the damping exponents of the draws, `entry` (s,) the speeds in m/s that turns are entered at: a
    propeller keeps the thrust it had there. Raises what the effects' hooks raise.
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
        damping_more=terms.damping,
        factors=(terms.damping_factor, terms.authority_factor),
        law=_law_table(model),
        sway_seen=column([_seen_share(model, v) for v in values]),
    )


@dataclass(frozen=True, slots=True)
class StraightTerms:
    """The means of effects' terms on straight runs (models/effect.py), (d, s) by draws and speeds, (d, 1) where all are alike."""

    damping_factor: FloatArray
    authority_factor: FloatArray
    moment: FloatArray
    damping: FloatArray


def straight_terms(
    model: Model, parts: Sequence[Effect], values: Sequence[Mapping[str, float]], speeds: FloatArray
) -> StraightTerms:
    """Return what effects add on straight runs at speeds (s,) in m/s, fin at zero.

    Those that follow no signal of the run are as at the reference speed.
    """
    out = {name: np.full((len(values), 1), absent) for name, absent in ABSENT.items()}
    for follows in (False, True):
        own = [e for e in parts if e.terms is not None and follows_the_run(e) == follows]
        if own:
            records = [as_trained(model, speed, *_step(0.0)) for speed in _speeds_told_apart(model, own, speeds)]
            means = np.array([[_means(combined_terms(record, own, v)) for record in records] for v in values])
            out = {name: TERM_PARTS[name](out[name], means[:, :, i]) for i, name in enumerate(ABSENT)}
    return StraightTerms(**out)


def follows_the_run(effect: Effect) -> bool:
    """Return whether an effect follows signals that a straight run has."""
    return bool({"thrust", "depth", "surge"} & set(effect.needs))


def _speeds_told_apart(model: Model, effects: Sequence[Effect], speeds: FloatArray) -> list[float]:
    """Return the speeds in m/s at which effects are not alike: all where one follows the run, else the reference speed alone."""
    return [float(s) for s in speeds] if any(map(follows_the_run, effects)) else [_known(model.law.reference)]


def as_trained(model: Model, speed: float, time: FloatArray, fin: FloatArray) -> Record:
    """Return a straight run at a speed in m/s under a fin (n,) rad, at the thrust and depth of the runs the model is from.

    The thrust goes with the speed as it did from run to run there.
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
    records = [as_trained(model, speed, *_step(command)) for speed in _speeds_told_apart(model, acting, speeds)]
    return np.array([[fin_path(record, acting, v).end[-1] for record in records] for v in values], dtype=np.float64)


def fins_after_step(plant: YawPlant, side: float, command: float, speeds: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Return time (n,) s and fin angle (n,) rad of the estimate after a step of the command to its limit at time 0, by speed.

    It is one for all where no actuator follows the run.
    """
    model, acting = plant.model, [e for e in plant.effects if e.fin is not None]
    sign = float(np.sign(model.base[NAMES[model.axis].authority])) or 1.0
    values = {c.name: c.start for e in plant.effects for c in e.nuisance} | dict(model.values)
    records = [as_trained(model, speed, *_step(side * sign * command)) for speed in _speeds_told_apart(model, acting, speeds)]
    paths = [fin_path(record, acting, values) for record in records]
    return [(r.time[1:] - STEP_S, np.append(p.start[1:], p.end[-1])) for r, p in zip(records, paths, strict=True)]


def _moment_table(model: Model, parts: Sequence[Effect], command: float, speeds: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return rates (r,) and the estimate's moment there, a circle's mean of each, of effects that the core does not know.

    It is (s, r), or (1, r) where none of them follows the run; empty where there are none.
    """
    own = [e for e in parts if e.moment is not None]
    if not own:
        return np.zeros(0), np.zeros((1, 0))
    time: FloatArray = 0.1 * np.arange(40, dtype=np.float64)
    angle = np.linspace(0.0, 2.0 * np.pi, time.size, endpoint=False)
    values = {c.name: c.start for e in parts for c in e.nuisance} | dict(model.values)
    records = [as_trained(model, speed, time, np.full(time.size, command)) for speed in _speeds_told_apart(model, own, speeds)]
    turning = [Motion(angle, np.full(time.size, rate)) for rate in TABLE_RATES]
    hooks = [e.moment for e in own if e.moment is not None]
    means = [[sum(float(np.mean(hook(motion, values, r))) for hook in hooks) for motion in turning] for r in records]
    return TABLE_RATES, np.array(means)


def _seen_share(model: Model, values: Mapping[str, float]) -> float:
    """Return the share of the sway mode's settled moment that counts: all of it, or what the longest held turn showed.

    A mode slower than any turn held, that would make the vehicle unstable on a straight course, was not seen by the data:
    its moment is then counted as far as it had grown by the end of the longest hold.
    """
    damping, held = values.get("cross_damping", 0.0), model.trained.get("held_s", np.inf)
    if damping <= 0.0 or not damping * held < 1.0:
        return 1.0
    moved = values.get("strip_munk", 1.0) * values.get("cross_rate", 0.0) / damping
    settled = values[NAMES[model.axis].damping] + moved
    return 1.0 if settled > 0.0 else float(-np.expm1(-damping * held))


def _law_table(model: Model) -> tuple[FloatArray, FloatArray]:
    """Return log speed and b(u)/u^2 of the model's own law, (k,) each; it is linear between in log speed."""
    speeds = np.unique(np.concatenate([np.geomspace(0.02, 50.0, 400), [s for s, _ in model.law.points]]))
    base = model.base[NAMES[model.axis].authority]
    return np.log(speeds), np.array([model.law.authority(float(u), base) for u in speeds]) / speeds**2


def _step(command: float) -> tuple[FloatArray, FloatArray]:
    time = np.arange(0.0, SETTLE_S, STEP_S)
    return time, np.where(time < 0.5 * STEP_S, 0.0, command)


def scaled_cores(parts: Sequence[Effect], values: Sequence[Mapping[str, float]], scale: float) -> tuple[FloatArray, FloatArray]:
    """Return the constants (d, C) of draws at `scale` times the reference speed, and the powers (d, C) of it they go with.

    Those of the angle itself are nil.
    """
    there, slower = (np.array([combined_core(parts, v, at) for v in values]) for at in (scale, NEARBY * scale))
    there[:, OF_ANGLE] = 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        return there, np.nan_to_num(np.log(slower / there) / np.log(NEARBY), posinf=0.0, neginf=0.0)


def _means(terms: Terms) -> list[float]:
    """Return the mean of each part of terms."""
    parts = ((getattr(terms, name), absent) for name, absent in ABSENT.items())
    return [absent if values is None else float(np.mean(values)) for values, absent in parts]


def _known(speed: float) -> float:
    return speed if np.isfinite(speed) else 1.0
