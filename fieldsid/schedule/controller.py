"""Controllers of one angle, the poles of their loops and their margins.

fin = limit(kp (reference - angle) + ki integral - kd rate + forward + k_ref reference).

`forward` cancels the trim offset of the fin and k_ref the stiffness (pitch), so that the feedback has no steady error to correct.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated

import numpy as np

from fieldsid.numerics.arrays import ComplexArray, FloatArray
from fieldsid.plant.laws.regression import CONFIDENCE_LEVEL
from fieldsid.records.keys import Key
from fieldsid.schedule.linear_plant import LinearPlant, products, roots_of


@dataclass(frozen=True, slots=True)
class Gains:
    """kp (rad/rad), ki (1/s), kd (s); signed like 1/authority, so that kp b > 0."""

    kp: Annotated[float, Key("rad of fin per rad of error.")]
    ki: Annotated[float, Key("rad of fin per rad s.")] = 0.0
    kd: Annotated[float, Key("rad of fin per rad/s.")] = 0.0

    def times(self, factor: float) -> Gains:
        """Return the gains, each multiplied by a factor."""
        return Gains(self.kp * factor, self.ki * factor, self.kd * factor)

    def response(self, omega: FloatArray) -> ComplexArray:
        """Return fin over angle error at frequencies (w,) rad/s, with the rate as the derivative of the angle."""
        s = 1j * omega
        return np.asarray(self.kp + self.ki / s + self.kd * s)

    def blended(self, other: Gains, share: float) -> Gains:
        """Return the gains interpolated linearly: these at share 0, the other ones at 1."""
        return Gains(*(a + share * (b - a) for a, b in ((self.kp, other.kp), (self.ki, other.ki), (self.kd, other.kd))))


KINDS: Mapping[str, str] = MappingProxyType(
    {
        "p": "proportional, kp = a^2 / (4 zeta^2 b)",
        "pd": "proportional and rate, poles at a chosen damping and bandwidth",
        "pi": "proportional and integral: no steady error without knowing the trim",
        "pid": "all three",
        "lqr": "proportional and rate from a quadratic cost on angle and fin",
    }
)


def closed_poles(plant: LinearPlant, gains: Gains) -> ComplexArray:
    """Return the closed loop's poles (d, n) of every draw."""
    numerator, denominator = plant.polynomials
    control = [gains.kd, gains.kp]
    if gains.ki != 0.0:
        control, denominator = [*control, gains.ki], np.pad(denominator, ((0, 0), (0, 1)))
    forward = products(numerator, np.tile(np.array(control), (plant.count, 1)))
    characteristic = denominator.copy()
    characteristic[:, -forward.shape[1] :] += forward
    return roots_of(characteristic)


def least_damping(plant: LinearPlant, gains: Gains) -> FloatArray:
    """Return the smallest damping ratio of the closed loop's poles of every draw, (d,) in -1 .. 1."""
    poles = closed_poles(plant, gains)
    size = np.abs(poles)
    return np.asarray(np.min(np.where(size > 1e-9, -poles.real / np.maximum(size, 1e-9), 1.0), axis=1))


FREQUENCY_GRID_RAD_S = np.geomspace(1e-3, 200.0, 1500)
HELD_SHARE = CONFIDENCE_LEVEL
"""Share of the draws over which the worst value is reported for the identified set."""


@dataclass(frozen=True, slots=True)
class PlantResponse:
    """The frequency response of every draw of a plant: log magnitude and unwrapped phase (d, w) at omega (w,) rad/s."""

    plant: LinearPlant
    omega: FloatArray
    log_size: FloatArray
    phase: FloatArray


@dataclass(frozen=True, slots=True)
class Margins:
    """Smallest margins (d,): phase deg, gain dB (up), delay s, at crossover rad/s; inf where the loop never crosses.

    An unstable closed loop has a negative phase margin, whatever its crossings are, and zero gain and delay margins. `damping` is
    the least damping ratio of the closed loop's poles.
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
    """Return the worst value over 95 % of the draws (d,): the largest if `most`, else the least; NaN counts as worst."""
    ordered = np.sort(np.where(np.isnan(values), np.inf, values if most else -values))
    return float(ordered[int(np.ceil(HELD_SHARE * ordered.size - 1e-9)) - 1]) * (1.0 if most else -1.0)


def plant_response(plant: LinearPlant, omega: FloatArray = FREQUENCY_GRID_RAD_S) -> PlantResponse:
    """Return the response of every draw on the grid (w,) rad/s."""
    response = plant.response(omega)
    return PlantResponse(plant, omega, np.log(np.abs(response)), np.unwrap(np.angle(response), axis=1))


def margins(plant: LinearPlant, gains: Gains) -> Margins:
    """Return the margins of every draw, by interpolation at each crossing on the full frequency grid."""
    return margins_of(plant_response(plant), gains)


def margins_of(response: PlantResponse, gains: Gains) -> Margins:
    """Return the margins of every draw with gains, by interpolation at each crossing of a plant's frequency response."""
    controller = gains.response(response.omega)
    size = response.log_size + np.log(np.abs(controller))
    phase = response.phase + np.unwrap(np.angle(controller))
    # an unwrapped phase may be off by a full turn: a loop with positive gain starts between -360 and 0 deg
    phase -= 2 * np.pi * np.ceil(phase[:, :1] / (2 * np.pi) - 1e-9)
    return _read_off(size, phase, np.log(response.omega), least_damping(response.plant, gains))


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
    # a phase crossing at a gain above one limits the gain from below; the phase margin shows whether the loop is stable
    np.minimum.at(gain_margin, i, np.where(log_size < 0, -20 / np.log(10) * log_size, np.inf))
    unstable = damping < 0.0
    return Margins(
        np.where(unstable, -np.minimum(np.abs(phase_margin), 180.0), phase_margin),
        np.where(unstable, 0.0, gain_margin),
        np.where(unstable, 0.0, delay),
        crossover,
        damping,
    )
