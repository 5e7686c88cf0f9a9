"""Theil, R^2 and whiteness by cases worked by hand, and by the properties they must have."""

from __future__ import annotations

from math import isnan, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fieldsid.comparison.metrics import r_squared, theil, whiteness_p

SERIES = arrays(np.float64, 30, elements=st.floats(-100, 100, width=32))


def test_a_case_worked_by_hand():
    y, s = np.array([1.0, 2.0, 3.0]), np.array([1.0, 2.0, 5.0])
    assert theil(y, s) == pytest.approx(sqrt(4 / 3) / (sqrt(14 / 3) + sqrt(30 / 3)))
    assert r_squared(y, s) == pytest.approx(1 - 4 / 2)


def test_a_perfect_simulation_is_zero_and_one():
    y = np.sin(np.arange(30.0))
    assert theil(y, y) == 0.0
    assert r_squared(y, y) == 1.0


@given(SERIES, SERIES)
def test_theil_lies_between_zero_and_one_and_r_squared_is_at_most_one(y, s):
    assert 0.0 <= theil(y, s) <= 1.0 + 1e-12
    assert isnan(r_squared(y, s)) or r_squared(y, s) <= 1.0


def test_a_constant_measurement_has_no_r_squared():
    assert isnan(r_squared(np.ones(5), np.zeros(5)))


def test_white_residuals_pass_and_coloured_ones_do_not():
    rng = np.random.default_rng(4)
    white = rng.normal(size=800)
    coloured = np.convolve(white, np.ones(8) / 8, mode="same")
    assert whiteness_p(white) > 0.01
    assert whiteness_p(coloured) < 1e-6
    assert isnan(whiteness_p(white[:50]))
