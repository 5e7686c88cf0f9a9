"""Draws of the posterior: those of a known density whatever they are proposed from, and what dependent ones are worth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from fieldsid.runtime.worker_pool import IS_WORKER
from fieldsid.turning.maneuvering.posterior import draw_posterior, effective_draws

SIZE = 22


@dataclass(frozen=True)
class Known:
    """A density of known spread about nil, and a covariance that somebody believes it to have."""

    spread: np.ndarray
    covariance: np.ndarray

    @property
    def vector(self):
        return np.zeros(SIZE)

    def cost_at(self, vector):
        return float(np.sum((vector / self.spread) ** 2))


def test_draws_have_the_spread_of_the_posterior_and_not_that_of_the_proposal():
    spread = np.linspace(0.5, 2.0, SIZE)
    wrong = spread * np.where(np.arange(SIZE) % 2, 0.7, 1.4)
    vectors = draw_posterior(Known(spread, np.diag(wrong**2)), np.random.default_rng(4)).vectors / spread
    assert np.sqrt(np.mean(vectors**2)) == pytest.approx(1.0, abs=0.12)
    odd, even = np.sqrt(np.mean(vectors[:, 1::2] ** 2)), np.sqrt(np.mean(vectors[:, ::2] ** 2))
    assert even / odd == pytest.approx(1.0, abs=0.3)  # the proposals' are 2.0


@pytest.mark.forks
def test_draws_do_not_depend_on_how_many_processes_share_the_chains(monkeypatch):
    known = Known(np.ones(SIZE), np.eye(SIZE))
    shared = draw_posterior(known, np.random.default_rng(4)).chains
    monkeypatch.setenv(IS_WORKER, "1")
    alone = draw_posterior(known, np.random.default_rng(4)).chains
    assert np.array_equal(shared, alone)
    assert not np.array_equal(alone[0], alone[1])


def test_independent_draws_are_worth_themselves_and_slow_ones_fewer():
    rng = np.random.default_rng(2)
    fast = rng.standard_normal((8, 60))
    assert effective_draws(fast) == pytest.approx(fast.size, rel=0.35)
    assert effective_draws(np.cumsum(fast, axis=1)) < 40.0


def test_chains_that_stay_apart_are_worth_little():
    apart = np.random.default_rng(2).standard_normal((8, 60)) + 10.0 * np.arange(8)[:, None]
    assert effective_draws(apart) < 16.0


def test_chains_that_never_moved_are_worth_nothing():
    assert effective_draws(np.ones((8, 30))) == 0.0
