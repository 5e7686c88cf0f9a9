"""The maneuvering model fitted to all runs at once: maximum a posteriori by Gauss-Newton, nuisances of the runs profiled out.

Every run has its straight speed and the biases of its rate and sway; every segment of it the state that it begins with
(multiple shooting, Bock 1983), so that a hull without stability of course is fitted as well. The noise of each channel is
that of its residuals, taken larger by (1 + rho)/(1 - rho) where these are correlated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fieldsid.numerics.arrays import FloatArray
from fieldsid.turning.maneuvering.equations import HEIGHTS, NAMES, STATIONS, coefficients, growth_rate, simulate
from fieldsid.turning.maneuvering.flown import HEADING, RATE, SURGE, SWAY, FlownRun
from fieldsid.turning.maneuvering.prior import prior

SHARED = len(NAMES)
OWN = 3
"""Nuisances of a run before its segments': straight speed, bias of the rate, bias of the sway."""
FIRST_NOISE = np.array([0.05, 0.05, 0.02, 0.02])
LEAST_NOISE = np.array([1e-3, 1e-3, 2e-4, 2e-4])
"""m/s, m/s, rad/s, rad: no sensor of a vehicle is finer."""
SWAY_BIAS_SD = 0.02
"""m/s: what a Doppler log may be off by across the hull."""
START_SD = 0.3
"""Prior of a segment's first state and of the straight speed about those measured: m/s, and rad/s."""
FIRST_SEGMENT_S = 6.0
LEAST_SEGMENT_S, SEGMENT_LENGTHS = 12.0, 3.0
"""Segments are this long, s, or the way of so many hulls: what the water does to the vehicle is forgotten at the next one."""
SHORTEST_SEGMENT_S = 4.0
LONGEST_GROWTH = 2.5
"""Segments end before an unstable mode has grown by exp of this."""
MAX_ITERATIONS = 25
MAX_BACKTRACKS = 8
TOLERANCE = 0.02
DIFFERENCE = 1e-4
MAX_RHO = 0.98


@dataclass(frozen=True, slots=True)
class Fitted:
    """Vector (22,) at the maximum, its covariance (22, 22), and what the likelihood of another vector needs."""

    vector: FloatArray
    covariance: FloatArray
    runs: tuple[FlownRun, ...]
    segment_s: float
    noise: FloatArray
    local: tuple[FloatArray, ...]
    response: tuple[FloatArray, ...]
    mean: FloatArray
    precision: FloatArray
    cost: float

    def cost_at(self, vector: FloatArray) -> float:
        """Return minus twice the log posterior at a vector, the nuisances moved to where they fit best to first order."""
        step = vector - self.vector
        total = float((vector - self.mean) @ self.precision @ (vector - self.mean))
        for run, local, response in zip(self.runs, self.local, self.response, strict=True):
            total += _run_cost(run, vector, local + response @ step, self.noise, run.begins(self.segment_s))
        return total


def fit_maneuvering(runs: Sequence[FlownRun], length: float | None) -> Fitted:
    """Fit the coefficients to runs; `length` of the vehicle in m where it is known.

    Raises LinAlgError where the normal equations are singular or what they give is not finite.
    """
    mean, covariance = prior(length)
    found = _Problem(tuple(runs), FIRST_SEGMENT_S, mean, _inverse(covariance)).solved(mean, FIRST_NOISE, keep_noise=True)
    _refuse_not_finite(found)
    best, speed = coefficients(found.vector), float(np.median([r.speed for r in runs]))
    growth = growth_rate(best, speed)
    segment = max(LEAST_SEGMENT_S, SEGMENT_LENGTHS * float(best[0]) / speed)
    if growth > 0.0:
        segment = min(segment, max(LONGEST_GROWTH / growth, SHORTEST_SEGMENT_S))
    found = _Problem(tuple(runs), segment, mean, _inverse(covariance)).solved(found.vector, found.noise, keep_noise=False)
    _refuse_not_finite(found)
    return found


