"""The transient of a turn: a rudder step from a straight run, until the heading has changed by 180 degrees.

Advance, transfer and tactical diameter as in the turning test of ships (IMO MSC.137(76)): advance and transfer at 90 degrees,
tactical diameter across the approach track at 180 degrees.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from fieldsid.dynamics.steady_kernel import between
from fieldsid.models.hull import core_at, kinds_of, named, power, slope, surge_slope
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit
from fieldsid.plant.yaw_plant import LEAST_SURGE_M_S, STEP_S, YawPlant, fins_after_step
from fieldsid.turning.steady.speed_loss import SpeedLoss

MAX_TRANSIENT_S = 240.0
"""The longest simulated turn through 180 deg."""


@dataclass(frozen=True, slots=True)
class Transient:
    """For entry speeds (s,): time to 90 and 180 deg (s), path length to 180 deg, advance, transfer, tactical diameter (m).

    NaN where the turn did not reach the angle in the simulated time.
    """

    time_90: FloatArray
    time_180: FloatArray
    path_180: FloatArray
    advance: FloatArray
    transfer: FloatArray
    tactical_diameter: FloatArray

    def of(self, index: int) -> dict[str, Any]:
        """Return the lengths (m) of one turn by their names in `TurnRow`; `u_turn_radius` is the path to 180 deg over pi."""
        lengths = {name: getattr(self, name)[index] for name in ("advance", "transfer", "tactical_diameter")}
        return {name: float(value) for name, value in {**lengths, "u_turn_radius": self.path_180[index] / np.pi}.items()}


class _Vehicle(NamedTuple):
    """The estimate (draw 0) of a plant and of its loss of speed as numbers for the kernel, see `YawPlant` and `SpeedLoss`."""

    core: FloatArray
    powers: FloatArray
    law: tuple[FloatArray, FloatArray]
    reference: float
    damping: float
    damping_exponent: float
    damping_added: float
    authority: float
    trim: float
    trim_per_authority: float
    drag: float
    fin_loss: float
    turn_loss: float
    drift_per_rate: float


def turn_transient(plant: YawPlant, speed_loss: SpeedLoss, entry: FloatArray, side: float, command: float) -> Transient:
    """Return the simulated transient of a plant's estimate (draw 0) for a turn to `side` at a rudder command (rad, magnitude)."""
    one, loss = plant.one(), speed_loss.one()
    middles = (np.arange(round(MAX_TRANSIENT_S / STEP_S)) + 0.5) * STEP_S
    fins = [np.interp(middles, *path) for path in fins_after_step(plant, side, command, entry)]
    rates, moments = plant.own_moment[side]
    track = np.empty((entry.size, middles.size + 1, 4))
    for j, speed in enumerate(entry):
        vehicle, own = _vehicle(one, loss, j), moments[j % len(moments)]
        fly_turn(vehicle, float(speed), float(plant.moment[0, j]), fins[j % len(fins)], (rates, own), STEP_S, track[j])
    return read_off(STEP_S * np.arange(middles.size + 1, dtype=np.float64), track.transpose(1, 2, 0), side)


def _vehicle(one: YawPlant, loss: SpeedLoss, entry: int) -> _Vehicle:
    """Return the numbers of a plant of one draw at the entry speed with the index `entry`."""
    reference = one.model.law.reference
    known = reference if np.isfinite(reference) and reference > 0.0 else 0.0
    there = one.authority_at(np.full((1, 1), known or 1.0))
    of_fin = one.trim * one.factors[1] / there if one.model.law.trim_of_fin else np.zeros((1, 1))
    trim = np.zeros((1, 1)) if one.model.law.trim_of_fin else one.trim
    numbers = (
        one.damping * one.factors[0], one.damping_exponent, one.damping_added, one.authority_ratio * one.factors[1], trim, of_fin,
        loss.drag, loss.fin, loss.turn, loss.drift_per_rate,
    )  # fmt: skip
    return _Vehicle(one.core[0].copy(), one.powers, one.law, known, *(float(n[0, entry % n.shape[1]]) for n in numbers))


