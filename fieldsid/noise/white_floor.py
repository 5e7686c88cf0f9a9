"""The white-noise floor of a signal from its third differences."""

from __future__ import annotations

from collections.abc import Sequence
from math import comb

import numpy as np
import numpy.typing as npt

from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import BoolArray, FloatArray

DIFFERENCE_ORDER = 3

MAX_FLOOR_SAMPLES, BLOCK_SAMPLES = 50_000, 1_000
"""Samples that determine the floor well enough; of longer records, blocks spread over them are used."""

MIN_ANGLE_NOISE_RAD = 1e-7

MIN_RATE_NOISE_RAD_S = 1e-7


def white_floor(values: FloatArray, ok: BoolArray) -> float:
    """Return the white-noise standard deviation of a smooth signal from its third differences.

    A polynomial of degree 2 vanishes in them; white noise leaves binom(6, 3) times its variance. A trimmed mean excludes the
    kinks at fin steps. Returns NaN with fewer than 20 samples in a row.
    """
    if values.size > MAX_FLOOR_SAMPLES:
        parts = [
            slice(i, i + BLOCK_SAMPLES)
            for i in range(0, values.size - BLOCK_SAMPLES, values.size * BLOCK_SAMPLES // MAX_FLOOR_SAMPLES)
        ]
        d = np.concatenate([_differences(values[p], ok[p]) for p in parts])
    else:
        d = _differences(values, ok)
    if d.size < 20:
        return float("nan")
    square = np.sort(d * d)
    keep = square[: int(0.9 * square.size)]
    # E[x^2 | x^2 < q90] of a standard normal is 0.5849: the trimmed mean made unbiased
    full, trimmed = float(square.mean()), float(keep.mean()) / 0.5849
    return float(np.sqrt(max(min(full, trimmed), 0.0) / comb(2 * DIFFERENCE_ORDER, DIFFERENCE_ORDER)))


def _differences(values: FloatArray, ok: npt.NDArray[np.bool_]) -> FloatArray:
    """Return the third differences of samples that were all measured."""
    d = np.diff(values, DIFFERENCE_ORDER)
    return d if ok.all() else d[np.lib.stride_tricks.sliding_window_view(ok, DIFFERENCE_ORDER + 1).all(axis=1)]


def white_noise_floor(records: Sequence[Record]) -> Noise:
    """Return the white sensor noise of both channels, pooled over runs."""
    angle = _pooled([white_floor(r.angle, r.angle_ok) for r in records])
    rate = _pooled([white_floor(r.rate, r.rate_ok) for r in records])
    return Noise(max(angle, MIN_ANGLE_NOISE_RAD), max(rate, MIN_RATE_NOISE_RAD_S))


def lowered_noise_floor(floor: Noise, records: Sequence[Record], residuals: Sequence[FloatArray]) -> Noise:
    """Return a floor (white, both channels), lowered to what the third differences of a model's residuals [(2, n)] show.

    Where a vehicle answers within a few samples, the signals' own differences contain its motion; the residuals hardly do.
    """
    angle = _pooled([white_floor(e[0], r.angle_ok) for e, r in zip(residuals, records, strict=True)])
    rate = _pooled([white_floor(e[1], r.rate_ok) for e, r in zip(residuals, records, strict=True)])
    return Noise(
        *(
            min(was, max(now, least)) if now > 0.0 else was
            for was, now, least in ((floor.angle, angle, MIN_ANGLE_NOISE_RAD), (floor.rate, rate, MIN_RATE_NOISE_RAD_S))
        )
    )


def _pooled(values: list[float]) -> float:
    known = [v for v in values if np.isfinite(v)]
    return float(np.sqrt(np.mean(np.square(known)))) if known else 0.0
