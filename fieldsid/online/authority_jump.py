"""A jump of the fin's authority told as it happens, with the damping or without: a linkage that slipped, a fin that was lost.

The equation's rows are summed second by second. At each second what came last is compared with all before, for every place
where it may have begun: authority, damping and trim are free after it, as a payload's inertia or a smaller fin at the stern takes
authority and damping by one share; drag and stiffness stay. Damping goes with the speed, authority with its square. How little
the drag is known at rates that were not flown before is in the error. A second is longer than residuals remember, so that its sum
of scores is one independent draw of their noise.
Source: Chow 1960, Econometrica 28(3); the scores' variance by clusters: Liang and Zeger 1986, Biometrika 73(1).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import floor, isfinite, log, nan
from typing import Annotated, Any

import numpy as np

from fieldsid.numerics.arrays import BoolArray, FloatArray, IntArray
from fieldsid.records.keys import Key

KEPT_S, LEAST_S, MOST_S = 60, 6, 20
"""Seconds that are kept apart, and the least and the most of them that may have come after a jump."""
OTHER_MOTION, OTHER_POWER = 0.15, 1.0
"""Share by which one authority answers for another motion otherwise, sway and lag that no such model has; and the power of the
speed by which it may differ from u^2: sway and heave make it another."""
SURE = 4.5
"""Standard errors beyond that: at 15 places a second, an hour of noise alone makes fewer than one in ten thousand."""
KNOWN_SHARE = 0.1
"""Standard error, as a share of the larger, at which the authorities before and since are known well enough to be compared."""
LEAST_DRAWS = 20
"""Seconds that the noise of the scores is told from."""
LEAST_EXCITED, LEAST_MOVED = 1e-6, 0.05
"""Least eigenvalue, scaled to ones, of all columns before and of fin and trim since: a fin that is held tells neither."""
COLUMNS = RATE, _, _, FIN, ONE, _ = tuple(range(6))
FREE = (RATE, FIN, ONE)
"""Columns: rate, rate with its size, angle, fin, one, target; rate, fin and one are free after a jump."""
_UPPER = np.triu_indices(len(COLUMNS))


@dataclass(frozen=True, slots=True)
class Jump:
    """A jump of the fin's authority, the damping free to change with it."""

    time: Annotated[float, Key("When it was, about; the estimate is of what came since.", "since_s")]
    factor: Annotated[float, Key("The authority over what it was, at the same speed.")]
    std_error: Annotated[float, Key("Its standard error.")]


@dataclass(slots=True)
class _Sums:
    """Products of rows [phi, target] (5, 5) over a while from `begin` s on, and how many they are."""

    begin: float = nan
    products: FloatArray = field(default_factory=lambda: np.zeros((len(COLUMNS), len(COLUMNS))))
    count: float = 0.0


