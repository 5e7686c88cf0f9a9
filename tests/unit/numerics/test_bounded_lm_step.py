"""The bounded step against the optimum of its own quadratic, by brute force over what is held at a bound."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from in_time import in_time

from fieldsid.errors import DivergenceError
from fieldsid.numerics.bounded_lm_step import bounded_step


@pytest.mark.parametrize("seed", range(20))
def test_a_step_within_wide_bounds_is_newtons(seed):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((6, 4))
    normal, gradient = root.T @ root, rng.standard_normal(4)
    step = bounded_step(normal, gradient, 0.0, np.zeros(4), np.full(4, -1e6), np.full(4, 1e6))
    np.testing.assert_allclose(step, np.linalg.solve(normal, gradient), rtol=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_a_step_that_meets_bounds_stays_inside_and_gains_nearly_what_the_best_one_does(seed):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((6, 3))
    normal, gradient = root.T @ root, 4.0 * rng.standard_normal(3)
    low, high = np.full(3, -0.5), np.full(3, 0.5)
    step = bounded_step(normal, gradient, 0.0, np.zeros(3), low, high)

    def gain(s: np.ndarray) -> float:
        return float(2 * gradient @ s - s @ normal @ s)

    best = 0.0
    for held in product((None, -0.5, 0.5), repeat=3):
        free = np.array([h is None for h in held])
        s = np.array([0.0 if h is None else h for h in held])
        if free.any():
            s[free] = np.linalg.solve(normal[np.ix_(free, free)], gradient[free] - normal[np.ix_(free, ~free)] @ s[~free])
        if (s >= low - 1e-12).all() and (s <= high + 1e-12).all():
            best = max(best, gain(s))
    assert (step >= low - 1e-12).all()
    assert (step <= high + 1e-12).all()
    assert gain(step) > 0.7 * best


def test_what_is_at_its_bound_and_would_leave_it_stays():
    step = bounded_step(np.eye(2), np.array([1.0, 1.0]), 0.0, np.array([2.0, 0.0]), np.zeros(2), np.full(2, 2.0))
    np.testing.assert_allclose(step, [0.0, 1.0])


@pytest.mark.parametrize(("where", "value"), [("normal", np.nan), ("gradient", np.nan), ("gradient", np.inf), ("x", np.nan)])
def test_a_number_that_is_none_ends_with_an_error_and_not_never(where, value):
    given = {"normal": np.eye(3), "gradient": np.ones(3), "x": np.zeros(3)}
    given[where].flat[-1] = value
    with in_time(5), pytest.raises(DivergenceError, match="no number") as error:
        bounded_step(given["normal"], given["gradient"], 1e-3, given["x"], np.full(3, -1.0), np.full(3, 1.0))
    assert error.value.found
    assert "sysid inspect" in error.value.hint
