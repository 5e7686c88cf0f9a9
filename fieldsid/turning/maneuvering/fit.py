"""The maneuvering model fitted to all runs at once: maximum a posteriori by Gauss-Newton, nuisances of the runs profiled out.

Runs are cut into segments (multiple shooting, Bock 1983), short ones first and longer ones then, so that the start is not led
to a wrong minimum. Every run has its straight speed and the biases of its rate and sway, every segment the state that it begins
with, so that a hull without stability of course is fitted as well. The noise of each channel is that of its residuals, taken
larger by (1 + rho)/(1 - rho) where these are correlated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit
from fieldsid.numerics.ljung_box import inflation
from fieldsid.turning.maneuvering.equations import NAMES, coefficients, growth_rate, longest_step, simulate
from fieldsid.turning.maneuvering.flown import HEADING, RATE, STATE_SD, SURGE, SWAY, FlownRun
from fieldsid.turning.maneuvering.prior import FARTHEST_COST, Prior, prior
from fieldsid.turning.steady.transient import LEAST_SURGE_M_S

OWN = 3
"""Nuisances of a run before its segments': straight speed, bias of the rate, bias of the sway."""
SWAY_BIAS_SD = 0.02
"""m/s: what a Doppler log may be off by across the hull."""
LARGEST_RESIDUAL = 1e6
"""Weighted residuals are clipped here where a simulation has left the water."""


@dataclass(frozen=True, slots=True)
class CutRun:
    """A run whose segments begin at samples `begins` (m,), the nuisances (3 + 3 m,) measured there, one over their spread.

    `longest` is the longest time step, s.
    """

    run: FlownRun
    begins: npt.NDArray[np.int64]
    first: FloatArray
    weight: FloatArray
    longest: float

    def misfit(self, p: FloatArray, local: FloatArray) -> FloatArray:
        """Return measured less simulated (4, n) with coefficients p and nuisances `local`, NaN where nothing was measured."""
        run, states = self.run, local[OWN:].reshape(-1, 3)
        straight = max(float(local[0]), LEAST_SURGE_M_S)
        out = simulate(p, straight, states, self.begins, run.time, run.fin, run.thrust, self.longest)
        out[RATE] += local[1]
        out[HEADING] += local[1]
        out[SWAY] += local[2]
        return np.asarray(run.measured - out)

    def residual(self, p: FloatArray, local: FloatArray, noise: FloatArray) -> FloatArray:
        """Return the weighted residuals (4, n), zero where nothing was measured; `noise` (4,)."""
        spread = np.hypot(noise, self.run.discrepancy)
        weighted = np.nan_to_num(self.misfit(p, local) / spread[:, None], nan=LARGEST_RESIDUAL)
        return np.where(np.isfinite(self.run.measured), np.clip(weighted, -LARGEST_RESIDUAL, LARGEST_RESIDUAL), 0.0)

    def away(self, local: FloatArray) -> FloatArray:
        """Return the weighted distances of the nuisances from what was measured of them, (3 + 3 m,)."""
        return np.asarray((local - self.first) * self.weight)

    def cost(self, p: FloatArray, local: FloatArray, noise: FloatArray) -> float:
        """Return the sum of the squares of both."""
        away = self.away(local)
        spread = np.hypot(noise, self.run.discrepancy)
        return float(away @ away) + float(_square_sum(self.misfit(p, local), self.run.measured, spread))


@jit
def _square_sum(misfit: FloatArray, measured: FloatArray, spread: FloatArray) -> float:
    """Return the sum of the residuals' squares; a simulation that ends in a NaN is as bad as any can be."""
    total = 0.0
    for i in range(misfit.shape[0]):
        for j in range(misfit.shape[1]):
            if math.isfinite(measured[i, j]):
                size = abs(misfit[i, j]) / spread[i]
                total += min(size, LARGEST_RESIDUAL) ** 2 if math.isfinite(size) else LARGEST_RESIDUAL**2
    return total