def _refuse_not_finite(found: Fitted) -> None:
    """Refuse a fit with a NaN in it: residuals weighted by such a noise are nil, and the prior would be taken for a result."""
    parts = {"noise": found.noise, "coefficients": found.vector, "covariance": found.covariance, "cost": np.array(found.cost)}
    bad = [name for name, values in parts.items() if not np.isfinite(values).all()]
    if bad:
        raise np.linalg.LinAlgError(f"{' and '.join(bad)} not finite")


def _inverse(matrix: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.inv(matrix), dtype=np.float64)


def _first_local(run: FlownRun, begins: npt.NDArray[np.int64]) -> FloatArray:
    """Return straight speed, biases and first states as measured: (3 + 3 m,)."""
    return np.concatenate([[run.speed, 0.0, 0.0], _measured_states(run, begins).ravel()])


def _measured_states(run: FlownRun, begins: npt.NDArray[np.int64]) -> FloatArray:
    states = np.zeros((begins.size, 3))
    for i, begin in enumerate(begins):
        near = slice(max(begin - 2, 0), begin + 3)
        for j, channel in enumerate((SURGE, SWAY, RATE)):
            values = run.measured[channel, near]
            if np.isfinite(values).any():
                states[i, j] = np.mean(values[np.isfinite(values)])
            elif channel == SURGE:
                states[i, j] = run.speed
    return states


def _residual(
    run: FlownRun, vector: FloatArray, local: FloatArray, begins: npt.NDArray[np.int64], noise: FloatArray
) -> FloatArray:
    """Return the weighted residuals (4, n), zero where nothing was measured, clipped where a simulation has left the water."""
    spread = np.hypot(noise, run.discrepancy)
    return np.clip(np.nan_to_num(_misfit(run, vector, local, begins) / spread[:, None]), -1e6, 1e6)


def _misfit(run: FlownRun, vector: FloatArray, local: FloatArray, begins: npt.NDArray[np.int64]) -> FloatArray:
    """Return measured less simulated (4, n), NaN where nothing was measured."""
    first = local[OWN:].reshape(-1, 3)
    out = simulate(
        coefficients(vector), max(float(local[0]), 0.05), first, begins, run.time, run.fin, run.thrust, STATIONS, HEIGHTS
    )
    out[RATE] += local[1]
    out[HEADING] += local[1]
    out[SWAY] += local[2]
    return np.asarray(run.measured - out)


def _local_prior(run: FlownRun, local: FloatArray, begins: npt.NDArray[np.int64]) -> FloatArray:
    """Return the weighted distances of a run's nuisances from what is believed of them, (3 + 3 m,)."""
    states = (local[OWN:].reshape(-1, 3) - _measured_states(run, begins)) / START_SD
    return np.concatenate([[(local[0] - run.speed) / START_SD], local[1:OWN] / _bias_sd(run), states.ravel()])


def _bias_sd(run: FlownRun) -> FloatArray:
    return np.array([run.rate_bias_sd, SWAY_BIAS_SD])


def _run_cost(run: FlownRun, vector: FloatArray, local: FloatArray, noise: FloatArray, begins: npt.NDArray[np.int64]) -> float:
    return float(np.sum(_residual(run, vector, local, begins, noise) ** 2) + np.sum(_local_prior(run, local, begins) ** 2))


