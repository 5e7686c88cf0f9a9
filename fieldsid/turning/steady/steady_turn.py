"""The steady circle of a plant: yaw rate, speed kept and radius, with speed lost and drift, for all draws and speeds at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldsid.dynamics.free_run import command_record
from fieldsid.dynamics.steady_kernel import settled_rates
from fieldsid.models.axis import Axis
from fieldsid.models.hull import CROSS_SHARE
from fieldsid.numerics.arrays import FloatArray
from fieldsid.plant.yaw_plant import YawPlant, own_moment
from fieldsid.turning.steady.speed_loss import SpeedLoss

MAX_TURN_ITERATIONS = 60
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
    moments = _moment_table(plant)
    for _ in range(MAX_TURN_ITERATIONS):
        rate = balance(plant, surge, fin, side, moments)
        new = start / speed_loss.factor(fin, np.nan_to_num(rate) / surge)
        change = float(np.max(np.abs(new - surge) / start))
        surge = new
        if change < TOLERANCE:
            break
    path = surge * np.hypot(1.0, speed_loss.drift_per_rate * np.nan_to_num(rate) / surge)
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = path / np.abs(rate)
    return SteadyTurn(rate, surge, path, radius)


def balance(
    plant: YawPlant, surge: FloatArray, fin: FloatArray, side: float, moments: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """Return the steady rate (d, s) toward `side` at a surge speed (d, s), NaN where there is none."""
    core = plant.core[:, None, :] * plant.scale(surge)[:, :, None] ** plant.powers
    core[:, :, CROSS_SHARE] *= plant.sway_seen
    moment = plant.authority_at(surge) * fin + plant.trim_at(surge) + plant.moment
    damping, moment, fins = (np.broadcast_to(part, surge.shape).flatten() for part in (plant.damping_at(surge), moment, fin))
    out = np.empty(surge.size)
    settled_rates(core.reshape(surge.size, -1), damping, moment, fins, side, *moments, out)
    return out.reshape(surge.shape)


def _moment_table(plant: YawPlant) -> tuple[FloatArray, FloatArray]:
    """Return rates and the moment there of effects outside the core, at the estimate; empty where there are none."""
    if all(e.moment is None for e in plant.effects):
        return np.zeros(0), np.zeros(0)
    rate = np.linspace(-2.0, 2.0, 81)
    reference = plant.model.law.reference
    record = command_record(Axis.YAW, np.arange(40) * 0.1, np.zeros(40), speed=reference if np.isfinite(reference) else 1.0)
    values = {c.name: c.start for e in plant.effects for c in e.nuisance} | dict(plant.model.values)
    return rate, own_moment(plant.effects, values, rate, record)
