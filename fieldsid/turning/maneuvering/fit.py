"""The maneuvering model fitted to all runs at once: maximum a posteriori by Gauss-Newton, with the runs' nuisances profiled out.

Runs are cut into segments (multiple shooting, Bock 1983), at first short and then longer, to avoid local minima. The nuisance
parameters of a run are its straight speed and the biases of rate and sway, those of a segment its initial state, so that a
directionally unstable hull can be fitted as well. The noise variance of each channel is that of its residuals, multiplied by
(1 + rho)/(1 - rho) where these are correlated.
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
from fieldsid.plant.yaw_plant import LEAST_SURGE_M_S
from fieldsid.turning.maneuvering.equations import NAMES, coefficients, growth_rate, longest_step, simulate
from fieldsid.turning.maneuvering.flown import HEADING, RATE, STATE_SD, SURGE, SWAY, FlownRun
from fieldsid.turning.maneuvering.prior import FARTHEST_COST, Prior, prior

OWN = len(("straight speed", "bias of the rate", "bias of the sway"))
"""Number of a run's nuisances ahead of those of its segments."""
SWAY_BIAS_SD = 0.02
"""Standard deviation of a Doppler log's sway bias, m/s."""
LARGEST_RESIDUAL = 1e6
"""Weighted residuals are clipped to this size, for simulations that diverge."""