@jit
def fly_turn(
    vehicle: _Vehicle, entry: float, pushed: float, fins: FloatArray, own: tuple[FloatArray, FloatArray], step: float,
    track: FloatArray,
) -> None:  # fmt: skip
    """Fill track (n + 1, 4) with heading, north, east and path of a turn under fins (n,) rad, by the midpoint rule.

    `pushed` (rad/s^2) is the moment of thrust and other signals. `own` are rates (r,) and the moment (r,) at them of effects
    outside the core, empty without any. The cross state is the moment -a21 v with a21 ~ u; divided by the speed scale it is
    proportional to v, which does not jump while the speed falls.
    """
    kinds, core = kinds_of(vehicle.core), np.empty(vehicle.core.size)
    heading, rate, surge, north, east, path, cross = 0.0, 0.0, entry, 0.0, 0.0, 0.0, 0.0
    track[0, :] = 0.0
    for i in range(fins.size):
        t, to_heading, to_rate, to_surge, to_north, to_east, to_path, to_cross = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for _ in range(2):
            r, u, at = rate + t * to_rate, max(surge + t * to_surge, LEAST_SURGE_M_S), heading + t * to_heading
            scale = u / vehicle.reference if vehicle.reference > 0.0 else 1.0
            core_at(vehicle.core, vehicle.powers, scale, core)
            authority = vehicle.authority * between(np.log(u), *vehicle.law) * u * u
            damping = vehicle.damping * power(scale, vehicle.damping_exponent) + vehicle.damping_added
            moment = authority * (fins[i] + vehicle.trim_per_authority) + vehicle.trim + pushed + between(r, *own)
            now = slope(named(core), kinds, damping, 0.0, moment, fins[i], 1.0, 0.0, r, scale * (cross + t * to_cross), 0.0)
            sway = -vehicle.drift_per_rate * r
            to_heading, to_rate, to_cross = r, now.rate, now.cross / scale
            to_surge = surge_slope(u, entry, vehicle.drag, vehicle.fin_loss, vehicle.turn_loss, fins[i], r)
            to_north, to_east = u * np.cos(at) - sway * np.sin(at), u * np.sin(at) + sway * np.cos(at)
            to_path, t = np.sqrt(u * u + sway * sway), 0.5 * step
        heading, rate, surge, cross = (
            heading + step * to_heading,
            rate + step * to_rate,
            surge + step * to_surge,
            cross + step * to_cross,
        )
        north, east, path = north + step * to_north, east + step * to_east, path + step * to_path
        track[i + 1, 0], track[i + 1, 1], track[i + 1, 2], track[i + 1, 3] = heading, north, east, path


def read_off(time: FloatArray, track: FloatArray, side: float) -> Transient:
    """Return the transients of tracks (n, 4, s), with heading (rad), north, east and path (m) at times (n,) s, toward `side`."""
    columns = [
        _one(time, side * track[:, 0, j], track[:, 1, j], side * track[:, 2, j], track[:, 3, j]) for j in range(track.shape[2])
    ]
    return Transient(*(np.array(c) for c in zip(*columns, strict=True)))


def _one(time: FloatArray, turned: FloatArray, along: FloatArray, across: FloatArray, path: FloatArray) -> tuple[float, ...]:
    quarter, half = 0.5 * np.pi, np.pi

    def at(angle: float, values: FloatArray) -> float:
        if float(turned[-1]) < angle:
            return float("nan")
        later = int(np.argmax(turned >= angle))
        return float(np.interp(angle, turned[later - 1 : later + 1], values[later - 1 : later + 1]))

    return (at(quarter, time), at(half, time), at(half, path), at(quarter, along), at(quarter, across), at(half, across))
