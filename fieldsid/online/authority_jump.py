"""Detect a jump of the fin's authority during the flight, with or without one of the damping, as when a fin or linkage breaks.

The products of the regression rows are summed for each second. At the end of each second, and for each second of the last twenty
in which a jump may have happened, the rows since then are compared with all rows before. Authority, damping and trim are free
after a jump: a payload's inertia or a smaller fin at the stern changes authority and damping by one factor. Quadratic drag and
stiffness stay. Damping is scaled with the speed, authority with its square. The error includes the uncertainty of the drag at
rates that were not flown before. The sum of a second's scores is one draw of their noise, and a disturbance that lasts longer
carries it on to the next. Source: Chow 1960, Econometrica 28(3); the scores' variance by clusters: Liang and Zeger 1986,
Biometrika 73(1); that of correlated ones by an autoregression: Andrews 1991, Econometrica 59(3).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, isfinite, log, nan
from typing import Annotated

import numpy as np
from scipy.special import stdtrit

from fieldsid.numerics.arrays import BoolArray, FloatArray, IntArray
from fieldsid.online.lagged_rows import FEWEST_DRAWS
from fieldsid.records.keys import Key
from fieldsid.rounding import TWO_SIDED_95

SEPARATE_SECONDS, MIN_SECONDS_AFTER, MAX_SECONDS_AFTER = 60, 6, 20
"""Seconds whose sums are kept separately, and the least and the most of them that may have come after a jump."""
MOTION_MISFIT, SPEED_POWER_MISFIT = 0.15, 1.0
"""Relative change of the estimated authority that another kind of motion may cause, as the model lacks sway and lag; and by how
much the exponent of the authority over speed may differ from 2, as sway and heave change it."""
CHANCE = 3.4e-6
"""Probability of noise alone, to either side, beyond which a jump is reported: that of a normal variable beyond 4.5 standard
errors. Where few seconds tell the noise, Student's distribution asks for more of them."""
MAX_RELATIVE_ERROR = 0.1
"""Largest standard error of the authorities before and after, as a share of the larger one, at which they are compared."""
MIN_EXCITATION_BEFORE, MIN_EXCITATION_AFTER = 1e-6, 0.05
"""Least eigenvalue of the normal matrix, scaled to a unit diagonal, of all columns before a jump, and of fin and trim after it: a
constant fin does not separate authority from trim."""
COLUMNS = RATE, _, _, FIN, ONE, _ = tuple(range(6))
FREE = (RATE, FIN, ONE)
"""Columns: r, r|r|, angle, fin, one, target. The coefficients of r, fin and one are free after a jump."""
BEGIN, COUNT = range(2)
PRODUCTS = slice(2, 2 + len(COLUMNS) ** 2)
"""The sums over a second: its begin in s, the number of rows, and the sum of the products of rows [phi, target] (6, 6)."""


@dataclass(frozen=True, slots=True)
class Jump:
    """A jump of the fin's authority, the damping free to change with it."""

    time: Annotated[float, Key("When it was, about; the estimate is of what came since.", "since_s")]
    factor: Annotated[float, Key("The authority over what it was, at the same speed.")]
    std_error: Annotated[float, Key("Its standard error.")]


