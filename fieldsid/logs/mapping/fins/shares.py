"""How much each of several fins does to a rate, by least squares on its changes.

Over a short time a rate changes by what it was, by the fins, and in pitch by the angle that rights the hull:
dr/dt = a r + sum b_i fin_i + c. Fins that only ever moved together are not told apart: of all that explain the rate alike the
shortest is taken (Golub and Van Loan 2013, section 5.5), which shares what they do by how far they went.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fieldsid.logs.doctor.together import FEWEST, over
from fieldsid.numerics.arrays import FloatArray

TOGETHER = 0.05
"""Length of a pattern in which fins moved, against the longest, below which they did not."""
NOTHING = 0.15
"""Share of the strongest fin's effect below which one has none."""
ALIKE = 0.25
"""How far shares may be apart and be taken for equal."""
NEAR = 0.08
"""How far the share of a fin of the strongest may be from a simple fraction and be taken for it."""
EXPLAINS = 0.3
"""Share of a rate's change beside the rate's own that a fin must explain."""
WINDOWS_S = (1.0, 2.0)
"""Times over which changes are taken: a fin shows best in a short one."""
MOST_ROWS = 100_000


@dataclass(frozen=True, slots=True)
class FinShares:
    """The shares (m,) of fins, the fit of them, how much of the rate's change they explain, alone the best one, and the rank."""

    shares: FloatArray
    fitted: FloatArray
    explains: float
    best_alone: float
    patterns: int


def moved_by(
    fins: Sequence[FloatArray], time: FloatArray, rate: FloatArray | None, angle: FloatArray | None, width: int, *, rights: bool
) -> tuple[FloatArray, FloatArray] | None:
    """Return what the change of a rate (n,) and the means (n, m) of fins have over windows beside the rate's own.

    Where the angle (n,) alone was logged its change is the rate, and all goes by the means; `rights` says that its moment rights
    the hull. None where there is too little to tell, or nothing moves.
    """
    righting = angle if rights else None
    if rate is None and angle is not None and time.size > width:
        rate = over(angle, width) / over(time, width)
        fins, righting = [window_mean(time, v, width) for v in fins], window_mean(time, angle, width) if rights else None
        time = time[:-width]
    if rate is None or time.size < width + FEWEST:
        return None
    grows = over(rate, width) / over(time, width)
    beside = [window_mean(time, v, width) for v in (rate, righting) if v is not None]
    base, means = (
        np.stack(columns, axis=1) for columns in ([np.ones(grows.size), *beside], [window_mean(time, v, width) for v in fins])
    )
    seen = np.isfinite(grows) & np.isfinite(means).all(axis=1) & np.isfinite(base).all(axis=1)
    rows = np.flatnonzero(seen)[:: max(1, grows.size // MOST_ROWS)]
    if rows.size < FEWEST:
        return None
    left, moved = (beyond(base[rows], v[rows]) for v in (grows[:, None], means))
    return (left[:, 0], moved) if float(left[:, 0] @ left[:, 0]) > 0.0 else None


def fin_shares(left: FloatArray, moved: FloatArray, width: int) -> FinShares:
    """Return the shares of fins (m,) in what the change of a rate (n,) has beside its own, of `moved_by`."""
    answer, _, _, length = np.linalg.lstsq(moved, left, rcond=TOGETHER)
    fitted = answer.astype(np.float64)
    shares, patterns = _shares(fitted), int((length > TOGETHER * length[0]).sum())
    return FinShares(
        shares,
        fitted / float(np.sum(np.abs(fitted))),
        explained(left, moved @ shares, patterns * width),
        max(explained(left, column, width) for column in moved.T),
        patterns,
    )


def explains(share: float, rate: str) -> str:
    """Return in words how much of a rate's change a fin explains."""
    return f"{100 * share:.0f} % of what the {rate.removesuffix('_rad_s').replace('_', ' ')}'s change has beside the rate's own"


def window_mean(time: FloatArray, values: FloatArray, width: int) -> FloatArray:
    """Return the mean (n - width,) of values that stand from one sample to the next, over each window."""
    swept = np.concatenate([[0.0], np.cumsum(np.where(np.isfinite(values[:-1]), values[:-1], 0.0) * np.diff(time))])
    gone = np.concatenate([[0], np.cumsum(~np.isfinite(values))])
    mean = over(swept, width) / over(time, width)
    return np.asarray(np.where(gone[width + 1 :] - gone[: -width - 1] == 0, mean, np.nan))


def beyond(base: FloatArray, values: FloatArray) -> FloatArray:
    """Return what columns (n, k) leave of values (n, m)."""
    size = np.linalg.norm(base, axis=0)
    base = base / np.where(size > 0.0, size, 1.0)
    return np.asarray(values - base @ np.linalg.lstsq(base, values, rcond=None)[0])


def explained(left: FloatArray, along: FloatArray, chance: int) -> float:
    """Return the share of what is left (n,) that goes along some numbers (n,), beyond that of noise.

    Windows that share samples say the same, so that of so many rows as `chance` a pattern explains all.
    """
    power, of_noise = float(along @ along) * float(left @ left), min(chance / left.size, 1.0 - 1e-9)
    share = float(left @ along) ** 2 / power if power > 0.0 else 0.0
    return (share - of_noise) / (1.0 - of_noise)


def _shares(fitted: FloatArray) -> FloatArray:
    """Return the simple fractions (m,) that fitted effects (m,) are of all of them together, as numbers where they are none."""
    ratio = fitted / float(np.max(np.abs(fitted)))
    ratio = np.where(np.abs(ratio) < NOTHING, 0.0, ratio)
    held_back = np.abs(ratio[ratio != 0.0])
    if float(np.ptp(held_back)) <= ALIKE * float(np.max(held_back)):
        return np.asarray(np.sign(ratio) / held_back.size)
    simple = np.array([float(Fraction(float(r)).limit_denominator(4)) for r in ratio])
    ratio = np.where(np.abs(simple - ratio) <= NEAR, simple, ratio)
    return np.asarray(ratio / float(np.sum(np.abs(ratio))))
