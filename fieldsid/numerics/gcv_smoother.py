"""A measured helper signal without its noise: a penalised least-squares smoother that finds its own bandwidth.

    min_z  sum_i w_i (v_i - z_i)^2 + (T/h)^4 sum_i (z_(i-1) - 2 z_i + z_(i+1))^2
which passes what is slower than T and leaves out what is faster, without phase. T is the one of least generalised
cross-validation error; the trace of the smoother comes from one random vector of fixed seed.
What is known to move the signal may be given as columns: the smoother then only has to follow what they leave, unless that
validates worse than chance, and passes less noise.
Sources: Whittaker 1923, On a new method of graduation; Craven and Wahba 1979; Girard 1989, Numer. Math. 56 (the trace);
Green and Silverman 1994, Nonparametric Regression and Generalized Linear Models, chapter 4 (columns beside a smoother).
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view
from scipy.linalg import solveh_banded

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.white_noise import MEDIAN_OF_NORMAL

LONGEST_TIME_CONSTANT_S = 10.0
"""Largest T; what changes more slowly than that over a run is no noise of a sensor."""
FEWEST_SAMPLES = 8
"""Measured samples below which a signal is left as it is."""
LONGEST_HELD_VALUE_S = 1.0
"""A value repeated for no longer than this was held by the log until the sensor's next one."""
MEDIAN_WIDTH, OUTLIER_SPREADS, OUTLIER_RANGE_SHARE = 9, 8.0, 0.1
"""Values a running median is taken over; spreads, and share of the signal's own range, beyond which one is wild."""
CHANCE_GAIN_SAMPLES = 12.0
"""Samples' worth of noise that two smoothers' errors differ by by chance: what is known to move a signal is left out beyond."""
ROUNDING_SHARE = 1e-9
"""Share of its size that no sensor resolves: a signal that is straight but for that has no noise, only rounding."""
MAX_SELECTION_SAMPLES = 20_000
"""Samples from whose first part a longer signal's T is found, and which columns it goes with."""


def gcv_smooth(
    time: FloatArray, values: FloatArray, *, fastest_s: float = 0.0, beside: Iterable[FloatArray] | None = None
) -> FloatArray:  # fmt: skip
    """Return a signal (n,) without its noise and its gaps (NaN), at times (n,) s; T is at least `fastest_s` s.

    Values that a log repeats until the sensor's next one count once, and wild ones not at all. `beside` are rival sets of
    columns (n, k), made as they are asked for, that the signal may be a sum of, but for what is smoothed.
    """
    ok = np.isfinite(values)
    full = np.interp(time, time[ok], values[ok])
    step = float(np.median(np.diff(time))) if full.size > 1 else 0.0
    seen = _is_new_value(full, ok, step)
    seen[np.flatnonzero(seen)[_is_outlier(full[seen])]] = False
    if seen.sum() < FEWEST_SAMPLES or not step > 0.0:
        return full
    straight = np.column_stack([np.ones(time.size), (time - time[0]) / float(np.ptp(time))])
    line = _fitted(straight, full, seen)
    if float(np.max(np.abs(full - line)[seen])) <= ROUNDING_SHARE * float(np.max(np.abs(full[seen]))):
        return full
    weight, part = seen.astype(np.float64), slice(0, MAX_SELECTION_SAMPLES)
    trends = [(line, 0)]
    if beside is not None:
        # of all that is left beside the columns of each set, not of its slow part alone: sets differ in little else
        best = min(beside, key=lambda columns: _left(np.column_stack([straight[part], columns[part]]), full[part], seen[part]))
        trends.append((_fitted(np.column_stack([straight, best]), full, seen), best.shape[1]))
    stiffnesses, found = _stiffnesses(step, fastest_s), []
    for trend, spent in trends:
        stiffness, error = _best_stiffness((full - trend)[part], weight[part], stiffnesses, spent)
        found.append((error * (1.0 if spent else 1.0 + CHANCE_GAIN_SAMPLES / float(weight[part].sum())), stiffness, trend))
    _, stiffness, trend = min(found, key=lambda of: of[0])
    return np.asarray(trend + _solved(weight, stiffness, (weight * (full - trend))[:, None])[:, 0])