def cut_run(run: FlownRun, segment_s: float, length: float) -> CutRun:
    """Return a run cut into segments of about `segment_s`, of a vehicle about `length` m long."""
    begins = run.begins(segment_s)
    states = np.zeros((begins.size, 3))
    for i, begin in enumerate(begins):
        near = slice(max(begin - 2, 0), begin + 3)
        for j, channel in enumerate((SURGE, SWAY, RATE)):
            values = run.measured[channel, near]
            if np.isfinite(values).any():
                states[i, j] = np.mean(values[np.isfinite(values)])
            elif channel == SURGE:
                states[i, j] = run.speed
    spread = np.concatenate([[run.speed_sd, run.rate_bias_sd, SWAY_BIAS_SD], np.full(states.size, STATE_SD)])
    return CutRun(
        run, begins, np.concatenate([[run.speed, 0.0, 0.0], states.ravel()]), 1.0 / spread, longest_step(length, run.speed)
    )


SHARED = len(NAMES)
FIRST_NOISE = np.array([0.05, 0.05, 0.02, 0.02])
LEAST_NOISE = np.array([1e-3, 1e-3, 2e-4, 2e-4])
"""m/s, m/s, rad/s, rad: no sensor of a vehicle is finer."""
FIRST_SEGMENTS_S = (1.5, 6.0)
"""What a wrong vector does within so short a time is still near to what was measured, so that it is led to the right one: an
unstable hull fitted to 6 s at once stayed at a cost of 2378 where the right vector has 866."""
LEAST_SEGMENT_S, SEGMENT_LENGTHS = 12.0, 3.0
"""Segments are this long, s, or the way of so many hulls: what the water does to the vehicle is forgotten at the next one."""
SHORTEST_SEGMENT_S = 4.0
LONGEST_GROWTH = 2.5
"""Segments end before an unstable mode has grown by exp of this."""
MAX_ITERATIONS = 25
MAX_BACKTRACKS = 8
TOLERANCE, START_TOLERANCE = 0.02, 0.5
"""Of minus twice the log posterior; a start need not be at its minimum."""
DIFFERENCE = 1e-4


@dataclass(frozen=True, slots=True)
class Fitted:
    """Vector (22,) at the maximum, its covariance (22, 22), and what the likelihood of another vector needs."""

    vector: FloatArray
    covariance: FloatArray
    cuts: tuple[CutRun, ...]
    noise: FloatArray
    local: tuple[FloatArray, ...]
    response: tuple[FloatArray, ...]
    prior: Prior
    cost: float

    def cost_at(self, vector: FloatArray) -> float:
        """Return minus twice the log posterior at a vector, the nuisances moved to where they fit best to first order."""
        step, p = vector - self.vector, coefficients(vector)
        total = self.prior.cost(vector)
        for cut, local, response in zip(self.cuts, self.local, self.response, strict=True):
            total += cut.cost(p, local + response @ step, self.noise)
        return total

    @property
    def is_usual(self) -> bool:
        """Whether the vector is one that vehicles have."""
        return self.prior.cost(self.vector) < FARTHEST_COST

    @property
    def runs(self) -> tuple[FlownRun, ...]:
        """The runs it rests on."""
        return tuple(cut.run for cut in self.cuts)


def fit_maneuvering(runs: Sequence[FlownRun], length: float | None) -> Fitted:
    """Fit the coefficients to runs; `length` of the vehicle in m where it is known.

    Raises LinAlgError where the normal equations are singular or what they give is not finite.
    """
    believed = prior(length)
    found = _from_start(runs, believed.mean, believed)
    if not found.is_usual:
        away = np.zeros(SHARED)
        away[0] = 1.0 / believed.axes[0, 0]
        tried = [found, *(_from_start(runs, believed.mean + way * away, believed) for way in (-1.0, 1.0))]
        found = min(tried, key=lambda f: f.cost)
    best, speed = coefficients(found.vector), float(np.median([r.speed for r in runs]))
    growth = growth_rate(best, speed)
    segment = max(LEAST_SEGMENT_S, SEGMENT_LENGTHS * float(best[0]) / speed)
    if growth > 0.0:
        segment = min(segment, max(LONGEST_GROWTH / growth, SHORTEST_SEGMENT_S))
    whole = _problem(runs, segment, believed)
    # a noise taken from what does not follow yet, vector or first states, passes for one that hides what the run says
    found = whole.solved(found.vector, found.noise, keep_noise=True)
    found = whole.solved(found.vector, found.noise, keep_noise=False, local=found.local)
    _refuse_not_finite(found)
    return found


