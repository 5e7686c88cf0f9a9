"""The white sensor noise of both channels, from the third differences of signals or residuals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan

import numpy as np

from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.white_noise import white_noise_std

MIN_ANGLE_NOISE_RAD = 1e-7

MIN_RATE_NOISE_RAD_S = 1e-7

MIN_WHITE_SHARE = 0.1
"""Least white noise, as a share of the noise floor from third differences: an AR(1) noise that is correlated over many samples
has no white part, but the floor contains half of its increments."""


@dataclass(frozen=True, slots=True)
class WhiteBounds:
    """The bounds of the white noise that a fit may estimate: never less than `least`, and at most twice `floor`."""

    floor: Noise
    least: Noise

    @classmethod
    def near(cls, floor: Noise) -> WhiteBounds:
        """Return the bounds about a floor from third differences."""
        return cls(floor, Noise(MIN_WHITE_SHARE * floor.angle, MIN_WHITE_SHARE * floor.rate))

    @classmethod
    def above(cls, error: Noise) -> WhiteBounds:
        """Return the bounds above an error below which no model follows the motion, whatever the sensors' noise."""
        return cls(error, error)


def white_noise_floor(records: Sequence[Record]) -> Noise:
    """Return the white sensor noise of both channels, pooled over runs."""
    angle = _pooled([white_noise_std(r.angle, r.angle_ok) for r in records])
    rate = _pooled([white_noise_std(r.rate, r.rate_ok) for r in records])
    return Noise(max(angle, MIN_ANGLE_NOISE_RAD), max(rate, MIN_RATE_NOISE_RAD_S))


def lowered_noise_floor(floor: Noise, records: Sequence[Record], residuals: Sequence[FloatArray]) -> Noise:
    """Return the lower, for each channel, of a white noise floor and that of the third differences of residuals [(2, n)].

    Where a vehicle responds within a few samples, the differences of the signals contain its motion; those of a model's residuals
    hardly do.
    """
    angle = _pooled([white_noise_std(e[0], r.angle_ok) for e, r in zip(residuals, records, strict=True)])
    rate = _pooled([white_noise_std(e[1], r.rate_ok) for e, r in zip(residuals, records, strict=True)])
    return Noise(
        *(
            min(was, max(now, least)) if now > 0.0 else was
            for was, now, least in ((floor.angle, angle, MIN_ANGLE_NOISE_RAD), (floor.rate, rate, MIN_RATE_NOISE_RAD_S))
        )
    )


def told_floor(floor: Noise, records: Sequence[Record]) -> Noise:
    """Return a noise floor as results tell it: NaN for a channel that no record measures."""
    angle, rate = (value if any(r.ok[i].any() for r in records) else nan for i, value in enumerate((floor.angle, floor.rate)))
    return Noise(angle, rate)


def _pooled(values: list[float]) -> float:
    known = [v for v in values if np.isfinite(v)]
    return float(np.sqrt(np.mean(np.square(known)))) if known else 0.0
