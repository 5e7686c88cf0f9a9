"""The steady circle of a plant with loss of speed and drift, for all draws and speeds at once; and that of a source of models.

Each model is scaled by its speed law; between two models the turns are interpolated in log speed.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from fieldsid.dynamics.steady_kernel import MAX_ITERATIONS, settled_rates
from fieldsid.models.hull import CROSS_SHARE
from fieldsid.models.model import Model
from fieldsid.numerics.arrays import FloatArray
from fieldsid.plant.parameter_source import ParameterSource, draw_values
from fieldsid.plant.yaw_plant import YawPlant, yaw_plant
from fieldsid.runtime.parallel_map import parallel_map
from fieldsid.turning.prediction import SIDES
from fieldsid.turning.steady.speed_loss import SpeedLoss, SurgeModel, draw_speed_loss, no_speed_loss
from fieldsid.turning.steady.transient import Transient, turn_transient

TOLERANCE = 1e-10


@dataclass(frozen=True, slots=True)
class SteadyTurn:
    """Settled circle for draws and entry speeds, arrays (d, s): rate rad/s (signed), surge m/s, path speed m/s, radius m."""

    rate: FloatArray
    surge: FloatArray
    speed: FloatArray
    radius: FloatArray


def steady_turn(plant: YawPlant, speed_loss: SpeedLoss, entry: FloatArray, side: float) -> SteadyTurn:
    """Return the settled circle to starboard (side +1) or port (-1) from entry speeds (s,) in m/s.

    NaN where the model has no steady rate on that side (unstable without nonlinear damping, or fin below trim).
    """
    fin = plant.fin[side]
    start = np.broadcast_to(entry[None, :], (plant.count, entry.size))
    surge = start / speed_loss.factor(fin, np.zeros_like(start))
    rate = np.zeros_like(surge)
    for _ in range(MAX_ITERATIONS):
        rate = balance(plant, surge, side)
        new = start / speed_loss.factor(fin, np.nan_to_num(rate) / surge)
        change = float(np.max(np.abs(new - surge) / start))
        surge = new
        if change < TOLERANCE:
            break
    path = surge * np.hypot(1.0, speed_loss.drift_per_rate * np.nan_to_num(rate) / surge)
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = path / np.abs(rate)
    return SteadyTurn(rate, surge, path, radius)


def balance(plant: YawPlant, surge: FloatArray, side: float) -> FloatArray:
    """Return the steady rate (d, s) toward `side` at a surge speed (d, s), NaN where there is none."""
    fin = plant.fin[side]
    core = plant.core[:, None, :] * plant.scale(surge)[:, :, None] ** plant.powers
    core[:, :, CROSS_SHARE] *= plant.cross_share_seen
    moment = plant.authority_at(surge) * fin + plant.trim_at(surge) + plant.moment
    damping, moment, fins = (np.broadcast_to(part, surge.shape).flatten() for part in (plant.damping_at(surge), moment, fin))
    out = np.empty(surge.size)
    settled_rates(core.reshape(surge.size, -1), damping, moment, fins, side, *plant.own_moment[side], out)
    return out.reshape(surge.shape)


FALLBACK_CURVATURE = 0.3


@dataclass(frozen=True, slots=True)
class BlendedTurns:
    """Turns to one side from entry speeds (s,): radius (d, s) of draws; magnitudes (s,) of rate and path speed; transient."""

    entry: FloatArray
    radius: FloatArray
    rate: FloatArray
    path_speed: FloatArray
    transient: Transient
    effects: tuple[str, ...]


def blended_turns(
    source: ParameterSource, entry: FloatArray, rudder: float, surge: SurgeModel | None, draws: int, rng: np.random.Generator
) -> dict[str, BlendedTurns]:
    """Return the settled turns of a source's models with the rudder at `rudder` rad, by side."""
    cases = _cases(source, entry, rudder, surge, draws, rng)

    def turns_of(case: _Case) -> tuple[SteadyTurn, Transient]:
        turn = steady_turn(case.plant, case.speed_loss, entry[case.used], SIDES[case.side])
        return turn, turn_transient(case.plant, case.speed_loss, entry[case.used], SIDES[case.side], rudder)

    sums = {side: _Sums(draws, entry.size) for side in SIDES}
    for case, (turn, transient) in zip(cases, parallel_map(turns_of, cases), strict=True):
        sums[case.side].add(case.used, case.share, turn, transient)
    effects = tuple(sorted({e for m in source.models for e in m.effects}))
    return {side: total.turns(entry, effects) for side, total in sums.items()}