def _from_start(runs: Sequence[FlownRun], start: FloatArray, believed: Prior) -> Fitted:
    """Return the fit to longer and longer segments, the noise not known yet."""
    for segment in FIRST_SEGMENTS_S:
        found = _problem(runs, segment, believed).solved(start, FIRST_NOISE, keep_noise=True)
        _refuse_not_finite(found)
        start = found.vector
    return found


def _refuse_not_finite(found: Fitted) -> None:
    """Refuse a fit with a NaN in it: residuals weighted by such a noise are nil, and the prior would be taken for a result."""
    parts = {"noise": found.noise, "coefficients": found.vector, "covariance": found.covariance, "cost": np.array(found.cost)}
    bad = [name for name, values in parts.items() if not np.isfinite(values).all()]
    if bad:
        raise np.linalg.LinAlgError(f"{' and '.join(bad)} not finite")


def _inverse(matrix: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.inv(matrix), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class _Problem:
    cuts: tuple[CutRun, ...]
    prior: Prior

    def solved(
        self, vector: FloatArray, noise: FloatArray, *, keep_noise: bool, local: Sequence[FloatArray] | None = None
    ) -> Fitted:
        """Return the fit that starts from a vector and the runs' nuisances, those measured where none are given."""
        local = [cut.first for cut in self.cuts] if local is None else list(local)
        damping = 1e-2
        cost = self._cost(vector, local, noise)
        for _ in range(MAX_ITERATIONS):
            parts = [_normal(cut, vector, own, noise) for cut, own in zip(self.cuts, local, strict=True)]
            precision = self.prior.precision(vector)
            pull = precision @ (vector - self.prior.mean)
            moved = False
            before = cost
            for _ in range(MAX_BACKTRACKS):
                step, own = _step(parts, precision, pull, damping)
                tried = [l + o for l, o in zip(local, own, strict=True)]
                new = self._cost(vector + step, tried, noise)
                if new < cost:
                    vector, local, cost, moved = vector + step, tried, new, True
                    damping = max(0.2 * damping, 1e-7)
                    break
                damping *= 6.0
            small = before - cost < (START_TOLERANCE if keep_noise else TOLERANCE)
            updated = noise if keep_noise else self._noise(vector, local)
            steady = bool(np.all(np.abs(np.log(updated / noise)) < 0.05))
            noise = updated
            cost = self._cost(vector, local, noise)
            if (small or not moved) and steady:
                break
        parts = [_normal(cut, vector, own, noise) for cut, own in zip(self.cuts, local, strict=True)]
        information = self.prior.precision(vector) + sum(p.profiled for p in parts)
        return Fitted(
            vector, _inverse(information), self.cuts, noise, tuple(local),
            tuple(p.response for p in parts), self.prior, cost,
        )  # fmt: skip

    def _cost(self, vector: FloatArray, local: Sequence[FloatArray], noise: FloatArray) -> float:
        p = coefficients(vector)
        return self.prior.cost(vector) + sum(cut.cost(p, own, noise) for cut, own in zip(self.cuts, local, strict=True))

    def _noise(self, vector: FloatArray, local: Sequence[FloatArray]) -> FloatArray:
        """Return each channel's noise, correlated residuals counted as the fewer independent ones that they are."""
        out, p = FIRST_NOISE.copy(), coefficients(vector)
        left = [cut.misfit(p, own) for cut, own in zip(self.cuts, local, strict=True)]
        for channel in range(4):
            parts = [e[channel][np.isfinite(cut.run.measured[channel])] for e, cut in zip(left, self.cuts, strict=True)]
            parts = [p for p in parts if p.size > 1]
            if not parts:
                continue
            power = sum(float(p @ p) for p in parts)
            out[channel] = max(np.sqrt(power / sum(p.size for p in parts) * inflation(parts)), LEAST_NOISE[channel])
        return out


def _problem(runs: Sequence[FlownRun], segment_s: float, believed: Prior) -> _Problem:
    length = float(np.exp(believed.mean[0]))
    return _Problem(tuple(cut_run(r, segment_s, length) for r in runs), believed)


def _normal(cut: CutRun, vector: FloatArray, local: FloatArray, noise: FloatArray) -> _Normal:
    """Return the normal equations of a run; a segment's first state moves nothing but its segment (the heading is not cut)."""
    p, columns = coefficients(vector), []
    base = cut.residual(p, local, noise)
    for i in range(SHARED):
        moved = vector.copy()
        moved[i] += DIFFERENCE
        columns.append(cut.residual(coefficients(moved), local, noise))
    of_own = [slice(i, i + 1) for i in range(OWN)]
    for part in (*of_own, *(slice(OWN + j, None, 3) for j in range(3))):
        start = local.copy()
        start[part] += DIFFERENCE
        columns.append(cut.residual(p, start, noise))
    moves = (np.array(columns) - base) / DIFFERENCE
    whole, first = np.concatenate([moves[: SHARED + OWN], base[None]]), moves[SHARED + OWN :]
    dense = whole.reshape(whole.shape[0], -1)
    square = dense @ dense.T
    by_segment = np.add.reduceat(np.einsum("jcn,acn->jan", first, whole), cut.begins, axis=2)
    size, m = local.size, cut.begins.size
    cross, own, gradient = np.empty((size, SHARED)), np.zeros((size, size)), np.empty(size)
    cross[:OWN], own[:OWN, :OWN], gradient[:OWN] = square[SHARED:-1, :SHARED], square[SHARED:-1, SHARED:-1], square[SHARED:-1, -1]
    flat = by_segment.transpose(2, 0, 1).reshape(3 * m, -1)
    cross[OWN:], own[OWN:, :OWN], gradient[OWN:] = flat[:, :SHARED], flat[:, SHARED:-1], flat[:, -1]
    own[:OWN, OWN:] = own[OWN:, :OWN].T
    blocks = np.add.reduceat(np.einsum("jcn,kcn->jkn", first, first), cut.begins, axis=2)
    for k in range(m):
        inside = slice(OWN + 3 * k, OWN + 3 * k + 3)
        own[inside, inside] = blocks[:, :, k]
    own += np.diag(cut.weight**2)
    return _Normal(square[:SHARED, :SHARED], cross, own, square[:SHARED, -1], gradient + cut.away(local) * cut.weight)


@dataclass(frozen=True, slots=True)
class _Normal:
    """Normal equations of one run: shared by shared, own by shared, own by own, and the gradients."""

    shared: FloatArray
    cross: FloatArray
    own: FloatArray
    shared_gradient: FloatArray
    own_gradient: FloatArray

    @property
    def response(self) -> FloatArray:
        """How the nuisances follow the shared coefficients, (own, 22)."""
        return np.asarray(-np.linalg.solve(self.own, self.cross))

    @property
    def profiled(self) -> FloatArray:
        """What the run says of the shared coefficients, (22, 22)."""
        return self.shared + self.cross.T @ self.response


def _step(
    parts: Sequence[_Normal], precision: FloatArray, pull: FloatArray, damping: float
) -> tuple[FloatArray, list[FloatArray]]:
    """Return the damped Gauss-Newton step of the shared coefficients and of the runs' nuisances."""
    matrix, gradient = precision.copy(), pull.copy()
    solved = []
    for p in parts:
        own = p.own + damping * np.diag(np.diag(p.own))
        inverse = np.linalg.solve(own, np.column_stack([p.cross, p.own_gradient]))
        solved.append(inverse)
        matrix += p.shared - p.cross.T @ inverse[:, :-1]
        gradient += p.shared_gradient - p.cross.T @ inverse[:, -1]
    matrix += damping * np.diag(np.diag(matrix))
    step = np.asarray(-np.linalg.solve(matrix, gradient), dtype=np.float64)
    return step, [-(s[:, :-1] @ step + s[:, -1]) for s in solved]
