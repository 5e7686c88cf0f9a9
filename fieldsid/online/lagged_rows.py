"""The estimate by instrumental variables and its covariance, from lagged products of the regression rows, in constant memory.

A disturbance of the hull is in the residual of q = phi' Theta, and, through the hull's motion, in the columns phi as well: least
squares is biased by it. The instruments z are the columns as the fin alone moves them: its past through the response of a hull
with the present estimate. They know neither the disturbance nor the noise of the sensors, and
    Theta = (Z' Phi)^-1 Z' q,   Cov = (Z' Phi)^-1 (sum_j (Z_j + Z_j') gamma_j) (Phi' Z)^-1   over lags j
has the bias of neither. Rows w = [phi, q] are averaged in bins of about half a filter time constant, over which the filtered phi
hardly change, each of as many rows as the others: bins of one and two rows in turn would not average the noise alike. M_j = sum_B
w_B w_(B-j)' contains Z' Phi, Z' q and, convolved with the response, Z_j, and for any Theta the autocovariance [-Theta, 1] M_j
[-Theta, 1]' of the residual: no row is stored. An autoregression smooths gamma; a window that is flat up to half its length
leaves short correlation as it is. Source: Soederstroem and Stoica 1983, Instrumental Variable Methods for System Identification;
Ljung 1999, sections 7.6 and 9.5; Politis 2011, Econometric Theory 27(4) (flat window, negative eigenvalues set to zero).
"""

from __future__ import annotations

import numpy as np

from fieldsid.fitting.regression.residual_colour_covariance import MAX_AR_ORDER, autoregression
from fieldsid.numerics.arrays import FloatArray

BIN_TIME_CONSTANTS = 0.5
LAGS = 256
"""Bins over which rows are multiplied: 32 s at a bandwidth of 4 rad/s."""
REACH = LAGS // 2
"""Bins over which the fin's past makes an instrument, and over which correlation is followed: together they reach over LAGS."""
FEWEST_DRAWS = 20
"""Bins below which nothing is estimated, and seconds below which the noise of their scores is not."""
REFINEMENTS = 3
"""Estimates in turn, each with the instruments of the one before."""
ROUNDING = 1e-6
"""Share of a bin by which rounded time stamps may miss its end."""
AKAIKE = 2.0
"""Penalty of a coefficient of the residual's autoregression; Schwarz's would give too low an order for a slow disturbance in
addition to white noise."""
COLUMNS = _, _, FIN, ONE, _ = tuple(range(5))
"""Columns of a row: rate, angle, fin, one, target."""
WIDTH = len(COLUMNS)


