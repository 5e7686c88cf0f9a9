"""The share of each of several fins in the change of a rate, by least squares.

Over a short time the rate obeys dr/dt = a r + sum b_i fin_i + c, in pitch with a restoring term in the angle. The effects of fins
that always moved together cannot be separated: of all solutions with the same residual the one of least norm is taken (Golub and
Van Loan 2013, section 5.5), which shares the effect in proportion to how far each fin moved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fieldsid.logs.doctor.together import FEWEST, over
from fieldsid.logs.few_of import FEW
from fieldsid.logs.reader import SAMPLED
from fieldsid.numerics.arrays import FloatArray

NOTHING = 0.15
"""Share of the strongest fin's effect below which a fin has none."""
ALIKE = 0.25
"""Relative spread up to which shares are taken as equal."""
NEAR = 0.08
"""Distance up to which the ratio of a fin's effect to the strongest is rounded to a simple fraction."""
EXPLAINS = 0.3
"""Smallest share that a fin must explain of the change of a rate that the rate itself does not explain."""
WINDOWS_S = (1.0, 2.0)
"""Windows in s over which changes are computed; a fin is most visible in a short one."""


@dataclass(frozen=True, slots=True)
class FinShares:
    """The shares (m,) of fins, their fitted effects, and the share of dr/dt that they, and the best fin alone, explain.

    `patterns` is the rank: the number of independent patterns in which the fins moved.
    """

    shares: FloatArray
    fitted: FloatArray
    explains: float
    best_alone: float
    patterns: int


def moved_by(
    fins: Sequence[FloatArray], time: FloatArray, rate: FloatArray | None, angle: FloatArray | None, width: int, *, rights: bool
) -> tuple[FloatArray, FloatArray] | None:
    """Return dr/dt (n,) and the window means (n, m) of fins, both less their regression on the rate and a constant.

    Where only the angle (n,) was logged, its change over the window is the rate. With `rights` the angle has a restoring moment,
    and is a regressor too. Returns None where there are too few samples, or the rate does not change.
    """
    righting = angle if rights else None
    if rate is None and angle is not None and time.size > width:
        rate = over(angle, width) / over(time, width)
        fins, righting = [window_mean(time, v, width) for v in fins], window_mean(time, angle, width) if rights else None
        time = time[:-width]
    if rate is None or time.size < width + FEWEST:
        return None
    grows = over(rate, width) / over(time, width)
    regressors = [window_mean(time, v, width) for v in (rate, righting) if v is not None]
    base, means = (
        np.stack(columns, axis=1) for columns in ([np.ones(grows.size), *regressors], [window_mean(time, v, width) for v in fins])
    )
    seen = np.isfinite(grows) & np.isfinite(means).all(axis=1) & np.isfinite(base).all(axis=1)
    rows = np.flatnonzero(seen)[:: max(1, grows.size // SAMPLED)]
    if rows.size < FEWEST:
        return None
    left, moved = (beyond(base[rows], v[rows]) for v in (grows[:, None], means))
    return (left[:, 0], moved) if float(left[:, 0] @ left[:, 0]) > 0.0 else None


def fin_shares(left: FloatArray, moved: FloatArray, width: int) -> FinShares:
    """Return the shares (m,) of fins in dr/dt, from the two results of `moved_by`.

    A pattern of fin angles whose singular value is below the share FEW of the largest counts as absent.
    """
    solution, _, _, length = np.linalg.lstsq(moved, left, rcond=FEW)
    fitted = solution.astype(np.float64)
    shares, patterns = _shares(fitted), int((length > FEW * length[0]).sum())
    return FinShares(
        shares,
        fitted / float(np.sum(np.abs(fitted))),
        explained(left, moved @ shares, patterns * width),
        max(explained(left, column, width) for column in moved.T),
        patterns,
    )


def explains(share: float, rate: str) -> str:
    """Return, in words, the share of the change of a rate that a fin explains."""
    return f"{100 * share:.0f} % of what the {rate.removesuffix('_rad_s').replace('_', ' ')}'s change has beside the rate's own"


def window_mean(time: FloatArray, values: FloatArray, width: int) -> FloatArray:
    """Return the mean (n - width,) over each window of values that are constant from one sample to the next."""
    integral = np.concatenate([[0.0], np.cumsum(np.where(np.isfinite(values[:-1]), values[:-1], 0.0) * np.diff(time))])
    missing = np.concatenate([[0], np.cumsum(~np.isfinite(values))])
    mean = over(integral, width) / over(time, width)
    return np.asarray(np.where(missing[width + 1 :] - missing[: -width - 1] == 0, mean, np.nan))


def beyond(base: FloatArray, values: FloatArray) -> FloatArray:
    """Return the residual (n, m) of the regression of values (n, m) on columns (n, k)."""
    size = np.linalg.norm(base, axis=0)
    base = base / np.where(size > 0.0, size, 1.0)
    return np.asarray(values - base @ np.linalg.lstsq(base, values, rcond=None)[0])


def explained(left: FloatArray, along: FloatArray, chance: int) -> float:
    """Return the share of a residual (n,) that is correlated with numbers (n,), less the share that noise alone would give.

    Windows that overlap are not independent: a pattern explains `chance` of the rows completely even in noise.
    """
    power, of_noise = float(along @ along) * float(left @ left), min(chance / left.size, 1.0 - 1e-9)
    share = float(left @ along) ** 2 / power if power > 0.0 else 0.0
    return (share - of_noise) / (1.0 - of_noise)


def _shares(fitted: FloatArray) -> FloatArray:
    """Return the shares (m,) of fitted effects (m,) in their sum, rounded to simple fractions where they are near one."""
    ratio = fitted / float(np.max(np.abs(fitted)))
    ratio = np.where(np.abs(ratio) < NOTHING, 0.0, ratio)
    kept = np.abs(ratio[ratio != 0.0])
    if float(np.ptp(kept)) <= ALIKE * float(np.max(kept)):
        return np.asarray(np.sign(ratio) / kept.size)
    simple = np.array([float(Fraction(float(r)).limit_denominator(4)) for r in ratio])
    ratio = np.where(np.abs(simple - ratio) <= NEAR, simple, ratio)
    return np.asarray(ratio / float(np.sum(np.abs(ratio))))
