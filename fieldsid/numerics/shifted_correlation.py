"""The correlation of two signals at many shifts at once, and the slope of one on the other.

It is computed block by block by the Fourier transform: n log n operations for all shifts, and memory for one block.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from fieldsid.numerics.arrays import FloatArray

BLOCK_SAMPLES = 1 << 15
ROUNDING_SHARE = 1e-12
"""Share of a signal's power below which the variance of its part at a shift is no more than the rounding error of its sums."""


def shifted_correlations(a: FloatArray, b: FloatArray, reach: int) -> FloatArray:
    """Return the correlation (2 reach + 1,) of a[i + k] with b[i] for k = -reach .. reach, over the overlapping samples.

    a, b: (n,) without gaps, n > reach. 0 where one of them is constant.
    """
    if float(np.ptp(a)) == 0.0 or float(np.ptp(b)) == 0.0:  # the mean of equal numbers is off by rounding
        return np.zeros(2 * reach + 1)
    a, b = a - a.mean(), b - b.mean()
    shifts = np.arange(-reach, reach + 1, dtype=np.int64)
    count = a.size - np.abs(shifts)
    sum_a, sum_b = _sums(a, shifts), _sums(b, -shifts)
    power_a, power_b = _sums(a * a, shifts), _sums(b * b, -shifts)
    variance_a, variance_b = power_a - sum_a**2 / count, power_b - sum_b**2 / count
    varies = (variance_a > ROUNDING_SHARE * (a @ a)) & (variance_b > ROUNDING_SHARE * (b @ b))
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(varies, (_products(a, b, reach) - sum_a * sum_b / count) / np.sqrt(variance_a * variance_b), 0.0)


def slope_of(a: FloatArray, b: FloatArray) -> tuple[float, float]:
    """Return the slope of a (n,) on b (n,), and their absolute correlation; zeros where one of them is constant."""
    a, b = _centred(a), _centred(b)
    power = math.sqrt(float(a @ a) * float(b @ b))
    if power == 0.0:
        return 0.0, 0.0
    correlation = float(a @ b) / power
    # The geometric mean of both regressions, so that noise in either signal does not pull the slope one way.
    return math.copysign(math.sqrt(float(a @ a) / float(b @ b)), correlation), abs(correlation)


def lag_of(a: FloatArray, b: FloatArray, reach: int) -> tuple[float, float]:
    """Return the delay of a relative to b in (fractional) samples, up to reach, and the gain of correlation at that delay.

    a, b: (n,) without gaps, n > reach. Zeros where the correlation has no peak within reach.
    """
    size = np.abs(shifted_correlations(a, b, reach))
    best = int(np.argmax(size))
    if not 0 < best < len(size) - 1:
        return 0.0, 0.0
    left, middle, right = size[best - 1 : best + 2]
    curvature = left - 2 * middle + right
    shift = float(0.5 * (left - right) / curvature) if curvature != 0.0 else 0.0
    return best - reach + shift, float(size[best] - size[reach])


def _centred(values: FloatArray) -> FloatArray:
    """Return values less their mean; zeros where all are equal, where the difference would be a rounding error."""
    return np.zeros_like(values) if float(np.ptp(values)) == 0.0 else values - values.mean()


def _sums(values: FloatArray, shifts: npt.NDArray[np.int64]) -> FloatArray:
    """Return the sum of the overlapping samples at each shift k: all without the first k, or without the last -k."""
    reach = int(np.abs(shifts).max())
    first = np.concatenate([[0.0], np.cumsum(values[:reach])])
    last = np.concatenate([[0.0], np.cumsum(values[::-1][:reach])])
    return np.asarray(values.sum() - np.where(shifts > 0, first[np.abs(shifts)], last[np.abs(shifts)]))


def _products(a: FloatArray, b: FloatArray, reach: int) -> FloatArray:
    """Return the sum of a[i + k] b[i] for each shift k."""
    total = np.zeros(2 * reach + 1)
    padded = np.concatenate([np.zeros(reach), a, np.zeros(reach)])
    # a block is no shorter than the shifts reach, or their number would grow with the length of the log, and so would each
    length = min(max(BLOCK_SAMPLES, reach), b.size)
    size = 1 << (length + 2 * reach - 1).bit_length()  # of any other length a transform may take ten times as long
    for start in range(0, b.size, length):
        block = b[start : start + length]
        spectrum = np.fft.rfft(padded[start : start + block.size + 2 * reach], size) * np.conj(np.fft.rfft(block, size))
        total += np.fft.irfft(spectrum, size)[: 2 * reach + 1]
    return total
