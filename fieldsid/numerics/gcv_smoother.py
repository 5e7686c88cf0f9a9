"""Smoothing of a measured helper signal: a penalised least-squares smoother with its bandwidth by cross-validation.

    min_z  sum_i w_i (v_i - z_i)^2 + (T/h)^4 sum_i (z_(i-1) - 2 z_i + z_(i+1))^2
which is a low-pass filter of time constant T without phase. T has the least generalised cross-validation error; the trace of the
smoother is estimated with one random vector of fixed seed. Signals that are known to explain the signal may be given as columns:
the smoother is then applied to the residual of a regression on them, and passes less noise, unless its cross-validation error is
larger by more than chance. Sources: Whittaker 1923, On a new method of graduation; Craven and Wahba 1979; Girard 1989, Numer.
Math. 56 (the trace); Green and Silverman 1994, Nonparametric Regression and Generalized Linear Models, chapter 4 (columns in
addition to a smoother).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view
from scipy.linalg import cholesky_banded, solve_banded, solveh_banded

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.white_noise import MEDIAN_OF_NORMAL

LONGEST_TIME_CONSTANT_S = 10.0
"""Largest T; slower changes over a run are not sensor noise."""
FEWEST_SAMPLES = 8
"""Measured samples below which a signal is not smoothed."""
LONGEST_HELD_VALUE_S = 1.0
"""Longest time over which a log repeats a value of the sensor until the next one."""
MEDIAN_WIDTH, OUTLIER_SPREADS, OUTLIER_RANGE_SHARE = 9, 8.0, 0.1
"""Width of the running median; and the distance from it, in spreads and as a share of the signal's range, of an outlier."""
CHANCE_GAIN_SAMPLES = 12.0
"""Difference of two smoothers' errors by chance, in samples of noise: columns that validate worse by more are not used."""
ROUNDING_SHARE = 1e-9
"""Relative deviation from a straight line below which a signal has no noise but only rounding errors."""
MAX_SELECTION_SAMPLES = 20_000
"""Number of first samples from which T and the columns of a longer signal are selected."""


@dataclass(frozen=True, slots=True)
class Smoother:
    """The smoother of a signal: its stiffness (T/h)^4, the share of samples with a value, and the noise of these values."""

    stiffness: float
    share: float
    noise: float

    def errors(self, samples: int, count: int) -> Iterator[FloatArray]:
        """Yield `count` random errors (samples,) of a smoothed signal, of fixed seed: noise passed, and swings taken away.

        The penalty is a prior of the signal, under which its error has the covariance noise^2 (W + stiffness D'D)^-1. Source:
        Wahba 1983, Journal of the Royal Statistical Society B 45 (intervals that hold the truth on average over the samples).
        """
        rng = np.random.default_rng(0)
        root = cholesky_banded(_bands(np.full(samples, self.share), self.stiffness), check_finite=False)
        for _ in range(count):
            yield self.noise * solve_banded((0, 2), root, rng.standard_normal(samples), check_finite=False)


def gcv_smooth(
    time: FloatArray, values: FloatArray, *, fastest_s: float = 0.0, regressors: Iterable[FloatArray] | None = None
) -> tuple[FloatArray, Smoother | None]:  # fmt: skip
    """Return a signal (n,) at times (n,) s smoothed and with its gaps (NaN) filled; T is at least `fastest_s` s.

    Values that a log repeats until the next one of the sensor count once, and outliers not at all. `regressors` are alternative
    sets of columns (n, k), evaluated lazily: the signal may be a linear combination of one set plus a smooth residual. The
    smoother is None where the signal is returned as it is.
    """
    ok = np.isfinite(values)
    full = np.interp(time, time[ok], values[ok])
    step = float(np.median(np.diff(time))) if full.size > 1 else 0.0
    seen = _is_new_value(full, ok, step)
    seen[np.flatnonzero(seen)[_is_outlier(full[seen])]] = False
    if seen.sum() < FEWEST_SAMPLES or not step > 0.0:
        return full, None
    straight = np.column_stack([np.ones(time.size), (time - time[0]) / float(np.ptp(time))])
    line = _least_squares_fit(straight, full, seen)
    if float(np.max(np.abs(full - line)[seen])) <= ROUNDING_SHARE * float(np.max(np.abs(full[seen]))):
        return full, None
    weight, part = seen.astype(np.float64), slice(0, MAX_SELECTION_SAMPLES)
    trends = [(line, 0)]
    if regressors is not None:
        # by the full residual of each set and not by its slow part alone, in which the sets hardly differ
        best = min(
            regressors,
            key=lambda columns: _residual_squares(np.column_stack([straight[part], columns[part]]), full[part], seen[part]),
        )
        trends.append((_least_squares_fit(np.column_stack([straight, best]), full, seen), best.shape[1]))
    stiffnesses, found = _stiffnesses(step, fastest_s), []
    for trend, spent in trends:
        stiffness, error, variance = _best_stiffness((full - trend)[part], weight[part], stiffnesses, spent)
        chance = 1.0 if spent else 1.0 + CHANCE_GAIN_SAMPLES / float(weight[part].sum())
        found.append((error * chance, trend, Smoother(stiffness, float(weight.mean()), variance**0.5)))
    _, trend, smoother = min(found, key=lambda of: of[0])
    smooth = _solve_penalised(weight, smoother.stiffness, (weight * (full - trend))[:, None])[:, 0]
    return np.asarray(trend + smooth), smoother