class AuthorityJump:
    """Sums of rows, those of the last minute second by second; `stiff` says whether the second column has a parameter."""

    __slots__ = ("_before", "_free", "_keep", "_noise", "_rows", "_seconds", "_speed", "_usual")

    def __init__(self, *, stiff: bool) -> None:
        self._keep = np.array([0, 1, 2, FIN, ONE] if stiff else [0, 1, FIN, ONE])
        self._free = np.flatnonzero(np.isin(self._keep, FREE))
        self._before = _Sums()
        self._seconds: deque[_Sums] = deque()
        self._rows: list[tuple[float, ...]] = []
        self._noise, self._usual, self._speed = nan, nan, nan

    def add(self, time: float, row: FloatArray, speed: float) -> Jump | None:
        """Take one row (5,) at a time in s and a surge in m/s, NaN where unknown; return a jump where one shows."""
        found = None
        if not self._seconds or floor(time) != floor(self._seconds[-1].begin):
            found = self._close(time)
            self._seconds.append(_Sums(time))
        self._speed = speed if isfinite(speed) and speed > 0.0 else self._speed
        self._usual = self._usual if isfinite(self._usual) else self._speed
        faster = self._speed / self._usual if isfinite(self._speed) else 1.0
        damped, stiff, moved, one, target = row.tolist()
        self._rows.append((damped * faster, damped * abs(damped), stiff, moved * faster * faster, one, target))
        return found

    def state(self) -> dict[str, Any]:
        """Return all of it as plain values; NaN as None."""
        self._sum_up()
        numbers = [v if isfinite(v) else None for v in (self._noise, self._usual, self._speed)]
        return {"numbers": numbers, "sums": [_plain(s) for s in (self._before, *self._seconds)]}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from a state; raises ValueError, TypeError or IndexError where it is none."""
        self._noise, self._usual, self._speed = (nan if v is None else float(v) for v in state["numbers"])
        self._before, *seconds = (_sums(s) for s in state["sums"])
        self._seconds = deque(seconds)

    def _close(self, time: float) -> Jump | None:
        """Look for a jump once a second is whole; where the clock starts again all that was is before."""
        self._sum_up()
        seconds = self._seconds
        while seconds and (len(seconds) >= KEPT_S or time < seconds[-1].begin):
            gone = seconds.popleft()
            self._before.products += gone.products
            self._before.count += gone.count
        found = self._found()
        if found is not None:
            kept = [s for s in seconds if s.begin >= found.time]
            self._before, self._seconds, self._noise = _Sums(), deque(kept), nan
        return found

    def _sum_up(self) -> None:
        """Take the rows that have come into the sums of their second."""
        if self._rows:
            rows = np.array(self._rows)
            self._seconds[-1].products += rows.T @ rows
            self._seconds[-1].count += len(rows)
            self._rows.clear()

    def _found(self) -> Jump | None:
        """Return the jump at the place that explains all rows best, once it lies LEAST_S back.

        A second that does not fit lets earlier places explain it too: the latest ones must be among those compared.
        """
        sums, keep, free, count = np.array([s.products for s in self._seconds]), self._keep, self._free, len(self._seconds)
        if not count:
            return None
        places = np.arange(max(count - MOST_S, 0), count)
        until, so_many = np.cumsum(sums, axis=0), np.cumsum([s.count for s in self._seconds])
        earlier = until[places] - sums[places]
        before, after = self._before.products + earlier, until[-1] - earlier
        since = so_many[-1] - np.append(0.0, so_many)[places]
        inverse, tells = _inverses(before[:, keep][:, :, keep], LEAST_EXCITED)
        theta = (inverse @ before[:, keep, -1:])[..., 0]
        noise = self._noises(sums, theta, places)
        products = after[:, keep][:, :, keep]
        solved, _ = _inverses(products[:, free][:, :, free], 0.0)
        # the new numbers follow from the target, and from drag and stiffness as they were
        slopes = -solved @ products[:, free]
        slopes[:, :, free] = 0.0
        new = theta.copy()
        new[:, free] = (solved @ after[:, keep[free], -1:] + slopes @ theta[..., None])[..., 0]
        left = np.maximum(before[:, -1, -1] - (theta * before[:, keep, -1]).sum(axis=1), 0.0)
        left_now = after[:, -1, -1] - 2.0 * (new * after[:, keep, -1]).sum(axis=1) + _squares(new, products)
        left_now = np.maximum(left_now, 0.0)
        fin, own = int(np.flatnonzero(keep == FIN)[0]), FREE.index(FIN)
        was, is_now = theta[:, fin], new[:, fin]
        counted = self._before.count + so_many[-1] - since
        noisier = np.maximum(left_now * counted / np.maximum(left * since, 1e-30), 1.0)
        moved = slopes[:, own].copy()
        moved[:, fin] -= 1.0
        error = np.sqrt(noise * np.maximum(_squares(moved, inverse) + noisier * solved[:, own, own], 0.0))
        _, is_moved = _inverses(after[:, (FIN, ONE)][:, :, (FIN, ONE)], LEAST_MOVED)
        known_to = np.sqrt(noise * np.maximum(inverse[:, fin, fin], 0.0))
        is_known = np.maximum(known_to, error) <= KNOWN_SHARE * np.maximum(abs(was), abs(is_now))
        misfit = OTHER_MOTION + OTHER_POWER * abs(log(self._speed / self._usual) if isfinite(self._speed) else 0.0)
        jumps = is_moved & is_known & (abs(is_now - was) > misfit * abs(was) + SURE * error)
        best = int(np.argmin(np.where(tells & np.isfinite(noise), left + left_now, np.inf)))
        if not jumps[best] or places[best] > count - LEAST_S:
            return None
        return Jump(self._seconds[places[best]].begin, float(is_now[best] / was[best]), float(error[best] / abs(was[best])))

    def _noises(self, sums: FloatArray, theta: FloatArray, places: IntArray) -> FloatArray:
        """Return the variance of the scores before each place over that of the columns (P,); before few, that of the last look.

        It is the noise of a row, with what its neighbours share.
        """
        keep = self._keep
        is_before = np.arange(len(sums)) < places[:, None]
        draws = is_before.sum(axis=1)
        columns = sums[:, keep][:, :, keep]
        scores = (sums[:, keep, -1] - np.einsum("sij,pj->psi", columns, theta)) * is_before[..., None]
        normal = np.linalg.pinv(np.einsum("ps,sij->pij", is_before.astype(float), columns), hermitian=True)
        spread = np.maximum(np.einsum("psi,pij,psj->p", scores, normal, scores), 0.0) / keep.size
        noise = np.where(draws >= LEAST_DRAWS, spread * draws / np.maximum(draws - keep.size, 1), self._noise)
        self._noise = float(noise[-1])
        return noise


def _squares(vectors: FloatArray, matrices: FloatArray) -> FloatArray:
    """Return v' M v of each of some vectors (P, K) and matrices (P, K, K)."""
    return np.asarray(np.einsum("pi,pij,pj->p", vectors, matrices, vectors))


def _inverses(normals: FloatArray, least: float) -> tuple[FloatArray, BoolArray]:
    """Return the pseudo-inverse of each normal matrix (P, K, K), each column scaled to one, and whether it tells all numbers.

    It does where no eigenvalue of the scaled matrix is below `least`.
    """
    scale = np.sqrt(np.einsum("pii->pi", normals))
    told, scale = (scale > 0.0).all(axis=1), np.where(scale > 0.0, scale, 1.0)
    outer = scale[:, :, None] * scale[:, None, :]
    ones = normals / outer
    return np.asarray(np.linalg.pinv(ones, hermitian=True) / outer), told & (np.linalg.eigvalsh(ones)[:, 0] >= least)


def _plain(sums: _Sums) -> list[Any]:
    return [sums.begin if isfinite(sums.begin) else None, sums.count, sums.products[_UPPER].tolist()]


def _sums(saved: Sequence[Any]) -> _Sums:
    begin, count, upper = saved
    made = _Sums(nan if begin is None else float(begin), count=float(count))
    made.products[_UPPER] = made.products.T[_UPPER] = np.array(upper, dtype=np.float64)
    return made
