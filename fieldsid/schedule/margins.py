"""Gain, phase and delay margins of all draws at once, on a frequency grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldsid.numerics.arrays import FloatArray
from fieldsid.plant.laws.regression import CONFIDENCE_LEVEL
from fieldsid.schedule.controller import Gains, least_damping
from fieldsid.schedule.linear_plant import LinearPlant

FREQUENCY_GRID_RAD_S = np.geomspace(1e-3, 200.0, 1500)
HELD_SHARE = CONFIDENCE_LEVEL
"""Share of the draws that a number of the identified set speaks for."""


@dataclass(frozen=True, slots=True)
class PlantResponse:
    """What of every draw's loop on a grid is the plant's, whatever the gains: log size and unwrapped phase (d, w), rad/s (w,)."""

    plant: LinearPlant
    omega: FloatArray
    log_size: FloatArray
    phase: FloatArray


@dataclass(frozen=True, slots=True)
class Margins:
    """Smallest margins (d,): phase deg, gain dB (up), delay s, at crossover rad/s; inf where the loop never crosses.

    An unstable closed loop has a phase margin below zero, whatever its crossings are, and no other margin. `damping` is the least
    damping ratio of the closed loop's poles.
    """

    phase_deg: FloatArray
    gain_db: FloatArray
    delay_s: FloatArray
    crossover: FloatArray
    damping: FloatArray

    def worst(self) -> tuple[float, float, float]:
        """Return the smallest phase, gain and delay margin over 95 % of the draws."""
        phase, gain, delay = (worst_of(part, most=False) for part in (self.phase_deg, self.gain_db, self.delay_s))
        return phase, gain, delay


def worst_of(values: FloatArray, *, most: bool) -> float:
    """Return the worst of a number over 95 % of the draws (d,): the largest where `most`, else the least; NaN is worse."""
    ordered = np.sort(np.where(np.isnan(values), np.inf, values if most else -values))
    return float(ordered[int(np.ceil(HELD_SHARE * ordered.size - 1e-9)) - 1]) * (1.0 if most else -1.0)


def plant_response(plant: LinearPlant, omega: FloatArray = FREQUENCY_GRID_RAD_S) -> PlantResponse:
    """Return the response of every draw on the grid (w,) rad/s."""
    response = plant.response(omega)
    return PlantResponse(plant, omega, np.log(np.abs(response)), np.unwrap(np.angle(response), axis=1))


def margins(plant: LinearPlant, gains: Gains) -> Margins:
    """Return the margins of every draw, from the whole grid by interpolation at each crossing."""
    return margins_of(plant_response(plant), gains)


def margins_of(known: PlantResponse, gains: Gains) -> Margins:
    """Return the margins of every draw with gains, from a plant's response on a grid by interpolation at each crossing."""
    controller = gains.response(known.omega)
    size = known.log_size + np.log(np.abs(controller))
    phase = known.phase + np.unwrap(np.angle(controller))
    # an unwrapped phase may sit a turn off: a loop with positive gain starts between -360 and 0
    phase -= 2 * np.pi * np.ceil(phase[:, :1] / (2 * np.pi) - 1e-9)
    return _read_off(size, phase, np.log(known.omega), least_damping(known.plant, gains))


def _read_off(size: FloatArray, phase: FloatArray, log_omega: FloatArray, damping: FloatArray) -> Margins:
    count = size.shape[0]
    phase_margin, delay, crossover, gain_margin = (np.full(count, fill) for fill in (np.inf, np.inf, np.nan, np.inf))
    i, j = np.nonzero((size[:, :-1] > 0) != (size[:, 1:] > 0))
    share = size[i, j] / (size[i, j] - size[i, j + 1])
    omega = np.exp(log_omega[j] + share * (log_omega[j + 1] - log_omega[j]))
    margin = np.pi - np.mod(-phase[i, j] - share * (phase[i, j + 1] - phase[i, j]), 2 * np.pi)
    np.minimum.at(phase_margin, i, np.degrees(margin))
    np.minimum.at(delay, i, np.maximum(margin, 0.0) / omega)
    least = np.degrees(margin) == phase_margin[i]
    crossover[i[least]] = omega[least]
    turns = np.floor((phase + np.pi) / (2 * np.pi))
    i, j = np.nonzero(turns[:, :-1] != turns[:, 1:])
    line = 2 * np.pi * np.maximum(turns[i, j], turns[i, j + 1]) - np.pi
    share = (line - phase[i, j]) / (phase[i, j + 1] - phase[i, j])
    log_size = size[i, j] + share * (size[i, j + 1] - size[i, j])
    # a crossing above one is a gain that may not fall below it; whether the loop is stable there, the phase margin says
    np.minimum.at(gain_margin, i, np.where(log_size < 0, -20 / np.log(10) * log_size, np.inf))
    unstable = damping < 0.0
    return Margins(
        np.where(unstable, -np.minimum(np.abs(phase_margin), 180.0), phase_margin),
        np.where(unstable, 0.0, gain_margin),
        np.where(unstable, 0.0, delay),
        crossover,
        damping,
    )
