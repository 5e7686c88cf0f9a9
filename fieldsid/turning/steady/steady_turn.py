"""The steady circle of a plant: yaw rate, speed kept and radius, with speed lost and drift, for all draws and speeds at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fieldsid.dynamics.free_run import command_record
from fieldsid.models.axis import Axis
from fieldsid.models.effect import power_drag
from fieldsid.models.helpers.strip_theory import settled_cross_state, strip_moment
from fieldsid.numerics.arrays import FloatArray
from fieldsid.plant.yaw_plant import YawPlant, own_moment
from fieldsid.turning.steady.speed_loss import SpeedLoss

MAX_TURN_ITERATIONS = 60
MAX_BISECTIONS = 48
TOLERANCE = 1e-10
MAX_RATE_RAD_S = 20.0
"""rad/s; a rate that would be above is no steady turn but an unstable model."""


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
    moments = _moment_tables(plant)
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


def balance(plant: YawPlant, surge: FloatArray, fin: FloatArray, side: float, moments: Mapping[str, FloatArray]) -> FloatArray:
    """Return the steady rate (d, s) toward `side` at a surge speed (d, s), NaN where there is none."""
    scale = plant.scale(surge)
    core = {n: c.at(scale) for n, c in plant.core.items()}
    coupled = core["cross_damping"] > 0
    seen = plant.sway_seen * core["cross_share"]
    inverse = np.where(coupled, seen / np.where(coupled, core["cross_damping"], 1.0), 0.0)
    linear = plant.damping_at(surge) + core["cross_rate"] * inverse
    push = plant.authority_at(surge) * fin + plant.trim_at(surge) + plant.moment + core["cross_fin"] * inverse * fin
    drive = side * push
    curved = ("cross_quadratic", "beyond_square", "strip_moment", "strip_force")
    if not moments and not any(np.any(core[name]) for name in curved):
        return side * _quadratic_root(linear, core["quadratic"], drive)
    return side * _bisected(plant, core, linear, drive, side * fin, side, moments)


def _quadratic_root(linear: FloatArray, quadratic: FloatArray, drive: FloatArray) -> FloatArray:
    """Return r >= 0 of linear r + quadratic r^2 = drive, NaN where there is none."""
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(linear**2 + 4.0 * quadratic * drive)
        stable = 2.0 * drive / (linear + root)
        curved = (root - linear) / (2.0 * quadratic)
        rate = np.where((linear > 0) | (quadratic <= 0), stable, curved)
    good = (drive > 0) & ((linear > 0) | (quadratic > 0)) & (rate < MAX_RATE_RAD_S)
    return np.where(good, rate, np.nan)


def _bisected(
    plant: YawPlant,
    core: Mapping[str, FloatArray],
    linear: FloatArray,
    drive: FloatArray,
    fin: FloatArray,
    side: float,
    moments: Mapping[str, FloatArray],
) -> FloatArray:
    low = np.zeros(np.broadcast(linear, drive).shape)
    high = np.full_like(low, MAX_RATE_RAD_S)

    def surplus(rate: FloatArray) -> FloatArray:
        left = drive - linear * rate - core["quadratic"] * power_drag(rate, core["beyond_square"])
        if np.any(core["cross_quadratic"]) or np.any(core["strip_moment"]) or np.any(core["strip_force"]):
            push = core["cross_fin"] * fin - core["cross_rate"] * rate
            settled = _settled(core, push, rate)
            left = left + plant.sway_seen * core["cross_share"] * (settled - push / core["cross_damping"])
            left = left - core["strip_moment"] * strip_moment(core["strip_flow"] * settled, rate)
        if moments:
            left = left + side * np.interp(side * rate, moments["rate"], moments["moment"])
        return left

    good = (surplus(low + 1e-9) > 0) & (surplus(high) < 0)
    for _ in range(MAX_BISECTIONS):
        middle = 0.5 * (low + high)
        above = surplus(middle) > 0
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    return np.where(good, 0.5 * (low + high), np.nan)


def _settled(core: Mapping[str, FloatArray], push: FloatArray, rate: FloatArray) -> FloatArray:
    """Return the cross state that an input leads to in a steady turn, arrays alike."""
    return settled_cross_state(
        push, rate, core["cross_damping"], core["cross_quadratic"], core["strip_force"], core["strip_flow"]
    )


def _moment_tables(plant: YawPlant) -> dict[str, FloatArray]:
    """Return the moment against the rate of effects outside the core, at the estimate; empty where there are none."""
    if all(e.moment is None for e in plant.effects):
        return {}
    rate = np.linspace(-2.0, 2.0, 81)
    reference = plant.model.law.reference
    record = command_record(Axis.YAW, np.arange(40) * 0.1, np.zeros(40), speed=reference if np.isfinite(reference) else 1.0)
    values = {c.name: c.start for e in plant.effects for c in e.nuisance} | dict(plant.model.values)
    return {"rate": rate, "moment": own_moment(plant.effects, values, rate, record)}