def _least_squares_fit(columns: FloatArray, values: FloatArray, seen: npt.NDArray[np.bool_]) -> FloatArray:
    """Return the least-squares fit (n,) of columns (n, k) to the values (n,) at samples `seen`."""
    size = np.linalg.norm(columns[seen], axis=0)
    scaled = columns / np.where(size > 0.0, size, 1.0)
    return np.asarray(scaled @ np.linalg.lstsq(scaled[seen], values[seen], rcond=1e-9)[0])


def _residual_squares(columns: FloatArray, values: FloatArray, seen: npt.NDArray[np.bool_]) -> float:
    """Return the residual sum of squares of the least-squares fit of columns (n, k) to the values (n,) at samples `seen`."""
    return float(np.sum((values - _least_squares_fit(columns, values, seen))[seen] ** 2))


def _is_new_value(values: FloatArray, ok: npt.NDArray[np.bool_], step: float) -> npt.NDArray[np.bool_]:
    """Return the samples with new values: all that were measured, or the first of each where the log repeats values."""
    first = np.concatenate([[True], values[1:] != values[:-1]])
    lengths = np.diff(np.append(np.flatnonzero(first), values.size))
    repeats = (
        lengths.size > 1 and float(np.mean(lengths)) > 1.5 and float(np.percentile(lengths, 90)) * step <= LONGEST_HELD_VALUE_S
    )
    return ok & first if repeats else ok


def _is_outlier(values: FloatArray) -> npt.NDArray[np.bool_]:
    """Return the values that are far from the running median, relative to the noise and to the range of the signal.

    The median follows a step or a slow swing.
    """
    around = sliding_window_view(np.pad(values, MEDIAN_WIDTH // 2, mode="edge"), MEDIAN_WIDTH)
    off = np.abs(values - np.median(around, axis=1))
    usual = float(np.median(off)) / MEDIAN_OF_NORMAL
    return np.asarray((off > OUTLIER_SPREADS * usual) & (off > OUTLIER_RANGE_SHARE * float(np.ptp(values))))


def _stiffnesses(step: float, fastest_s: float) -> FloatArray:
    """Return (T/h)^4 for T from 0.3 steps, or the fastest allowed, to the slowest."""
    shortest = max(0.3 * step, fastest_s)
    count = max(1, int(np.ceil(np.log2(LONGEST_TIME_CONSTANT_S / shortest) * 1.5)) + 1)
    return np.asarray((np.geomspace(shortest, max(LONGEST_TIME_CONSTANT_S, shortest), count) / step) ** 4)


def _best_stiffness(
    values: FloatArray, weight: FloatArray, stiffnesses: FloatArray, spent: int
) -> tuple[float, float, float]:  # fmt: skip
    """Return the stiffness of least generalised cross-validation error, that error, and the variance of the noise.

    `spent` is the number of columns fitted before, without those of the straight line, which the smoother passes anyway.
    """
    probe = np.random.default_rng(0).choice([-1.0, 1.0], values.size)
    sides = np.column_stack([weight * values, weight * probe])
    count, found = float(weight.sum()), []
    for stiffness in stiffnesses:
        z = _solve_penalised(weight, float(stiffness), sides)
        free = max(count - float(probe @ (weight * z[:, 1])) - spent, 1e-9 * count)
        squares = float(np.sum(weight * (values - z[:, 0]) ** 2))
        found.append((float(stiffness), squares / free**2, squares / free))
    return min(found, key=lambda of: of[1])


def _solve_penalised(weight: FloatArray, stiffness: float, sides: FloatArray) -> FloatArray:
    """Return the solution (n, m) of (W + stiffness D'D) z = sides, D the second differences."""
    return np.asarray(solveh_banded(_bands(weight, stiffness), sides, check_finite=False))


def _bands(weight: FloatArray, stiffness: float) -> FloatArray:
    """Return the upper bands (3, n) of W + stiffness D'D."""
    n = weight.size
    bands = np.zeros((3, n))
    bands[0, 2:] = 1.0
    bands[1, 1:] = -4.0
    bands[1, [1, -1]] = -2.0
    bands[2] = 6.0
    bands[2, [1, -2]], bands[2, [0, -1]] = 5.0, 1.0
    bands *= stiffness
    bands[2] += weight
    return bands
