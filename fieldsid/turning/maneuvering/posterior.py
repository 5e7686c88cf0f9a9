"""Draws from the posterior of the maneuvering model by elliptical slice sampling, and their steady turns.

Chains start about the maximum and move on ellipses of a Gaussian that is fitted to the posterior (generalised elliptical slice
sampling: Nishihara, Murray and Adams 2014): no step is rejected, and no step size is tuned. The first part of the chains, without
its first half, adapts the Gaussian. The posterior is far from Gaussian: of 400 draws from a Gaussian or a Student's t about the
maximum, importance weighting left 1 to 26 effective ones. Draws without a settled turn are left out for that turn and counted.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fieldsid.numerics.arrays import FloatArray
from fieldsid.runtime.parallel_map import parallel_map
from fieldsid.turning.maneuvering.equations import coefficients, settle
from fieldsid.turning.maneuvering.fit import Fitted

CHAINS = 8
STEPS, EVERY = 76, 2
"""Steps of a chain, each of about five simulations of all runs, and the thinning of those used."""
BEFORE_ADAPTED, LEFT_OUT = 14, 16
"""Steps before the Gaussian is adapted, and steps at the start of a chain that are discarded."""
START_SHARE = 0.5
"""Spread of the chains' starts over that of the posterior's covariance, in whose tails the true posterior is low."""
WIDER = 1.2
"""Spread of the Gaussian over that of the posterior: with narrower tails than the posterior's a chain would be trapped there."""
NARROWEST_RAD = 1e-6
"""Bracket of the angle on an ellipse below which a step ends where it began."""


@dataclass(frozen=True, slots=True)
class Posterior:
    """Vectors (c, s, 22) of c chains, s steps each."""

    chains: FloatArray

    @property
    def vectors(self) -> FloatArray:
        """All draws, (c s, 22)."""
        return self.chains.reshape(-1, self.chains.shape[-1])


def draw_posterior(fitted: Fitted, rng: np.random.Generator) -> Posterior:
    """Return draws of the coefficients from the posterior of a fit."""
    about = _Gaussian.of(fitted.vector, fitted.covariance)
    now = about.centre + START_SHARE / WIDER * rng.standard_normal((CHAINS, about.centre.size)) @ about.root.T
    first = _advanced(fitted.cost_at, about, now, BEFORE_ADAPTED, rng)
    draws = first[:, BEFORE_ADAPTED // 2 :].reshape(-1, about.centre.size)
    # so few draws estimate a covariance of 22 by 22 badly: it is averaged with that at the maximum
    about = _Gaussian.of(draws.mean(axis=0), np.asarray(0.5 * (fitted.covariance + np.cov(draws.T)), dtype=np.float64))
    later = _advanced(fitted.cost_at, about, first[:, -1], STEPS - BEFORE_ADAPTED, rng)
    return Posterior(later[:, LEFT_OUT - BEFORE_ADAPTED :: EVERY])


@dataclass(frozen=True, slots=True)
class _Gaussian:
    centre: FloatArray
    root: FloatArray
    precision: FloatArray

    @classmethod
    def of(cls, centre: FloatArray, covariance: FloatArray) -> _Gaussian:
        wider = 0.5 * WIDER**2 * (covariance + covariance.T)
        return cls(
            centre, np.asarray(np.linalg.cholesky(wider), dtype=np.float64), np.asarray(np.linalg.inv(wider), dtype=np.float64)
        )


def _advanced(
    cost: Callable[[FloatArray], float], about: _Gaussian, start: FloatArray, steps: int, rng: np.random.Generator
) -> FloatArray:
    """Return the chains (c, steps, 22) from start states (c, 22), computed in parallel, each with its own generator."""
    generators = rng.spawn(start.shape[0])

    def log_ratio(vector: FloatArray) -> float:
        """Return the log density of the posterior over that of the Gaussian."""
        away = vector - about.centre
        return -0.5 * (cost(vector) - float(away @ about.precision @ away))

    def chain(number: int) -> FloatArray:
        vector, out = start[number], np.empty((steps, start.shape[1]))
        height = log_ratio(vector)
        for step in range(steps):
            vector, height = _slice(log_ratio, about, vector, height, generators[number])
            out[step] = vector
        return out

    return np.stack(parallel_map(chain, range(start.shape[0])))


def _slice(
    log_ratio: Callable[[FloatArray], float], about: _Gaussian, vector: FloatArray, height: float, rng: np.random.Generator
) -> tuple[FloatArray, float]:
    """Return the next state, on the ellipse through `vector` and a draw of the Gaussian, and `log_ratio` there."""
    away, other = vector - about.centre, about.root @ rng.standard_normal(vector.size)
    least = height + math.log(1.0 - rng.uniform())
    angle = rng.uniform(0.0, 2.0 * math.pi)
    low, high = angle - 2.0 * math.pi, angle
    while high - low > NARROWEST_RAD:
        new = about.centre + away * math.cos(angle) + other * math.sin(angle)
        found = log_ratio(new)
        if found > least:
            return new, found
        low, high = (angle, high) if angle < 0.0 else (low, angle)
        angle = rng.uniform(low, high)
    return vector, height


def effective_draws(values: FloatArray) -> float:
    """Return the effective number of independent draws in values (c, s) of c chains; zero where there is a NaN.

    It takes the variance between the chains into account (Gelman and others 2013, section 11.5).
    """
    chains, steps = values.shape
    within = float(np.mean(np.var(values, axis=1, ddof=1)))
    variance = (steps - 1) / steps * within + float(np.var(values.mean(axis=1), ddof=1))
    if not variance > 0.0:
        return 0.0
    total = 0.0
    for lag in range(1, steps - 1, 2):
        pair = sum(1.0 - float(np.mean((values[:, t:] - values[:, :-t]) ** 2)) / (2.0 * variance) for t in (lag, lag + 1))
        if pair < 0.0:
            break
        total += pair
    return float(chains * steps / (1.0 + 2.0 * total))


def settled_turns(posterior: Posterior, entry: float, fin: float) -> tuple[FloatArray, FloatArray]:
    """Return path speed m/s and rate rad/s (n,) of each draw's steady circle with the rudder at `fin` rad, NaN without one.

    `entry` (m/s) is the speed of the straight run before the turn.
    """
    surge, sway, rate = np.array([settle(coefficients(vector), entry, fin) for vector in posterior.vectors]).T
    return np.hypot(surge, sway), rate


def weighted_quantile(values: FloatArray, weights: FloatArray, share: float) -> float:
    """Return the quantile of the finite values (n,) with positive weights (n,); NaN where there are none."""
    ok = np.isfinite(values) & (weights > 0.0)
    if not ok.any():
        return float("nan")
    order = np.argsort(values[ok])
    reached = np.cumsum(weights[ok][order])
    middle = (reached - 0.5 * weights[ok][order]) / reached[-1]
    return float(np.interp(share, middle, values[ok][order]))
