"""The state variable filter against closed forms and against its own plain version."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from fieldsid.fitting.regression.state_variable_filter import filtered, hold_weights

RNG = np.random.default_rng(2)
STEPS = RNG.uniform(0.005, 0.2, 80)
TIME = np.concatenate([[0.0], np.cumsum(STEPS)])


def filtered_plain(steps, start, end, bandwidth, bow):
    """The same as `filtered` by the matrix exponential of filter and input together: slow, and shares no formula."""
    system = np.zeros((5, 5))
    system[:2, :2] = [[-bandwidth, 0.0], [1.0, -bandwidth]]
    system[0, 2] = system[2, 3] = system[3, 4] = 1.0
    out = np.zeros((steps.size + 1, 2))
    for i, h in enumerate(steps):
        slope = (end[i] - start[i]) / h - 0.5 * bow[i] * h
        full = np.array([out[i, 0], out[i, 1], start[i], slope, bow[i]])
        out[i + 1] = (expm(system * h) @ full)[:2]
    return out


@pytest.mark.parametrize("bandwidth", [0.5, 4.0, 30.0])
def test_the_compiled_filter_agrees_with_matrix_exponentials_on_uneven_steps(bandwidth):
    start, end, bow = RNG.standard_normal((3, STEPS.size))
    np.testing.assert_allclose(
        filtered(STEPS, start, end, bandwidth, bow), filtered_plain(STEPS, start, end, bandwidth, bow), atol=1e-11
    )


def test_a_held_one_becomes_the_step_response():
    one, lam = np.ones(STEPS.size), 3.0
    out = filtered(STEPS, one, one, lam)
    fade = np.exp(-lam * TIME)
    np.testing.assert_allclose(out[:, 0], (1.0 - fade) / lam, atol=1e-14)
    np.testing.assert_allclose(out[:, 1], (1.0 - fade * (1.0 + lam * TIME)) / lam**2, atol=1e-14)


def test_a_parabola_is_filtered_exactly_when_its_curvature_is_told():
    lam, value = 2.0, 0.5 * TIME**2
    exact = TIME**2 / (2 * lam) - TIME / lam**2 + (1.0 - np.exp(-lam * TIME)) / lam**3
    told = filtered(STEPS, value[:-1], value[1:], lam, np.ones(STEPS.size))[:, 0]
    straight = filtered(STEPS, value[:-1], value[1:], lam)[:, 0]
    np.testing.assert_allclose(told, exact, atol=1e-12)
    assert np.abs(straight - exact).max() > 1e-4


def test_the_weights_are_the_moments_of_the_fading_exponential():
    lam, h = 4.0, 0.05
    s = (np.arange(200000) + 0.5) / 200000 * h
    _, *moments = hold_weights(lam, h)
    np.testing.assert_allclose(moments, [np.mean(s**j * np.exp(-lam * s)) * h for j in range(4)], rtol=1e-9)
