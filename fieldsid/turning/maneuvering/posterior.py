"""Draws from the posterior of the maneuvering model by elliptical slices, and the turns that they settle to.

Chains start about the maximum and move on ellipses of a Gaussian that is fitted to the posterior (generalised elliptical slice
sampling: Nishihara, Murray and Adams 2014): no step is rejected, and none is tuned. What is left of the first part of the
chains moves the Gaussian to where they went. The posterior bends: weights of draws from a Gaussian or a Student's t about the
maximum were worth 1 to 26 of 400. Draws without a settled turn are rejected for that turn and counted.
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
"""Steps of a chain, each of about five simulations of all runs, and of which of them the turns are worked out."""
BEFORE_ADAPTED, LEFT_OUT = 14, 16
"""Steps before the Gaussian is moved, and those of them and after them that are left out."""
START_SHARE = 0.5
"""Chains start within this share of the Gaussian's spread: the posterior bends away from all of it."""
WIDER = 1.2
"""The Gaussian's spread over the posterior's: narrower tails than the posterior's would hold a chain."""
NARROWEST_RAD = 1e-6
"""Of an ellipse: below it a step stays where it is."""


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
    first = _moved(fitted.cost_at, about, now, BEFORE_ADAPTED, rng)
    went = first[:, BEFORE_ADAPTED // 2 :].reshape(-1, about.centre.size)
    # few draws tell 22 by 22 numbers badly: half of the spread stays that of the maximum
    about = _Gaussian.of(went.mean(axis=0), np.asarray(0.5 * (fitted.covariance + np.cov(went.T)), dtype=np.float64))
    later = _moved(fitted.cost_at, about, first[:, -1], STEPS - BEFORE_ADAPTED, rng)
    return Posterior(later[:, LEFT_OUT - BEFORE_ADAPTED :: EVERY])


@dataclass(frozen=True, slots=True)
class _Gaussian:
    centre: FloatArray
    root: FloatArray
    precision: FloatArray

    @classmethod
    def of(cls, centre: FloatArray, covariance: FloatArray) -> _Gaussian:
        whole = 0.5 * WIDER**2 * (covariance + covariance.T)
        return cls(
            centre, np.asarray(np.linalg.cholesky(whole), dtype=np.float64), np.asarray(np.linalg.inv(whole), dtype=np.float64)
        )


def _moved(
    cost: Callable[[FloatArray], float], about: _Gaussian, start: FloatArray, steps: int, rng: np.random.Generator
) -> FloatArray:
    """Return the chains (c, steps, 22) that go on from states (c, 22), each by draws of its own: they are shared out."""
    own = rng.spawn(start.shape[0])

    def rest(vector: FloatArray) -> float:
        away = vector - about.centre
        return -0.5 * (cost(vector) - float(away @ about.precision @ away))

    def chain(number: int) -> FloatArray:
        vector, out = start[number], np.empty((steps, start.shape[1]))
        height = rest(vector)
        for step in range(steps):
            vector, height = _slice(rest, about, vector, height, own[number])
            out[step] = vector
        return out

    return np.stack(parallel_map(chain, range(start.shape[0])))


def _slice(
    rest: Callable[[FloatArray], float], about: _Gaussian, vector: FloatArray, height: float, rng: np.random.Generator
) -> tuple[FloatArray, float]:
    """Return the next state, on an ellipse through this one and a draw of the Gaussian, and what `rest` gives there."""
    away, other = vector - about.centre, about.root @ rng.standard_normal(vector.size)
    least = height + math.log(1.0 - rng.uniform())
    angle = rng.uniform(0.0, 2.0 * math.pi)
    low, high = angle - 2.0 * math.pi, angle
    while high - low > NARROWEST_RAD:
        new = about.centre + away * math.cos(angle) + other * math.sin(angle)
        found = rest(new)
        if found > least:
            return new, found
        low, high = (angle, high) if angle < 0.0 else (low, angle)
        angle = rng.uniform(low, high)
    return vector, height


def effective_draws(values: FloatArray) -> float:
    """Return how many independent draws the values (c, s) of c chains are worth; nil where they hold a NaN.

    The variance between the chains counts (Gelman and others 2013, section 11.5): chains that stay apart are worth few.
    """
    chains, steps = values.shape
    within = float(np.mean(np.var(values, axis=1, ddof=1)))
    whole = (steps - 1) / steps * within + float(np.var(values.mean(axis=1), ddof=1))
    if not whole > 0.0:
        return 0.0
    total = 0.0
    for lag in range(1, steps - 1, 2):
        pair = sum(1.0 - float(np.mean((values[:, t:] - values[:, :-t]) ** 2)) / (2.0 * whole) for t in (lag, lag + 1))
        if pair < 0.0:
            break
        total += pair
    return float(chains * steps / (1.0 + 2.0 * total))


def settled_turns(posterior: Posterior, entry: float, fin: float) -> tuple[FloatArray, FloatArray]:
    """Return path speed m/s and rate rad/s (n,) of the circles that a straight run at `entry` m/s settles to, NaN where none.

    The rudder is at `fin` rad.
    """
    surge, sway, rate = np.array([settle(coefficients(vector), entry, fin) for vector in posterior.vectors]).T
    return np.hypot(surge, sway), rate


def weighted_quantile(values: FloatArray, weights: FloatArray, share: float) -> float:
    """Return the quantile of weighted values (n,), NaN among them left out; NaN where none is left."""
    ok = np.isfinite(values) & (weights > 0.0)
    if not ok.any():
        return float("nan")
    order = np.argsort(values[ok])
    reached = np.cumsum(weights[ok][order])
    middle = (reached - 0.5 * weights[ok][order]) / reached[-1]
    return float(np.interp(share, middle, values[ok][order]))
