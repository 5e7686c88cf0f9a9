"""The grid points of a nuisance, one for each run: those of the least total cost that any choice of them has."""

from __future__ import annotations

from itertools import product

import numpy as np

from fieldsid.fitting.initial.joint_grid_search import joint_grid_search

RUNS, POINTS, SAMPLES = 3, 6, 80
NO_BOUND = np.array([np.inf, np.inf])


def products(seed):
    """Products (R, G, 8, 8) of runs at three speeds, in each of which a moment and an authority change once, or nothing does.

    Of the residual, the change of authority, that of the moment, and what the model had: an authority for each speed, damping and
    trim for all.
    """
    rng = np.random.default_rng(seed)
    time, events = np.arange(SAMPLES), np.linspace(0.0, SAMPLES, POINTS).astype(int)
    loss, moment = rng.uniform(-0.2, 0.2), rng.uniform(-1.0, 1.0)
    square = np.empty((RUNS, POINTS, 8, 8))
    for run in range(RUNS):
        fin = np.cumsum(np.repeat(rng.choice([-1.0, 0.0, 1.0], SAMPLES // 8), 8)) * 0.1
        fade = np.exp(-time / 15.0)
        own = np.zeros((3, SAMPLES))
        own[run] = fin
        late = [np.cumsum(time >= e) * np.stack([fin, np.ones(SAMPLES)]) * 0.05 for e in events]
        at = rng.integers(POINTS)
        residual = loss * late[at][0] + moment * late[at][1] + 0.02 * rng.standard_normal(SAMPLES)
        residual += rng.normal(0.0, 0.5) * fin + 0.3 * fade + 0.2
        for point in range(POINTS):
            rows = np.concatenate([residual[None], late[point], own, fade[None], np.ones((1, SAMPLES))])
            square[run, point] = rows @ rows.T
    return square


def cost(square, chosen):
    """Total cost of a choice of points, by a plain least-squares step."""
    total = sum(square[run, point] for run, point in enumerate(chosen))
    step = np.linalg.lstsq(total[1:, 1:], total[1:, 0], rcond=1e-10)[0]
    row = np.concatenate([[1.0], -step])
    return row @ total @ row


def test_no_other_choice_costs_less():
    for seed in range(60):
        square = products(seed)
        found = cost(square, joint_grid_search(square, -NO_BOUND, NO_BOUND))
        least = min(cost(square, chosen) for chosen in product(range(POINTS), repeat=RUNS))
        assert found <= least * (1.0 + 1e-6) + 1e-9, seed