def _fitted(columns: FloatArray, values: FloatArray, seen: npt.NDArray[np.bool_]) -> FloatArray:
    """Return the least-squares sum (n,) of columns (n, k) to values (n,) where seen."""
    size = np.linalg.norm(columns[seen], axis=0)
    scaled = columns / np.where(size > 0.0, size, 1.0)
    return np.asarray(scaled @ np.linalg.lstsq(scaled[seen], values[seen], rcond=1e-9)[0])


def _left(columns: FloatArray, values: FloatArray, seen: npt.NDArray[np.bool_]) -> float:
    """Return the sum of squares that the least-squares sum of columns (n, k) leaves of values (n,) where seen."""
    return float(np.sum((values - _fitted(columns, values, seen))[seen] ** 2))


def _is_new_value(values: FloatArray, ok: npt.NDArray[np.bool_], step: float) -> npt.NDArray[np.bool_]:
    """Return the samples that bring something new: all that were measured, or the first of each where values are held."""
    first = np.concatenate([[True], values[1:] != values[:-1]])
    lengths = np.diff(np.append(np.flatnonzero(first), values.size))
    held = lengths.size > 1 and float(np.mean(lengths)) > 1.5 and float(np.percentile(lengths, 90)) * step <= LONGEST_HELD_VALUE_S
    return ok & first if held else ok


def _is_outlier(values: FloatArray) -> npt.NDArray[np.bool_]:
    """Return the values far from the running median, for their own noise and for all that the signal does.

    A step or a slow swing is its own median.
    """
    around = sliding_window_view(np.pad(values, MEDIAN_WIDTH // 2, mode="edge"), MEDIAN_WIDTH)
    off = np.abs(values - np.median(around, axis=1))
    usual = float(np.median(off)) / MEDIAN_OF_NORMAL
    return np.asarray((off > OUTLIER_SPREADS * usual) & (off > OUTLIER_RANGE_SHARE * float(np.ptp(values))))


def _stiffnesses(step: float, fastest_s: float) -> FloatArray:
    """Return (T/h)^4 for T from next to nothing, or the fastest allowed, to the slowest."""
    shortest = max(0.3 * step, fastest_s)
    count = max(1, int(np.ceil(np.log2(LONGEST_TIME_CONSTANT_S / shortest) * 1.5)) + 1)
    return np.asarray((np.geomspace(shortest, max(LONGEST_TIME_CONSTANT_S, shortest), count) / step) ** 4)


def _best_stiffness(
    values: FloatArray, weight: FloatArray, stiffnesses: FloatArray, spent: int
) -> tuple[float, float]:  # fmt: skip
    """Return the stiffness of least generalised cross-validation error, and that error.

    `spent` are the columns that were fitted before, besides the straight line's, which the smoother passes itself.
    """
    probe = np.random.default_rng(0).choice([-1.0, 1.0], values.size)
    sides = np.column_stack([weight * values, weight * probe])
    count, errors = float(weight.sum()), []
    for stiffness in stiffnesses:
        z = _solved(weight, float(stiffness), sides)
        free = count - float(probe @ (weight * z[:, 1])) - spent
        errors.append(float(np.sum(weight * (values - z[:, 0]) ** 2)) / max(free, 1e-9 * count) ** 2)
    best = int(np.argmin(errors))
    return float(stiffnesses[best]), errors[best]


def _solved(weight: FloatArray, stiffness: float, sides: FloatArray) -> FloatArray:
    """Return the solution (n, m) of (W + stiffness D'D) z = sides, D the second differences."""
    n = weight.size
    bands = np.zeros((3, n))
    bands[0, 2:] = 1.0
    bands[1, 1:] = -4.0
    bands[1, [1, -1]] = -2.0
    bands[2] = 6.0
    bands[2, [1, -2]], bands[2, [0, -1]] = 5.0, 1.0
    bands *= stiffness
    bands[2] += weight
    return np.asarray(solveh_banded(bands, sides, check_finite=False))
