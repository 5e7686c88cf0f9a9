"""A jump of the fin's authority told as it happens, the damping as it was: a linkage that slipped.

The equation's rows are summed second by second. At each second what came last is compared with all before, for every place
where it may have begun: by damping, drag and stiffness as they were the fin turns the vehicle so much more or less. Damping goes
with the speed, authority with its square. How little the drag is known at rates that were not flown before is in the error. A
second is longer than residuals remember, so that its sum of scores is one independent draw of their noise. What takes damping and
authority by one share, as more inertia or a smaller fin at the stern does, hardly shows: the turn it comes to stays the same.
Source: Chow 1960, Econometrica 28(3); the scores' variance by clusters: Liang and Zeger 1986, Biometrika 73(1).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import floor, isfinite, nan, sqrt
from typing import Annotated, Any

import numpy as np

from fieldsid.numerics.arrays import FloatArray
from fieldsid.records.keys import Key

KEPT_S, LEAST_S, MOST_S = 60, 6, 20
"""Seconds that are kept apart, and the least and the most of them that may have come after a jump."""
OTHER_MOTION = 0.15
"""Share by which one authority answers for another motion otherwise: sway and lag that no such model has."""
SURE = 4.5
"""Standard errors beyond that: at 15 places a second, an hour of noise alone makes fewer than one in ten thousand."""
KNOWN_SHARE = 0.1
"""Standard error, as a share, at which the authority before is known well enough to be compared with."""
LEAST_DRAWS = 20
"""Seconds that the noise of the scores is told from."""
LEAST_EXCITED, LEAST_MOVED = 1e-6, 0.05
"""Least eigenvalue, scaled to ones, of all columns before and of fin and trim since: a fin that is held tells neither."""
WIDTH = 6
FREE = np.array([3, 4])
"""Columns: rate, rate with its size, angle, fin, one, target; fin and one are free after a jump."""
_UPPER = np.triu_indices(WIDTH)


@dataclass(frozen=True, slots=True)
class Jump:
    """A jump of the fin's authority at the damping there was, as by a linkage that slipped."""

    time: Annotated[float, Key("When it was, about; the estimate is of what came since.", "since_s")]
    factor: Annotated[float, Key("The authority over what it was, at the same speed.")]
    std_error: Annotated[float, Key("Its standard error.")]


@dataclass(slots=True)
class _Sums:
    """Products of rows [phi, target] (5, 5) over a while from `begin` s on, and how many they are."""

    begin: float
    products: FloatArray
    count: float = 0.0