@dataclass(frozen=True, slots=True)
class CutRun:
    """A run cut into segments that begin at samples `begins` (m,).

    `first` (3 + 3 m,) are prior means of its nuisances, as measured, `weight` one over their standard deviations; `longest` is
    the longest time step in s.
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
        """Return the weighted deviations of the nuisances from their prior means, (3 + 3 m,)."""
        return np.asarray((local - self.first) * self.weight)

    def cost(self, p: FloatArray, local: FloatArray, noise: FloatArray) -> float:
        """Return the sum of squares of the weighted residuals and of the weighted deviations of the nuisances."""
        away = self.away(local)
        spread = np.hypot(noise, self.run.discrepancy)
        return float(away @ away) + float(_square_sum(self.misfit(p, local), self.run.measured, spread))


@jit
def _square_sum(misfit: FloatArray, measured: FloatArray, spread: FloatArray) -> float:
    """Return the sum of squares of the weighted residuals, where a NaN counts as LARGEST_RESIDUAL."""
    total = 0.0
    for i in range(misfit.shape[0]):
        for j in range(misfit.shape[1]):
            if math.isfinite(measured[i, j]):
                size = abs(misfit[i, j]) / spread[i]
                total += min(size, LARGEST_RESIDUAL) ** 2 if math.isfinite(size) else LARGEST_RESIDUAL**2
    return total


def cut_run(run: FlownRun, segment_s: float, length: float) -> CutRun:
    """Return a run cut into segments of about `segment_s` s; `length` (m) of the vehicle decides on the time step."""
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
"""m/s, m/s, rad/s, rad: lower limits, since no sensor of a vehicle is better."""
FIRST_SEGMENTS_S = (1.5, 6.0)
"""Over short segments the simulation of a wrong vector stays near the measurement, so that the iteration converges: an unstable
hull fitted to segments of 6 s at once stayed at a cost of 2378 where the right vector has 866."""
LEAST_SEGMENT_S, SEGMENT_LENGTHS = 12.0, 3.0
"""Segments last this many s, or for the travel of this many hull lengths if longer; disturbances do not act beyond a segment."""
SHORTEST_SEGMENT_S = 4.0
LONGEST_GROWTH = 2.5
"""Segments end before an unstable mode has grown by the factor exp(LONGEST_GROWTH)."""
MAX_ITERATIONS = 25
MAX_BACKTRACKS = 8
TOLERANCE, START_TOLERANCE = 0.02, 0.5
"""Decrease of minus twice the log posterior at which the iteration ends; larger for a start, which need not be a minimum."""
DIFFERENCE = 1e-4


@dataclass(frozen=True, slots=True)
class Fitted:
    """The vector (22,) at the maximum, its covariance (22, 22), and the data for the likelihood of other vectors.

    `local` are the nuisances of each run, `response` their derivatives by the vector, `cost` minus twice the log posterior.
    """

    vector: FloatArray
    covariance: FloatArray
    cuts: tuple[CutRun, ...]
    noise: FloatArray
    local: tuple[FloatArray, ...]
    response: tuple[FloatArray, ...]
    prior: Prior
    cost: float

    def cost_at(self, vector: FloatArray) -> float:
        """Return minus twice the log posterior at a vector, with the nuisances at their optimum to first order."""
        step, p = vector - self.vector, coefficients(vector)
        total = self.prior.cost(vector)
        for cut, local, response in zip(self.cuts, self.local, self.response, strict=True):
            total += cut.cost(p, local + response @ step, self.noise)
        return total

    @property
    def is_usual(self) -> bool:
        """Whether the prior cost of the vector is below FARTHEST_COST."""
        return self.prior.cost(self.vector) < FARTHEST_COST

    @property
    def runs(self) -> tuple[FlownRun, ...]:
        """The runs of the fit."""
        return tuple(cut.run for cut in self.cuts)


def fit_maneuvering(runs: Sequence[FlownRun], length: float | None) -> Fitted:
    """Fit the coefficients to runs; `length` is the vehicle's in m where it is known.

    Raises LinAlgError where the normal equations are singular or the solution is not finite.
    """
    believed = prior(length)
    found = _from_start(runs, believed.mean, believed)
    if not found.is_usual:
        length_step = np.zeros(SHARED)
        length_step[0] = 1.0 / believed.axes[0, 0]
        candidates = [found, *(_from_start(runs, believed.mean + sign * length_step, believed) for sign in (-1.0, 1.0))]
        found = min(candidates, key=lambda f: f.cost)
    best, speed = coefficients(found.vector), float(np.median([r.speed for r in runs]))
    growth = growth_rate(best, speed)
    segment = max(LEAST_SEGMENT_S, SEGMENT_LENGTHS * float(best[0]) / speed)
    if growth > 0.0:
        segment = min(segment, max(LONGEST_GROWTH / growth, SHORTEST_SEGMENT_S))
    problem = _problem(runs, segment, believed)
    # a noise estimated before vector and initial states have converged would be too large and hide information in the run
    found = problem.solved(found.vector, found.noise, keep_noise=True)
    found = problem.solved(found.vector, found.noise, keep_noise=False, local=found.local)
    _refuse_not_finite(found)
    return found


def _from_start(runs: Sequence[FlownRun], start: FloatArray, believed: Prior) -> Fitted:
    """Return the fit from a start vector to segments of the lengths FIRST_SEGMENTS_S in turn, with FIRST_NOISE."""
    for segment in FIRST_SEGMENTS_S:
        found = _problem(runs, segment, believed).solved(start, FIRST_NOISE, keep_noise=True)
        _refuse_not_finite(found)
        start = found.vector
    return found


def _refuse_not_finite(found: Fitted) -> None:
    """Raise LinAlgError for a fit with a NaN: residuals weighted by such a noise vanish, and the result would be the prior."""
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
        """Return the fit from a start vector and start nuisances `local` of the runs, by default their prior means.

        keep_noise: the noise is not estimated. Else that of the start vector is its upper limit: its residuals show that the
        equations follow each channel so far, and a channel they then follow less would be weighted, and followed, ever less.
        """
        local = [cut.first for cut in self.cuts] if local is None else list(local)
        damping = 1e-2
        cost = self._cost(vector, local, noise)
        largest = noise if keep_noise else self._noise(vector, local)
        for _ in range(MAX_ITERATIONS):
            parts = [_normal(cut, vector, own, noise) for cut, own in zip(self.cuts, local, strict=True)]
            precision = self.prior.precision(vector)
            pull = precision @ (vector - self.prior.mean)
            moved = False
            before = cost
            for _ in range(MAX_BACKTRACKS):
                step, own = _step(parts, precision, pull, damping)
                new_local = [l + o for l, o in zip(local, own, strict=True)]
                new = self._cost(vector + step, new_local, noise)
                if new < cost:
                    vector, local, cost, moved = vector + step, new_local, new, True
                    damping = max(0.2 * damping, 1e-7)
                    break
                damping *= 6.0
            small = before - cost < (START_TOLERANCE if keep_noise else TOLERANCE)
            updated = noise if keep_noise else np.minimum(self._noise(vector, local), largest)
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
        """Return the noise of each channel (4,): the rms of the residuals, inflated for their autocorrelation."""
        out, p = FIRST_NOISE.copy(), coefficients(vector)
        residuals = [cut.misfit(p, own) for cut, own in zip(self.cuts, local, strict=True)]
        for channel in range(4):
            parts = [e[channel][np.isfinite(cut.run.measured[channel])] for e, cut in zip(residuals, self.cuts, strict=True)]
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
    """Return the normal equations of a run; the initial state of a segment acts on this segment only (the heading is not cut)."""
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
    of_run, first = np.concatenate([moves[: SHARED + OWN], base[None]]), moves[SHARED + OWN :]
    dense = of_run.reshape(of_run.shape[0], -1)
    square = dense @ dense.T
    by_segment = np.add.reduceat(np.einsum("jcn,acn->jan", first, of_run), cut.begins, axis=2)
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
    """Normal equations of one run in blocks: coefficients (`shared`), nuisances by coefficients (`cross`), nuisances (`own`)."""

    shared: FloatArray
    cross: FloatArray
    own: FloatArray
    shared_gradient: FloatArray
    own_gradient: FloatArray

    @property
    def response(self) -> FloatArray:
        """The derivatives of the optimal nuisances by the shared coefficients, (3 + 3 m, 22)."""
        return np.asarray(-np.linalg.solve(self.own, self.cross))

    @property
    def profiled(self) -> FloatArray:
        """The run's information on the shared coefficients with the nuisances profiled out, (22, 22)."""
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
