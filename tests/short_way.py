"""The short way through a fit without effects against the general core: one comparison for every law of the trim."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.fitting.optimise.levenberg_marquardt import normal_equations
from fieldsid.fitting.optimise.linear_white import linear_white


def compare_with_the_general_core(problem, x, noise, *, gradient_near):
    """Compare cost, normal matrix and gradient at x, the gradient to the share gradient_near of its largest entry."""
    free = tuple(range(x.size))
    short = linear_white(problem, noise, free)
    assert short is not None
    cost, normal, gradient = short.linear(x)
    expected = normal_equations(problem, x, noise, free)
    assert cost == pytest.approx(expected[0], rel=1e-10)
    np.testing.assert_allclose(normal, expected[1], rtol=1e-9, atol=1e-9 * np.abs(expected[1]).max())
    np.testing.assert_allclose(gradient, expected[2], rtol=1e-7, atol=gradient_near * np.abs(expected[2]).max())
