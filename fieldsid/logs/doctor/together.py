"""Samples at which a run has several signals, and the changes of signals over windows of samples."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
import numpy.typing as npt

from fieldsid.logs.run import Run
from fieldsid.numerics.arrays import ComplexArray, FloatArray
from fieldsid.numerics.shifted_correlation import lag_of

FEWEST = 50
"""Fewest samples or windows over which signals are compared."""
SURE = 4.0
"""Standard errors from which on a difference is significant: one of 16,000 differences of pure noise exceeds it."""
LAG_S, LEAST_GAIN = 1.0, 0.002
"""Largest clock offset that is sought, and the gain of correlation from which on a shift is one."""
Number = TypeVar("Number", np.float64, np.complex128)


def together(run: Run, *signals: str) -> tuple[FloatArray, ...] | None:
    """Return the times (n,) at which a run has all the signals, and the signals (n,) at them; None below FEWEST samples."""
    if not all(run.has(s) for s in signals):
        return None
    seen = np.all([np.isfinite(run[s]) for s in signals], axis=0)
    return (run.time[seen], *(run[s][seen] for s in signals)) if seen.sum() >= FEWEST else None


def delay_of(a: FloatArray, b: FloatArray, step: float) -> float:
    """Return the time in s by which one signal (n,) with samples each `step` s is late against another, up to LAG_S.

    Zero where the correlation hardly gains by a shift.
    """
    late, gain = lag_of(a, b, min(round(LAG_S / step), a.size // 4))
    return late * step if gain >= LEAST_GAIN else 0.0


def agreement(directions: ComplexArray, travel: ComplexArray) -> tuple[complex, complex]:
    """Return the mean unit vectors from directions (n,) to a travel (n,), and to its mirror image, weighted by their lengths.

    A vector is as long as they agree; both are zero below FEWEST samples with a length.
    """
    weight = np.abs(travel) * np.abs(directions)
    seen = np.isfinite(weight) & (weight > 0.0)
    if seen.sum() < FEWEST:
        return 0.0j, 0.0j
    a, b, total = directions[seen], travel[seen], float(weight[seen].sum())
    return complex((b * a.conj()).sum()) / total, complex((b * a).sum()) / total


def width_of(time: FloatArray, window_s: float) -> int:
    """Return the number of samples in a window of some s, for times (n,)."""
    step = float(np.nanmedian(np.diff(time))) if time.size > 1 else 0.0
    return max(1, round(window_s / step)) if step > 0.0 else 1


def over(values: npt.NDArray[Number], width: int) -> npt.NDArray[Number]:
    """Return the changes (n - width,) of numbers over windows of `width` samples."""
    return values[width:] - values[:-width]


def change(values: npt.NDArray[Number], width: int) -> npt.NDArray[Number]:
    """Return the change (n,) of a column over a window of `width` samples centred at each sample, NaN at the ends."""
    found = np.full_like(values, np.nan)
    if values.size > width:
        found[width // 2 :][: values.size - width] = over(values, width)
    return found
