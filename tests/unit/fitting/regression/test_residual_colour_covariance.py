"""Covariance under coloured residuals, against Monte Carlo and against what white noise must give."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from fieldsid.fitting.regression.noise_transfer import Transfer, inverse_of, transfer_of
from fieldsid.fitting.regression.residual_colour_covariance import Series, colour_of, coloured_covariance
from fieldsid.fitting.regression.state_variable_filter import filtered
from fieldsid.fitting.regression.svf_equation import RegressionParameters

PASS = Transfer(np.ones(1), np.ones(1))


def ar1(rng, n, rho):
    return lfilter([1.0], [1.0, -rho], rng.standard_normal(n + 500))[500:]


def test_white_noise_is_found_white_and_an_autoregression_for_what_it_is():
    rng = np.random.default_rng(1)
    assert colour_of([rng.standard_normal(4000)]).denominator.size <= 2
    found = colour_of([ar1(rng, 8000, 0.9), ar1(rng, 8000, 0.9)])
    assert found.denominator[1] == pytest.approx(-0.9, abs=0.03)
    assert found.input_variance == pytest.approx(1.0, rel=0.05)
    assert found.long_run == pytest.approx(19.0, rel=0.25)
    assert colour_of([np.zeros(100)]).long_run == 1.0


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_the_stated_error_is_the_scatter_over_many_records(rho):
    rng, n = np.random.default_rng(7), 800
    columns = np.column_stack([np.ones(n), np.sin(np.arange(n) * 0.02)])
    inverse = np.linalg.inv(columns.T @ columns)
    found, stated = [], []
    for _ in range(150):
        y = ar1(rng, n, rho)
        theta = inverse @ columns.T @ y
        found.append(theta)
        stated.append(np.diag(coloured_covariance([Series(columns, y - columns @ theta, PASS, 0.05)], inverse)))
    np.testing.assert_allclose(np.mean(stated, axis=0), np.var(found, axis=0), rtol=0.25)


@pytest.mark.parametrize("order", [1, 2])
def test_the_transfer_is_what_the_filter_does_to_noise_of_the_samples(order):
    rng, lam, h, theta = np.random.default_rng(3), 4.0, 0.05, RegressionParameters(1.3, 0.4, 0.0, 0.0)
    noise = np.r_[0.0, rng.standard_normal(300)]
    x = filtered(np.full(300, h), noise[:-1], noise[1:], lam)
    residual = lam * (noise - lam * x[:, 0]) + theta.damping * lam * x[:, 0]
    if order == 2:
        bend = noise - 2.0 * lam * x[:, 0] + lam**2 * x[:, 1]
        residual = lam**2 * (bend + theta.damping * (x[:, 0] - lam * x[:, 1]) + theta.stiffness * x[:, 1])
    transfer = transfer_of(order, lam, h, theta)
    np.testing.assert_allclose(lfilter(transfer.numerator, transfer.denominator, noise), residual, atol=1e-11)
    back = inverse_of(transfer, h)
    np.testing.assert_allclose(lfilter(back.numerator, back.denominator, residual), noise, atol=1e-8)


def test_an_inverse_of_an_unstable_transfer_is_stable():
    back = inverse_of(transfer_of(2, 4.0, 0.05, RegressionParameters(-0.5, 0.0, 0.0, 0.0)), 0.05)
    assert np.abs(np.roots(back.denominator)).max() < 1.0
