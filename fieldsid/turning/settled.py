"""Settled turns of a source of models at any speed: each model scaled by its own law, neighbours in speed blended."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from fieldsid.copies import each
from fieldsid.logs.run import FloatArray
from fieldsid.models.model import Model
from fieldsid.turning.plant import Plant, plant_of
from fieldsid.turning.prediction import SIDES
from fieldsid.turning.source import Source, draw_values
from fieldsid.turning.steady import SteadyTurn, steady_turn
from fieldsid.turning.surge import Slowing, SurgeModel, draw_slowing, no_slowing
from fieldsid.turning.transient import Transient, turn_transient

FALLBACK_CURVATURE = 0.3


@dataclass(frozen=True, slots=True)
class SettledTurns:
    """Turns to one side from entry speeds (s,): radius (d, s) over draws; magnitudes (s,) of rate and path speed; transient."""

    entry: FloatArray
    radius: FloatArray
    rate: FloatArray
    path_speed: FloatArray
    transient: Transient
    effects: tuple[str, ...]


def settled_turns(
    source: Source, entry: FloatArray, rudder: float, surge: SurgeModel | None, draws: int, rng: np.random.Generator
) -> dict[str, SettledTurns]:
    """Return the settled turns of a source's models with the rudder held at `rudder` rad, to either side by name."""
    weight = np.zeros((len(source.models), entry.size))
    for i, speed in enumerate(entry):
        for index, share in source.near(float(speed)):
            weight[index, i] = share
    asked = []
    for index, model in enumerate(source.models):
        used = np.flatnonzero(weight[index])
        if used.size:
            plant, slowing = _plant_and_slowing(model, rudder, surge, draws, rng, entry[used])
            asked += [(side, index, used, plant, slowing) for side in SIDES]

    def turned(of: tuple[str, int, npt.NDArray[np.int_], Plant, Slowing]) -> tuple[SteadyTurn, Transient]:
        side, _, used, plant, slowing = of
        turn = steady_turn(plant, slowing, entry[used], SIDES[side])
        return turn, turn_transient(plant, slowing, entry[used], SIDES[side], rudder)

    sums = {side: _Sums(draws, entry.size) for side in SIDES}
    for (side, index, used, _, _), (turn, after) in zip(asked, each(turned, asked), strict=True):
        sums[side].add(used, weight[index, used], turn, after)
    effects = tuple(sorted({e for m in source.models for e in m.effects}))
    return {side: total.turns(entry, effects) for side, total in sums.items()}


class _Sums:
    """Weighted sums over neighbouring models: logarithms of what is positive and multiplies, the rest as it is."""

    def __init__(self, draws: int, speeds: int) -> None:
        self.log_radius = np.zeros((draws, speeds))
        self.log_rate, self.log_speed = np.zeros(speeds), np.zeros(speeds)
        self.after = {f.name: np.zeros(speeds) for f in fields(Transient)}

    def add(self, used: npt.NDArray[np.int_], share: FloatArray, turn: SteadyTurn, after: Transient) -> None:
        self.log_radius[:, used] += share * np.log(turn.radius)
        self.log_rate[used] += share * np.log(np.abs(turn.rate[0]))
        self.log_speed[used] += share * np.log(turn.speed[0])
        for name, total in self.after.items():
            total[used] += share * getattr(after, name)

    def turns(self, entry: FloatArray, effects: tuple[str, ...]) -> SettledTurns:
        rate, speed = np.exp(self.log_rate), np.exp(self.log_speed)
        return SettledTurns(entry, np.exp(self.log_radius), rate, speed, Transient(**self.after), effects)


def _plant_and_slowing(
    model: Model, rudder: float, surge: SurgeModel | None, draws: int, rng: np.random.Generator, entry: FloatArray
) -> tuple[Plant, Slowing]:
    values, exponents = draw_values(model, draws, rng)
    plant = plant_of(model, values, rudder, exponents, entry)
    kept = steady_turn(plant.one(), no_slowing(1), entry, 1.0)
    middle = int(np.argsort(entry)[entry.size // 2])
    curvature = float(np.abs(kept.rate[0, middle]) / kept.surge[0, middle])
    return plant, draw_slowing(surge, curvature if np.isfinite(curvature) else FALLBACK_CURVATURE, draws, rng)
