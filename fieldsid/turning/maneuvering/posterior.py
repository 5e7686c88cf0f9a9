"""Draws from the posterior of the maneuvering model by importance sampling, twice adapted, and the turns that they settle to.

Proposals are Student's t about the maximum (population Monte Carlo: Cappe and others 2004); the weight of a draw is its
posterior over the density it was proposed with. Draws without a settled turn are rejected for that turn and counted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldsid.numerics.arrays import FloatArray
from fieldsid.turning.maneuvering.equations import HEIGHTS, STATIONS, coefficients, settle
from fieldsid.turning.maneuvering.fit import Fitted

DEGREES = 7.0
BISECTIONS = 30
LEAST_SHARE = 0.1
"""Share of the last proposal's spread that stays, so that no direction is lost to few draws."""
KEPT = 160
ROUNDS = (150, 250, 400)
"""Draws of each adaptation, the last of which are kept."""
LEAST_EFFECTIVE = 66.0
"""Three draws for every coefficient: weights are flattened until they are worth as many."""


@dataclass(frozen=True, slots=True)
class Posterior:
    """Vectors (n, 22) with weights (n,) that sum to one."""

    vectors: FloatArray
    weights: FloatArray


def draw_posterior(fitted: Fitted, rng: np.random.Generator) -> Posterior:
    """Return draws of the coefficients from the posterior of a fit."""
    centre, spread = fitted.vector, fitted.covariance
    vectors, weights = centre[None, :], np.ones(1)
    for count in ROUNDS:
        root = np.linalg.cholesky(0.5 * (spread + spread.T))
        size = centre.size
        scale = np.sqrt(DEGREES / rng.chisquare(DEGREES, count))
        z = rng.standard_normal((count, size)) * scale[:, None]
        vectors = centre + z @ root.T
        log_proposal = -0.5 * (DEGREES + size) * np.log1p(np.sum(z**2, axis=1) / DEGREES)
        log_weight = np.array([-0.5 * (fitted.cost_at(v) - fitted.cost) for v in vectors]) - log_proposal
        weights = _flattened(log_weight)
        centre = weights @ vectors
        away = vectors - centre
        spread = (away * weights[:, None]).T @ away + LEAST_SHARE * spread
    return _resampled(vectors, weights, rng)


def _resampled(vectors: FloatArray, weights: FloatArray, rng: np.random.Generator) -> Posterior:
    """Return draws of equal weight, taken systematically (Kitagawa 1996): a turn is worked out for each of them."""
    places = (np.arange(KEPT) + rng.uniform()) / KEPT
    chosen = np.searchsorted(np.cumsum(weights), places).clip(max=weights.size - 1)
    return Posterior(vectors[chosen], np.full(KEPT, 1.0 / KEPT))


def _flattened(log_weight: FloatArray) -> FloatArray:
    """Return weights (n,), raised to the largest power not above one at which they are worth enough draws (Ionides 2008)."""
    low, high = 0.0, 1.0
    power = 1.0
    for _ in range(BISECTIONS):
        weights = np.exp(power * (log_weight - log_weight.max()))
        weights /= weights.sum()
        if 1.0 / float(np.sum(weights**2)) >= LEAST_EFFECTIVE:
            low = power
        else:
            high = power
        if low == 1.0:
            break
        power = 0.5 * (low + high)
    weights = np.exp(low * (log_weight - log_weight.max()))
    return np.asarray(weights / weights.sum())


@dataclass(frozen=True, slots=True)
class SettledTurns:
    """Turns of all draws at entry speeds: radius m, rate rad/s, surge m/s, path speed m/s, (n, s); NaN where none settles."""

    radius: FloatArray
    rate: FloatArray
    surge: FloatArray
    path_speed: FloatArray


def settled_turns(posterior: Posterior, entry: FloatArray, fin: float) -> SettledTurns:
    """Return the circles that straight runs at entry speeds (s,) m/s settle to with the rudder at `fin` rad."""
    states = np.array(
        [[settle(p, float(u), fin, STATIONS, HEIGHTS) for u in entry] for p in map(coefficients, posterior.vectors)]
    )
    surge, sway, rate = states[..., 0], states[..., 1], states[..., 2]
    path = np.hypot(surge, sway)
    return SettledTurns(path / np.abs(rate), rate, surge, path)


def weighted_quantile(values: FloatArray, weights: FloatArray, share: float) -> float:
    """Return the quantile of weighted values (n,), NaN among them left out; NaN where none is left."""
    ok = np.isfinite(values) & (weights > 0.0)
    if not ok.any():
        return float("nan")
    order = np.argsort(values[ok])
    reached = np.cumsum(weights[ok][order])
    middle = (reached - 0.5 * weights[ok][order]) / reached[-1]
    return float(np.interp(share, middle, values[ok][order]))
