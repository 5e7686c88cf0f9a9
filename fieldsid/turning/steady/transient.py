"""The turn before it settles: rudder hard over from a straight run, until the heading has changed by 180 degrees.

Tactical diameter, advance and transfer as in the ships' turning test (IMO MSC.137(76)): advance and transfer at 90 degrees,
tactical diameter across the approach track at 180 degrees.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldsid.models.effect import power_drag
from fieldsid.models.helpers.strip_theory import strip_force, strip_moment
from fieldsid.numerics.arrays import FloatArray
from fieldsid.plant.yaw_plant import YawPlant, fin_after_step
from fieldsid.turning.steady.speed_loss import SpeedLoss

STEP_S = 0.04
MAX_TRANSIENT_S = 240.0
CHECK_EVERY = 100


@dataclass(frozen=True, slots=True)
class Transient:
    """For entry speeds (s,): time to 90 and 180 deg (s), path length to 180 deg, advance, transfer, tactical diameter (m).

    NaN where the turn was not completed in four minutes.
    """

    time_90: FloatArray
    time_180: FloatArray
    path_180: FloatArray
    advance: FloatArray
    transfer: FloatArray
    tactical_diameter: FloatArray


def turn_transient(plant: YawPlant, speed_loss: SpeedLoss, entry: FloatArray, side: float, command: float) -> Transient:
    """Simulate the estimate (draw 0) of a plant through a turn to `side` at a rudder command (rad, magnitude)."""
    one, slow = plant.one(), speed_loss.one()
    fin_time, fin_angle = fin_after_step(plant, side, command)
    count = round(MAX_TRANSIENT_S / STEP_S)
    state = np.zeros((7, entry.size))
    state[2] = entry
    track: FloatArray = np.empty((count + 1, 4, entry.size), dtype=np.float64)
    track[0] = 0.0
    done = count
    for i in range(count):
        middle = (i + 0.5) * STEP_S
        fin = float(np.interp(middle, fin_time, fin_angle))
        half = state + 0.5 * STEP_S * _slope(state, one, slow, entry, fin)
        state = state + STEP_S * _slope(half, one, slow, entry, fin)
        track[i + 1, 0], track[i + 1, 1:] = state[0], state[3:6]
        if i % CHECK_EVERY == 0 and bool(np.all(np.abs(state[0]) > np.pi + 0.2)):
            done = i + 1
            break
    return read_off(STEP_S * np.arange(done + 1, dtype=np.float64), track[: done + 1], side)


def _slope(state: FloatArray, plant: YawPlant, speed_loss: SpeedLoss, entry: FloatArray, fin: float) -> FloatArray:
    """Return the derivative (7, s) of heading, rate, surge, x, y, path, and the cross state over the speed's scale.

    The cross state is a moment -a21 v with a21 ~ u, so x/scale goes with v and stays itself while the speed falls.
    """
    heading, rate, surge = state[0], state[1], np.maximum(state[2], 0.05)
    speed = surge[None, :]
    scale = plant.scale(speed)[0]
    core = {n: c.at(plant.scale(speed))[0] for n, c in plant.core.items()}
    moment = plant.authority_at(speed)[0] * fin + plant.trim_at(speed)[0] + plant.moment[0]
    moment = moment - plant.damping_at(speed)[0] * rate - core["quadratic"] * power_drag(rate, core["beyond_square"])
    moment = moment + core["cross_share"] * scale * state[6]
    along_hull = core["strip_flow"] * scale * state[6]
    moment = moment - core["strip_moment"] * strip_moment(along_hull, rate)
    drift = (core["cross_fin"] * fin - core["cross_rate"] * rate - core["strip_force"] * strip_force(along_hull, rate)[0]) / scale
    drift = drift - (core["cross_damping"] + core["cross_quadratic"] * scale * np.abs(state[6])) * state[6]
    drag, turn, loss = speed_loss.drag[0], speed_loss.turn[0], speed_loss.fin[0]
    slower = drag * (entry**2 - surge**2 * (1.0 + loss * fin**2) - turn * rate**2)
    sway = -speed_loss.drift_per_rate[0] * rate
    along = surge * np.cos(heading) - sway * np.sin(heading)
    across = surge * np.sin(heading) + sway * np.cos(heading)
    return np.stack([rate, moment, slower, along, across, np.hypot(surge, sway), drift])


def read_off(time: FloatArray, track: FloatArray, side: float) -> Transient:
    """Return the turn of tracks (n, 4, s) of heading (rad), north, east and path (m) at times (n,) s, toward `side`."""
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