@dataclass(frozen=True, slots=True)
class _Problem:
    runs: tuple[FlownRun, ...]
    segment_s: float
    mean: FloatArray
    precision: FloatArray

    def solved(self, vector: FloatArray, noise: FloatArray, *, keep_noise: bool) -> Fitted:
        begins = [r.begins(self.segment_s) for r in self.runs]
        local = [_first_local(r, b) for r, b in zip(self.runs, begins, strict=True)]
        damping = 1e-2
        cost = self._cost(vector, local, noise, begins)
        for _ in range(MAX_ITERATIONS):
            parts = [self._normal(r, vector, l, b, noise) for r, l, b in zip(self.runs, local, begins, strict=True)]
            moved = False
            before = cost
            for _ in range(MAX_BACKTRACKS):
                step, own = _step(parts, self.precision, self.precision @ (vector - self.mean), damping)
                tried = [l + o for l, o in zip(local, own, strict=True)]
                new = self._cost(vector + step, tried, noise, begins)
                if new < cost:
                    vector, local, cost, moved = vector + step, tried, new, True
                    damping = max(0.2 * damping, 1e-7)
                    break
                damping *= 6.0
            small = before - cost < TOLERANCE
            updated = noise if keep_noise else self._noise(vector, local, begins)
            steady = bool(np.all(np.abs(np.log(updated / noise)) < 0.05))
            noise = updated
            cost = self._cost(vector, local, noise, begins)
            if (small or not moved) and steady:
                break
        parts = [self._normal(r, vector, l, b, noise) for r, l, b in zip(self.runs, local, begins, strict=True)]
        information = self.precision + sum(p.profiled for p in parts)
        return Fitted(
            vector, _inverse(information), self.runs, self.segment_s, noise, tuple(local),
            tuple(p.response for p in parts), self.mean, self.precision, cost,
        )  # fmt: skip

    def _cost(
        self, vector: FloatArray, local: Sequence[FloatArray], noise: FloatArray, begins: Sequence[npt.NDArray[np.int64]]
    ) -> float:
        away = vector - self.mean
        return float(away @ self.precision @ away) + sum(
            _run_cost(r, vector, l, noise, b) for r, l, b in zip(self.runs, local, begins, strict=True)
        )

    def _normal(
        self, run: FlownRun, vector: FloatArray, local: FloatArray, begins: npt.NDArray[np.int64], noise: FloatArray
    ) -> _Normal:
        base = _residual(run, vector, local, begins, noise)
        ok = np.isfinite(run.measured)
        columns = []
        for i in range(SHARED):
            moved = vector.copy()
            moved[i] += DIFFERENCE
            columns.append((_residual(run, moved, local, begins, noise) - base)[ok] / DIFFERENCE)
        own = np.zeros((int(ok.sum()), local.size))
        for i in range(OWN):
            moved = local.copy()
            moved[i] += DIFFERENCE
            own[:, i] = (_residual(run, vector, moved, begins, noise) - base)[ok] / DIFFERENCE
        of_sample = np.broadcast_to(np.searchsorted(begins, np.arange(run.time.size), side="right") - 1, ok.shape)[ok]
        for j in range(3):  # a segment's first state moves nothing but its segment (the heading is not cut)
            moved = local.copy()
            moved[OWN + j :: 3] += DIFFERENCE
            column = (_residual(run, vector, moved, begins, noise) - base)[ok] / DIFFERENCE
            for k in range(begins.size):
                own[of_sample == k, OWN + 3 * k + j] = column[of_sample == k]
        shared = np.stack(columns, axis=1)
        gradient = base[ok]
        weight = np.full(local.size, 1.0 / START_SD)
        weight[1:OWN] = 1.0 / _bias_sd(run)
        pull = _local_prior(run, local, begins) * weight
        return _Normal(
            shared.T @ shared, own.T @ shared, own.T @ own + np.diag(weight**2), shared.T @ gradient, own.T @ gradient + pull
        )

    def _noise(self, vector: FloatArray, local: Sequence[FloatArray], begins: Sequence[npt.NDArray[np.int64]]) -> FloatArray:
        """Return each channel's noise, correlated residuals counted as the fewer independent ones that they are."""
        out = FIRST_NOISE.copy()
        left = [_misfit(r, vector, l, b) for r, l, b in zip(self.runs, local, begins, strict=True)]
        for channel in range(4):
            parts = [e[channel][np.isfinite(r.measured[channel])] for e, r in zip(left, self.runs, strict=True)]
            parts = [p for p in parts if p.size > 1]
            if not parts:
                continue
            power = sum(float(p @ p) for p in parts)
            rho = min(max(sum(float(p[1:] @ p[:-1]) for p in parts) / max(power, 1e-30), 0.0), MAX_RHO)
            size = sum(p.size for p in parts)
            out[channel] = max(np.sqrt(power / size * (1.0 + rho) / (1.0 - rho)), LEAST_NOISE[channel])
        return out


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