def blended_radius(source: ParameterSource, entry: FloatArray, rudder: float, surge: SurgeModel | None) -> dict[str, FloatArray]:
    """Return the estimate's settled radius (s,) m by side, without draws and without the transient."""
    log_radius = {side: np.zeros(entry.size) for side in SIDES}
    for case in _cases(source, entry, rudder, surge, 1, np.random.default_rng(0)):
        turn = steady_turn(case.plant, case.speed_loss, entry[case.used], SIDES[case.side])
        log_radius[case.side][case.used] += case.share * np.log(turn.radius[0])
    return {side: np.exp(total) for side, total in log_radius.items()}


@dataclass(frozen=True, slots=True)
class _Case:
    """Turns of one model to one side: places (k,) of its entry speeds, its weights (k,), its plant and its loss of speed."""

    side: str
    used: npt.NDArray[np.int_]
    share: FloatArray
    plant: YawPlant
    speed_loss: SpeedLoss


def _cases(
    source: ParameterSource, entry: FloatArray, rudder: float, surge: SurgeModel | None, draws: int, rng: np.random.Generator
) -> list[_Case]:
    weight = np.zeros((len(source.models), entry.size))
    for i, speed in enumerate(entry):
        for index, share in source.near(float(speed)):
            weight[index, i] = share
    cases = []
    for index, model in enumerate(source.models):
        used = np.flatnonzero(weight[index])
        if used.size:
            plant, speed_loss = _plant_and_speed_loss(model, rudder, surge, draws, rng, entry[used])
            cases += [_Case(side, used, weight[index, used], plant, speed_loss) for side in SIDES]
    return cases


class _Sums:
    """Weighted sums over neighbouring models: of the logarithms of radius, rate and speed, of all else linearly."""

    def __init__(self, draws: int, speeds: int) -> None:
        self.log_radius = np.zeros((draws, speeds))
        self.log_rate, self.log_speed = np.zeros(speeds), np.zeros(speeds)
        self.transient = {f.name: np.zeros(speeds) for f in fields(Transient)}

    def add(self, used: npt.NDArray[np.int_], share: FloatArray, turn: SteadyTurn, transient: Transient) -> None:
        self.log_radius[:, used] += share * np.log(turn.radius)
        self.log_rate[used] += share * np.log(np.abs(turn.rate[0]))
        self.log_speed[used] += share * np.log(turn.speed[0])
        for name, total in self.transient.items():
            total[used] += share * getattr(transient, name)

    def turns(self, entry: FloatArray, effects: tuple[str, ...]) -> BlendedTurns:
        rate, speed = np.exp(self.log_rate), np.exp(self.log_speed)
        return BlendedTurns(entry, np.exp(self.log_radius), rate, speed, Transient(**self.transient), effects)


def _plant_and_speed_loss(
    model: Model, rudder: float, surge: SurgeModel | None, draws: int, rng: np.random.Generator, entry: FloatArray
) -> tuple[YawPlant, SpeedLoss]:
    values, exponents = draw_values(model, draws, rng)
    plant = yaw_plant(model, values, rudder, exponents, entry)
    without_loss = steady_turn(plant.one(), no_speed_loss(1), entry, 1.0)
    middle = int(np.argsort(entry)[entry.size // 2])
    curvature = float(np.abs(without_loss.rate[0, middle]) / without_loss.surge[0, middle])
    return plant, draw_speed_loss(surge, curvature if np.isfinite(curvature) else FALLBACK_CURVATURE, draws, rng)
