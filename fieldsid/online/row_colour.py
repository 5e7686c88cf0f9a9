"""Covariance of the recursive estimate under coloured residuals, from lagged products of the rows, in constant memory.

Cov = N^-1 (F' S F) N^-1 as for the block estimate, with F' S F = sum_j (C_j + C_j') gamma_j over lags j. Rows w = [phi, q] are
averaged in bins of half a filter time constant, over which the filtered phi hardly change. M_j = sum_B w_B w_(B-j)' contains the
C_j of the columns and, for any Theta, the autocovariance [-Theta, 1] M_j [-Theta, 1]' of the residual: the colour is that of the
residual of the present estimate, though no row is stored. An autoregression smooths gamma, Parzen's window keeps the sum
positive. Source: Ljung 1999, section 9.5; Newey and West 1987, Econometrica 55(3); Priestley 1981, section 6.2.3 (window).
"""

from __future__ import annotations

import numpy as np

from fieldsid.fitting.regression.residual_colour_covariance import MAX_AR_ORDER, autoregression
from fieldsid.numerics.arrays import FloatArray

BIN_TIME_CONSTANTS = 0.5
LAGS = 128
"""Bins over which correlation is followed: 16 s at a bandwidth of 4 rad/s."""
FEWEST_BINS = 20
"""Bins below which no colour is estimated."""
WIDTH = 5
AKAIKE = 2.0
"""Penalty of a coefficient of the residual's autoregression; Schwarz's would give too low an order for a slow disturbance in
addition to white noise."""


class RowColour:
    """Lagged products of binned regression rows; `forgetting` is the recursion's factor, squared in a covariance."""

    __slots__ = ("_bin_s", "_count", "_forget", "_index", "_recent", "_rows", "_samples", "_sum", "_weight", "products")

    def __init__(self, bandwidth: float, forgetting: float) -> None:
        self._bin_s, self._forget = BIN_TIME_CONSTANTS / bandwidth, forgetting * forgetting
        self.products = np.zeros((LAGS + 1, WIDTH, WIDTH))
        self._recent = np.zeros((LAGS + 1, WIDTH))
        self._sum, self._rows, self._index = np.zeros(WIDTH), 0.0, 0.0
        self._count, self._samples, self._weight = 0.0, 0.0, 0.0

    def add(self, time: float, row: FloatArray) -> None:
        """Add one row (5,) of phi and target at a time in s."""
        index = float(np.floor(time / self._bin_s))
        if index != self._index:
            self._close()
            missing = int(min(max(index - self._index - 1.0, 0.0), LAGS + 1.0)) if index > self._index else LAGS + 1
            if missing:
                self._shift(missing)
            self._index = index
        self._sum += row
        self._rows += 1.0

    def covariance(self, theta: FloatArray, inverse: FloatArray) -> FloatArray | None:
        """Return the covariance (p, p) of an estimate (4,) with inverse normal matrix (p, p); None where there are too few bins.

        p is 4, or 3 where the model has no stiffness.
        """
        size = inverse.shape[0]
        if self._count < max(FEWEST_BINS, 2 * size + 2):
            return None
        weights = np.append(-theta, 1.0)
        highest = max(1, min(MAX_AR_ORDER, int(self._count) // 20))
        power = np.einsum("i,jik,k->j", weights, self.products[: highest + 1], weights) / self._weight
        colour = autoregression(power, self._count, AKAIKE)
        if colour.variance == 0.0:
            return np.zeros((size, size))
        gamma = extended_autocovariance(power, colour.denominator, LAGS + 1) * PARZEN
        keep = [0, 1, 2, 3] if size == 4 else [0, 2, 3]
        lagged = self.products[:, keep][:, :, keep]
        one_sided = np.einsum("j,jik->ik", gamma[1:], lagged[1:])
        per_bin = self._samples / self._count
        score = per_bin * per_bin * (gamma[0] * lagged[0] + one_sided + one_sided.T)
        independent = max(self._count / max(colour.long_run, 1e-3), 2.0 * size)
        return np.asarray(inverse @ score @ inverse * (independent / (independent - size)))

    def state(self) -> dict[str, object]:
        """Return the state as plain values."""
        numbers = (self._rows, self._index, self._count, self._samples, self._weight)
        arrays = (self._sum, self._recent, self.products)
        return {"numbers": list(numbers), **{str(i): a.ravel().tolist() for i, a in enumerate(arrays)}}

    def restore(self, state: dict[str, list[float]]) -> None:
        """Restore a state; raises ValueError or KeyError where it is not valid."""
        self._rows, self._index, self._count, self._samples, self._weight = (float(v) for v in state["numbers"])
        for i, array in enumerate((self._sum, self._recent, self.products)):
            array[...] = np.reshape(np.array(state[str(i)], dtype=np.float64), array.shape)

    def _close(self) -> None:
        """Add the mean of the finished bin to all lagged products; a bin with less than half the usual rows is left out."""
        rows = self._rows
        if rows and (not self._count or rows >= 0.5 * self._samples / self._count):
            decay = self._forget**rows
            self.products *= decay
            self._weight = self._weight * decay + 1.0
            self._shift(1)
            self._recent[0] = mean = self._sum / rows
            self.products += mean[None, :, None] * self._recent[:, None, :]
            # the counts are forgotten as well: they are the effective number of bins
            self._count, self._samples = self._count * decay + 1.0, self._samples * decay + rows
        elif rows:
            self._shift(1)
        self._sum[:], self._rows = 0.0, 0.0

    def _shift(self, by: int) -> None:
        self._recent[by:] = self._recent[: LAGS + 1 - by]
        self._recent[:by] = 0.0


def extended_autocovariance(power: FloatArray, denominator: FloatArray, count: int) -> FloatArray:
    """Return the autocovariances (count,) of an autoregression; those up to its order are those of `power`."""
    order = denominator.size - 1
    gamma = np.zeros(count)
    gamma[: order + 1] = power[: order + 1]
    for j in range(order + 1, count):
        gamma[j] = -denominator[1:] @ gamma[j - order : j][::-1] if order else 0.0
    return gamma


def _parzen(count: int) -> FloatArray:
    x = np.arange(count) / count
    return np.where(x <= 0.5, 1.0 - 6.0 * x * x * (1.0 - x), 2.0 * (1.0 - x) ** 3)


PARZEN = _parzen(LAGS + 1)