class AuthorityJump:
    """Sums of rows, those of the last minute second by second; `stiff` says whether the second column has a parameter."""

    __slots__ = ("_before", "_keep", "_noise", "_rows", "_seconds", "_speed", "_usual")

    def __init__(self, *, stiff: bool) -> None:
        self._keep = np.array([0, 1, 2, 3, 4] if stiff else [0, 1, 3, 4])
        self._before = _Sums(nan, np.zeros((WIDTH, WIDTH)))
        self._seconds: deque[_Sums] = deque()
        self._rows: list[tuple[float, ...]] = []
        self._noise, self._usual, self._speed = nan, nan, nan

    def add(self, time: float, row: FloatArray, speed: float) -> Jump | None:
        """Take one row (5,) at a time in s and a surge in m/s, NaN where unknown; return a jump where one shows."""
        found = None
        if not self._seconds or floor(time) != floor(self._seconds[-1].begin):
            found = self._close(time)
            self._seconds.append(_Sums(time, np.zeros((WIDTH, WIDTH))))
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
            self._put_before(seconds.popleft())
        found = self._found()
        if found is not None:
            kept = [s for s in seconds if s.begin >= found.time]
            self._before, self._seconds, self._noise = _Sums(nan, np.zeros((WIDTH, WIDTH))), deque(kept), nan
        return found

    def _sum_up(self) -> None:
        """Take the rows that have come into the sums of their second."""
        if self._rows:
            rows = np.array(self._rows)
            self._seconds[-1].products += rows.T @ rows
            self._seconds[-1].count += len(rows)
            self._rows.clear()

    def _put_before(self, one: _Sums) -> None:
        self._before.products += one.products
        self._before.count += one.count

    def _found(self) -> Jump | None:
        """Return the jump at the place that explains all rows best, once it lies LEAST_S back.

        A second that does not fit lets earlier places explain it too: the latest ones must be among those compared.
        """
        seconds = list(self._seconds)
        places = range(max(len(seconds) - MOST_S, 0), len(seconds))
        tried = [(found, place) for place in places if (found := self._at(seconds, place)) is not None]
        (_, jump), place = min(tried, key=lambda t: t[0][0], default=((0.0, None), 0))
        return jump if place <= len(seconds) - LEAST_S else None

    def _at(self, seconds: Sequence[_Sums], place: int) -> tuple[float, Jump | None] | None:
        """Return the squared errors left with a jump before the second at a place, and that jump where it is one.

        None where what came before does not tell; no jump where what came since does not.

        What has come last is fitted with the damping, drag and stiffness from before: its authority and trim alone are free.
        """
        earlier, recent = seconds[:place], seconds[place:]
        before = self._before.products + sum(s.products for s in earlier)
        after = np.asarray(sum(s.products for s in recent))
        counts = self._before.count + sum(s.count for s in earlier), sum(s.count for s in recent)
        keep, size = self._keep, self._keep.size - FREE.size
        inverse = _inverse(before[np.ix_(keep, keep)], LEAST_EXCITED)
        if inverse is None:
            return None
        theta = inverse @ before[keep, -1]
        if len(earlier) >= LEAST_DRAWS:
            self._noise = self._noise_of(earlier, theta)
        if not isfinite(self._noise):
            return None
        told = _inverse(after[np.ix_(FREE, FREE)], LEAST_MOVED)
        solved = np.linalg.pinv(after[np.ix_(FREE, FREE)], hermitian=True) if told is None else told
        whole = np.concatenate([keep[:size], [WIDTH - 1]])
        given = np.append(-theta[:size], 1.0)
        reached = solved @ after[np.ix_(FREE, whole)]
        new = reached @ given
        left = max(float(before[-1, -1] - theta @ before[keep, -1]), 0.0)
        left_now = max(float(given @ after[np.ix_(whole, whole)] @ given - new @ after[np.ix_(FREE, whole)] @ given), 0.0)
        was, is_now = float(theta[size]), float(new[0])
        noisier = max(left_now * counts[0] / (left * counts[1]), 1.0) if left > 0.0 else 1.0
        moved = np.append(-reached[0, :size], [-1.0, 0.0])
        error = sqrt(self._noise * float(moved @ inverse @ moved + noisier * solved[0, 0]))
        known_to = sqrt(self._noise * float(inverse[size, size]))
        if told is None or known_to > KNOWN_SHARE * abs(was) or abs(is_now - was) <= OTHER_MOTION * abs(was) + SURE * error:
            return left + left_now, None
        return left + left_now, Jump(recent[0].begin, is_now / was, error / abs(was))

    def _noise_of(self, seconds: Sequence[_Sums], theta: FloatArray) -> float:
        """Return the variance of the scores over that of the columns: the noise of a row, with what its neighbours share."""
        keep, count = self._keep, len(seconds)
        products = np.array([s.products for s in seconds])[:, keep]
        scores = products[:, :, -1] - products[:, :, keep] @ theta
        normal = np.linalg.pinv(products[:, :, keep].sum(axis=0), hermitian=True)
        spread = float(np.einsum("ji,ik,jk->", scores, normal, scores)) / keep.size
        return spread * count / (count - keep.size)


def _inverse(normal: FloatArray, least: float) -> FloatArray | None:
    """Return the inverse of a normal matrix; None where, scaled to ones, it has an eigenvalue below the least."""
    scale = np.sqrt(np.diag(normal))
    if not (scale > 0.0).all():
        return None
    ones = normal / np.outer(scale, scale)
    return None if np.linalg.eigvalsh(ones)[0] < least else np.asarray(np.linalg.inv(ones) / np.outer(scale, scale))


def _plain(sums: _Sums) -> list[Any]:
    return [sums.begin if isfinite(sums.begin) else None, sums.count, sums.products[_UPPER].tolist()]


def _sums(saved: Sequence[Any]) -> _Sums:
    begin, count, upper = saved
    products = np.zeros((WIDTH, WIDTH))
    products[_UPPER] = np.array(upper, dtype=np.float64)
    return _Sums(nan if begin is None else float(begin), products + np.triu(products, 1).T, float(count))
