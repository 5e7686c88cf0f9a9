"""Controllers of one angle: fin = limit(kp (reference - angle) + ki integral - kd rate + forward + k_ref reference).

`forward` cancels the trim offset of the fin, k_ref the stiffness (pitch): then the loop has nothing steady left to do.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated

import numpy as np

from fieldsid.numerics.arrays import ComplexArray, FloatArray
from fieldsid.records.keys import Key
from fieldsid.schedule.linear_plant import LinearPlant, products, roots_of


@dataclass(frozen=True, slots=True)
class Gains:
    """kp (rad/rad), ki (1/s), kd (s); signed like 1/authority, so that kp b > 0."""

    kp: Annotated[float, Key("rad of fin per rad of error.")]
    ki: Annotated[float, Key("rad of fin per rad s.")] = 0.0
    kd: Annotated[float, Key("rad of fin per rad/s.")] = 0.0

    def times(self, factor: float) -> Gains:
        """Return all gains multiplied."""
        return Gains(self.kp * factor, self.ki * factor, self.kd * factor)

    def response(self, omega: FloatArray) -> ComplexArray:
        """Return fin over angle error at frequencies (w,), the rate taken as the angle's own."""
        s = 1j * omega
        return np.asarray(self.kp + self.ki / s + self.kd * s)

    def blended(self, other: Gains, share: float) -> Gains:
        """Return (1 - share) of these and share of the others."""
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
    whole = denominator.copy()
    whole[:, -forward.shape[1] :] += forward
    return roots_of(whole)


def least_damping(plant: LinearPlant, gains: Gains) -> FloatArray:
    """Return the smallest damping ratio of the closed loop's poles of every draw, (d,) in -1 .. 1."""
    poles = closed_poles(plant, gains)
    size = np.abs(poles)
    return np.asarray(np.min(np.where(size > 1e-9, -poles.real / np.maximum(size, 1e-9), 1.0), axis=1))