class AuthorityJump:
    """Sums of row products, separately for each second of the last minute; `stiff`: whether the model has a stiffness."""

    STATE = ("_before", "_seconds", "_rows", "_noise", "_freedom", "_usual", "_speed")
    __slots__ = ("_free", "_keep", *STATE)

    def __init__(self, *, stiff: bool) -> None:
        self._keep = np.array([0, 1, 2, FIN, ONE] if stiff else [0, 1, FIN, ONE])
        self._free = np.flatnonzero(np.isin(self._keep, FREE))
        self._before, self._seconds = np.zeros(PRODUCTS.stop), np.zeros((0, PRODUCTS.stop))
        self._rows: list[tuple[float, ...]] = []
        self._noise, self._freedom, self._usual, self._speed = nan, nan, nan, nan

    def add(self, time: float, row: FloatArray, speed: float) -> Jump | None:
        """Add one row (5,) at a time in s and a surge in m/s, NaN where unknown; return a jump where one is detected."""
        found = None
        if not len(self._seconds) or floor(time) != floor(self._seconds[-1, BEGIN]):
            found = self._end_second(time)
            self._seconds = np.vstack([self._seconds, np.zeros(PRODUCTS.stop)])
            self._seconds[-1, BEGIN] = time
        self._speed = speed if isfinite(speed) and speed > 0.0 else self._speed
        self._usual = self._usual if isfinite(self._usual) else self._speed
        faster = self._speed / self._usual if isfinite(self._speed) else 1.0
        rate, stiff, moved, one, target = row.tolist()
        self._rows.append((rate * faster, rate * abs(rate), stiff, moved * faster * faster, one, target))
        return found

    def _end_second(self, time: float) -> Jump | None:
        """Look for a jump at the end of a second; where the clock restarts, all earlier seconds are merged into `_before`."""
        self._sum_waiting_rows()
        seconds = self._seconds
        is_restart = len(seconds) and time < seconds[-1, BEGIN]
        oldest = len(seconds) if is_restart else max(len(seconds) + 1 - SEPARATE_SECONDS, 0)
        self._before += seconds[:oldest].sum(axis=0)
        self._seconds = seconds[oldest:]
        found = self._detected()
        if found is not None:
            since = self._seconds[:, BEGIN] >= found.time
            self._before, self._seconds, self._noise = np.zeros(PRODUCTS.stop), self._seconds[since], nan
        return found

    def _sum_waiting_rows(self) -> None:
        """Add the waiting rows to the sums of their second."""
        if self._rows:
            rows = np.array(self._rows)
            self._seconds[-1, PRODUCTS] += (rows.T @ rows).ravel()
            self._seconds[-1, COUNT] += len(rows)
            self._rows.clear()

    def _detected(self) -> Jump | None:
        """Return the jump at the candidate second that explains all rows best, if it is at least MIN_SECONDS_AFTER ago.

        Seconds less than MIN_SECONDS_AFTER ago are candidates too: without them, one recent second that does not fit would be
        explained by an earlier candidate.
        """
        keep, free, count = self._keep, self._free, len(self._seconds)
        if not count:
            return None
        sums = self._seconds[:, PRODUCTS].reshape(count, len(COLUMNS), -1)
        places = np.arange(max(count - MAX_SECONDS_AFTER, 0), count)
        cumulative, row_counts = np.cumsum(sums, axis=0), np.cumsum(self._seconds[:, COUNT])
        earlier = cumulative[places] - sums[places]
        before, after = self._before[PRODUCTS].reshape(len(COLUMNS), -1) + earlier, cumulative[-1] - earlier
        since = row_counts[-1] - np.append(0.0, row_counts)[places]
        inverse, determines_before = _inverses(before[:, keep][:, :, keep], MIN_EXCITATION_BEFORE)
        theta = (inverse @ before[:, keep, -1:])[..., 0]
        noise, freedom = self._score_variances(sums, theta, places)
        products = after[:, keep][:, :, keep]
        solved, _ = _inverses(products[:, free][:, :, free], 0.0)
        # the new coefficients depend on the target, and on drag and stiffness, which do not change
        slopes = -solved @ products[:, free]
        slopes[:, :, free] = 0.0
        new = theta.copy()
        new[:, free] = (solved @ after[:, keep[free], -1:] + slopes @ theta[..., None])[..., 0]
        rss_before = np.maximum(before[:, -1, -1] - (theta * before[:, keep, -1]).sum(axis=1), 0.0)
        rss_after = after[:, -1, -1] - 2.0 * (new * after[:, keep, -1]).sum(axis=1) + _squares(new, products)
        rss_after = np.maximum(rss_after, 0.0)
        fin, fin_place = int(np.flatnonzero(keep == FIN)[0]), FREE.index(FIN)
        was, is_now = theta[:, fin], new[:, fin]
        counted = self._before[COUNT] + row_counts[-1] - since
        noisier = np.maximum(rss_after * counted / np.maximum(rss_before * since, 1e-30), 1.0)
        moved = slopes[:, fin_place].copy()
        moved[:, fin] -= 1.0
        error = np.sqrt(noise * np.maximum(_squares(moved, inverse) + noisier * solved[:, fin_place, fin_place], 0.0))
        _, is_moved = _inverses(after[:, (FIN, ONE)][:, :, (FIN, ONE)], MIN_EXCITATION_AFTER)
        error_before = np.sqrt(noise * np.maximum(inverse[:, fin, fin], 0.0))
        # one second, cut off in a motion, is no measure of its own noise: the others tell the authority after as well
        most = np.array([at + int(np.argmax(sums[at:, FIN, FIN])) for at in places])
        others, is_told_by_others = _inverses(
            (products - sums[most][:, keep][:, :, keep])[:, free][:, :, free], MIN_EXCITATION_BEFORE
        )
        error_after = np.sqrt(noise * noisier * np.maximum(others[:, fin_place, fin_place], 0.0))
        least_known = np.maximum(np.maximum(error_before, error), error_after)
        is_known = is_told_by_others & (least_known <= MAX_RELATIVE_ERROR * np.maximum(abs(was), abs(is_now)))
        misfit = MOTION_MISFIT + SPEED_POWER_MISFIT * abs(log(self._speed / self._usual) if isfinite(self._speed) else 0.0)
        least = misfit * abs(was)
        # a gust passes, a jump stays: the later half of the seconds since then shows it too
        half = np.minimum(np.arange(places.size) + (count - places + 1) // 2, places.size - 1)
        lately = (solved[half] @ after[half][:, keep[free], -1:] + slopes[half] @ theta[..., None])[:, fin_place, 0]
        spread = _squares(moved[half], inverse) + noisier * solved[half, fin_place, fin_place]
        stays = is_moved[half] & (abs(lately - was) > least + TWO_SIDED_95 * np.sqrt(noise * np.maximum(spread, 0.0)))
        jumps = is_moved & is_known & stays & (abs(is_now - was) > least + stdtrit(freedom, 1.0 - CHANCE) * error)
        best = int(np.argmin(np.where(determines_before & np.isfinite(noise), rss_before + rss_after, np.inf)))
        if not jumps[best] or places[best] > count - MIN_SECONDS_AFTER:
            return None
        return Jump(
            float(self._seconds[places[best], BEGIN]), float(is_now[best] / was[best]), float(error[best] / abs(was[best]))
        )

    def _score_variances(self, sums: FloatArray, theta: FloatArray, places: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return the variance of the scores before each candidate over that of the columns, and its degrees of freedom (P,).

        It is the variance of a row's residual with its correlation to the neighbouring rows, within the second by the sum and
        from second to second as an autoregression of first order keeps it. Where fewer than FEWEST_DRAWS seconds come before the
        candidate, the last variance known is returned.
        """
        keep = self._keep
        is_before = np.arange(len(sums)) < places[:, None]
        draws = is_before.sum(axis=1)
        columns = sums[:, keep][:, :, keep]
        scores = (sums[:, keep, -1] - np.einsum("sij,pj->psi", columns, theta)) * is_before[..., None]
        normal = np.linalg.pinv(np.einsum("ps,sij->pij", is_before.astype(float), columns), hermitian=True)
        spread = np.maximum(np.einsum("psi,pij,psj->p", scores, normal, scores), 0.0)
        onward = np.einsum("psi,pij,psj->p", scores[:, 1:], normal, scores[:, :-1])
        kept = np.clip(onward / np.maximum(spread, 1e-300), 0.0, 1.0 - 1.0 / np.maximum(draws, 2))
        independent = draws * (1.0 - kept) / (1.0 + kept)
        freedom = np.maximum(independent - keep.size, 1.0)
        noise = spread / keep.size * draws / freedom
        is_new = draws >= FEWEST_DRAWS
        noise, freedom = np.where(is_new, noise, self._noise), np.where(is_new, freedom, self._freedom)
        self._noise, self._freedom = float(noise[-1]), float(freedom[-1])
        return noise, freedom


def _squares(vectors: FloatArray, matrices: FloatArray) -> FloatArray:
    """Return v' M v for each of the vectors (P, K) and matrices (P, K, K)."""
    return np.asarray(np.einsum("pi,pij,pj->p", vectors, matrices, vectors))


def _inverses(normals: FloatArray, least: float) -> tuple[FloatArray, BoolArray]:
    """Return the pseudo-inverse of each normal matrix (P, K, K), and whether it determines all parameters (P,).

    It does where no column is zero and no eigenvalue of the matrix, scaled to a unit diagonal, is below `least`.
    """
    scale = np.sqrt(np.maximum(np.einsum("pii->pi", normals), 0.0))
    is_determined, scale = (scale > 0.0).all(axis=1), np.where(scale > 0.0, scale, 1.0)
    outer = scale[:, :, None] * scale[:, None, :]
    ones = normals / outer
    return np.asarray(np.linalg.pinv(ones, hermitian=True) / outer), is_determined & (np.linalg.eigvalsh(ones)[:, 0] >= least)
