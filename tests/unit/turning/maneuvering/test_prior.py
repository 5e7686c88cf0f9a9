"""The prior of the maneuvering coefficients: its slope and curvature, its scale, and how far a vehicle may be from it."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.turning.maneuvering.equations import NAMES
from fieldsid.turning.maneuvering.prior import FARTHEST_COST, FREEDOM, prior
from fieldsid.turning.maneuvering.prior_table import CORRELATION, STANDARD_DEVIATION

COUNT = len(NAMES)


def drawn(seed, count):
    """Draws of the prior, (count, 22)."""
    believed = prior(None)
    z = np.random.default_rng(seed).standard_t(FREEDOM, (count, COUNT))
    return believed.mean + z @ np.linalg.inv(believed.axes).T


def test_its_quadratic_form_has_its_slope_and_lies_above_it():
    believed, (at, *others) = prior(1.6), drawn(3, 20)
    precision, step = believed.precision(at), 1e-6
    slope = [(believed.cost(at + step * e) - believed.cost(at - step * e)) / (2.0 * step) for e in np.eye(COUNT)]
    np.testing.assert_allclose(2.0 * precision @ (at - believed.mean), slope, rtol=1e-5, atol=1e-6)
    quadratic = [float((v - believed.mean) @ precision @ (v - believed.mean)) for v in (at, *others)]
    for vector, above in zip(others, quadratic[1:], strict=True):
        assert believed.cost(vector) - believed.cost(at) <= above - quadratic[0] + 1e-9


def test_its_spread_about_the_mean_is_that_of_the_ensemble():
    believed, ensemble = prior(2.0), slice(1, 1 + len(STANDARD_DEVIATION))
    covariance = np.linalg.inv(believed.axes.T @ believed.axes)[ensemble, ensemble]
    spread = np.sqrt(np.diag(covariance))
    free = [i for i, name in enumerate(NAMES[ensemble]) if name != "stall"]
    np.testing.assert_allclose(spread[free], np.array(STANDARD_DEVIATION)[free], rtol=1e-9)
    np.testing.assert_allclose(covariance / np.outer(spread, spread), CORRELATION, atol=1e-9)


def test_one_odd_coefficient_costs_less_than_the_same_distance_in_all():
    believed = prior(2.0)
    out = np.linalg.inv(believed.axes)
    one, all_of_them = out @ (8.0 * np.eye(COUNT)[3]), out @ np.full(COUNT, 8.0 / np.sqrt(COUNT))
    assert believed.cost(believed.mean + one) < 0.5 * believed.cost(believed.mean + all_of_them)


def test_one_vehicle_of_a_thousand_is_farther_than_the_limit():
    believed = prior(None)
    farther = np.mean([believed.cost(v) > FARTHEST_COST for v in drawn(7, 40_000)])
    assert farther == pytest.approx(1e-3, abs=6e-4)