class LaggedRows:
    """Lagged products of binned regression rows; `stiff`: whether the model has a stiffness."""

    STATE = (
        "_rows", "_begin", "_last", "_duration", "_durations", "_samples", "_weight", "_squares", "_sum", "_recent", "products",
    )  # fmt: skip
    __slots__ = ("_bin_s", "_forget", "_keep", *STATE)

    def __init__(self, bandwidth: float, forgetting: float, *, stiff: bool) -> None:
        self._bin_s, self._forget = BIN_TIME_CONSTANTS / bandwidth, forgetting
        self._keep = [0, 1, 2, 3] if stiff else [0, 2, 3]
        self.products = np.zeros((LAGS + 1, WIDTH, WIDTH))
        self._recent = np.zeros((LAGS + 1, WIDTH))
        self._sum, self._rows = np.zeros(WIDTH), 0.0
        self._begin, self._last, self._duration, self._durations = 0.0, 0.0, 0.0, 0.0
        self._samples, self._weight, self._squares = 0.0, 0.0, 0.0

    def add(self, time: float, row: FloatArray) -> None:
        """Add one row (5,) of phi and target at a time in s."""
        elapsed = time - self._begin
        if self._rows and (elapsed >= self._bin_s * (1.0 - ROUNDING) or time < self._last):
            self._close()
            usual = self._duration / self._durations if self._durations else max(self._bin_s, elapsed)
            missing = round(min(elapsed / usual - 1.0, LAGS + 1.0)) if time > self._last else LAGS + 1
            if missing > 0:
                self._shift(missing)
            else:
                self._duration, self._durations = self._duration + elapsed, self._durations + 1.0
        if not self._rows:
            self._begin = time
        self._last = time
        self._sum += row
        self._rows += 1.0

    def estimate(self, start: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Return Theta (4,) and the covariance (p, p) of its p parameters; None where the bins are too few or the fin was still.

        start: the estimate (4,) whose response makes the first instruments.
        """
        keep, theta = self._keep, start.copy()
        if not self._durations or self._weight**2 < max(FEWEST_DRAWS, 2 * len(keep) + 2) * self._squares:
            return None
        scale = np.sqrt(self.products[0].diagonal()[keep])
        if not scale.all():
            return None
        size = np.outer(scale, scale)
        response: FloatArray = np.zeros((3, REACH))
        inverse: FloatArray = np.zeros_like(size)
        for _ in range(REFINEMENTS):
            response = responses(theta, self._duration / self._durations)
            moments = self._moments(response)
            normal = moments[:, keep]
            if np.linalg.matrix_rank(normal / size) < len(keep):
                return None
            inverse = np.asarray(np.linalg.inv(normal))
            theta[keep] = inverse @ moments[:, -1]
        return theta, self._covariance(theta, response, inverse)

    def _moments(self, response: FloatArray) -> FloatArray:
        """Return the products (p, 5) of the instruments with the rows; response: (3, REACH)."""
        of_fin = np.einsum("ij,jk->ik", response, self.products[:REACH, :, FIN])
        return np.concatenate([of_fin, self.products[:1, :, ONE]])[self._keep]

    def _covariance(self, theta: FloatArray, response: FloatArray, inverse: FloatArray) -> FloatArray:
        size, count = len(self._keep), self._weight**2 / self._squares
        weights = np.append(-theta, 1.0)
        highest = max(1, min(MAX_AR_ORDER, int(count) // 20))
        power = np.einsum("i,jik,k->j", weights, self.products[: highest + 1], weights) / self._weight
        colour = autoregression(power, count, AKAIKE)
        if colour.variance == 0.0:
            return np.zeros((size, size))
        gamma = extended_autocovariance(power, colour.denominator, REACH + 1) * FLAT
        lagged = self._lagged_instruments(response)[:, self._keep][:, :, self._keep]
        one_sided = np.einsum("j,jik->ik", gamma[1:], lagged[1:])
        # the weights of a covariance are squared where the recursion forgets
        score = (gamma[0] * lagged[0] + one_sided + one_sided.T) * self._squares / self._weight
        values, axes = np.linalg.eigh(0.5 * (score + score.T))
        half = inverse @ axes * np.sqrt(np.maximum(values, 0.0))
        independent = max(count / max(colour.long_run, 1e-3), 2.0 * size)
        return np.asarray(half @ half.T * (independent / (independent - size)))

    def _lagged_instruments(self, response: FloatArray) -> FloatArray:
        """Return the products (REACH + 1, 4, 4) of the instruments with those j bins before: of the fin's through `response`."""
        of_fin, out = self.products[:, FIN, FIN], np.empty((REACH + 1, 4, 4))
        both_ways, first = np.concatenate([of_fin[:0:-1], of_fin]), LAGS + REACH - 1
        for i in range(3):
            moved = np.convolve(both_ways, response[i])
            for k in range(3):
                out[:, i, k] = np.convolve(moved, response[k, ::-1])[first : first + REACH + 1]
        out[:, :3, ONE] = out[:, ONE, :3] = response @ self.products[:REACH, ONE, FIN]
        out[:, ONE, ONE] = self.products[: REACH + 1, ONE, ONE]
        return out

    def _close(self) -> None:
        """Add the mean of the finished bin to all lagged products; a bin with less than half the usual rows is left out."""
        rows = self._rows
        self._shift(1)
        if not self._weight or rows >= 0.5 * self._samples / self._weight:
            decay = self._forget**rows
            self._recent[0] = mean = self._sum / rows
            self.products *= decay
            self.products += mean[None, :, None] * self._recent[:, None, :]
            # the counts are forgotten as well: they are the effective numbers
            self._samples, self._weight = self._samples * decay + rows, self._weight * decay + 1.0
            self._squares = self._squares * decay * decay + 1.0
        self._sum[:], self._rows = 0.0, 0.0

    def _shift(self, by: int) -> None:
        self._recent[by:] = self._recent[: LAGS + 1 - by]
        self._recent[:by] = 0.0


def responses(theta: FloatArray, step: float) -> FloatArray:
    """Return what a fin moved for one bin of `step` s makes of the columns of rate, angle and fin, in the bins after, (3, REACH).

    An instrument need not be exact: the authority is one, and a hull that an early estimate has unstable is without damping.
    The bilinear rule keeps a stable hull stable at any step.
    """
    damping, stiffness = np.maximum(theta[:2], 0.0)
    system = np.array([[0.0, 1.0], [-stiffness, -damping]])
    half, unit = 0.5 * step * system, np.eye(2)
    onward = np.linalg.solve(unit - half, unit + half)
    enters = np.linalg.solve(unit - half, [0.0, 0.5 * step])
    motion, power = (onward @ enters + enters)[:, None], onward
    while motion.shape[1] < REACH:
        motion, power = np.hstack([motion, power @ motion]), power @ power
    angle, rate = np.column_stack([enters, motion[:, : REACH - 1]])
    return np.stack([-rate, -angle, np.eye(1, REACH)[0]])


def extended_autocovariance(power: FloatArray, denominator: FloatArray, count: int) -> FloatArray:
    """Return the autocovariances (count,) of an autoregression; those up to its order are those of `power`."""
    order = denominator.size - 1
    gamma = np.zeros(count)
    gamma[: order + 1] = power[: order + 1]
    for j in range(order + 1, count):
        gamma[j] = -denominator[1:] @ gamma[j - order : j][::-1] if order else 0.0
    return gamma


FLAT: FloatArray = np.minimum(1.0, 2.0 - 2.0 * np.arange(REACH + 1) / REACH)
"""The window: one up to half of REACH, from there to zero at its end."""
