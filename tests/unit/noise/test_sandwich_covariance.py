"""The covariance under coloured residuals is one at any conditioning: no variance below zero, no correlation beyond one."""

from __future__ import annotations

import numpy as np
import pytest
from truth import maneuvers
from truth.logbook import flown
from truth.noise import Clock
from truth.paper import DEG, YAW, physics_of

from fieldsid.fitting.fit import Fit, fit
from fieldsid.fitting.optimise.levenberg_marquardt import covariance, sandwich
from fieldsid.fitting.regression.instruments import instrumental_variables
from fieldsid.fitting.regression.noise_transfer import Transfer
from fieldsid.fitting.regression.residual_colour_covariance import Series, coloured_covariance
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of

CLOCK = Clock(0.05, 660)


def _sensitivities(spread: float, count: int = 400) -> np.ndarray:
    """Three columns (n, 3) of unlike size, the last two of which differ by a share of `spread`."""
    rng = np.random.default_rng(7)
    a, b, noise = rng.standard_normal((3, count)).cumsum(axis=1)
    return np.column_stack([1e3 * a, b, 1e-3 * (b + spread * noise)])


def _coloured(count: int = 400) -> np.ndarray:
    """Return the covariance (n, n) of an AR(1) noise."""
    return 0.9 ** np.abs(np.subtract.outer(np.arange(count), np.arange(count)))


@pytest.mark.parametrize("spread", [1.0, 1e-2])
def test_where_all_is_told_it_is_the_textbooks_product(spread):
    j = _sensitivities(spread)
    normal, centre = j.T @ j, j.T @ _coloured() @ j
    inverse = np.linalg.inv(normal)
    assert sandwich(normal, centre) == pytest.approx(inverse @ centre @ inverse, rel=1e-6)
    assert sandwich(normal, normal) == pytest.approx(covariance(normal), rel=1e-6)


@pytest.mark.parametrize("spread", [1e-6, 1e-7, 1e-8, 1e-9, 0.0])
def test_where_two_columns_are_one_it_is_still_a_covariance(spread):
    j = _sensitivities(spread)
    found = sandwich(j.T @ j, j.T @ _coloured() @ j)
    sigma = np.sqrt(np.diag(found))
    assert np.all(np.diag(found) > 0.0)
    assert np.max(np.abs(found / np.outer(sigma, sigma))) < 1.0 + 1e-9
    assert sigma[1] > 1e3 * np.sqrt(covariance((j.T @ j)[:2, :2])[1, 1])


def test_what_nothing_shows_at_all_is_not_known_by_chance():
    normal = np.diag([4.0, 0.0])
    found = sandwich(normal, np.diag([8.0, 0.0]))
    assert found[0, 0] == pytest.approx(0.5)
    assert found[1, 1] > 1e12


def _constant_thrust(**numbers: float) -> Fit:
    """Fit a propeller's moment to pulses at one thrust, where it is the trim's twin, with the fin's lag left out."""
    plan = maneuvers.pulses(CLOCK.time, 0.26, 0.15, start=2.0, recovery=9.0)
    physics = physics_of(YAW[1])._replace(**numbers)
    log = dict(flown(physics, CLOCK, plan, angle_noise=0.3 * DEG, rate_noise=0.3 * DEG, seed=3))
    time = log.pop("time_s")
    record = record_of(Run("pulses", time, {**log, "thrust": np.full(time.size, 12.0)}), Axis.YAW)
    return fit([record], Axis.YAW, method="output_error", effects=["prop_moment"])


@pytest.mark.parametrize("lag", [0.1, 0.2, 0.3])
def test_no_correlation_of_a_fit_is_beyond_one(lag):
    found = _constant_thrust(servo_tau=lag)
    assert np.all(np.diag(found.model.covariance) > 0.0)
    assert np.max(np.abs(found.correlation)) < 1.0 + 1e-9
    said = [n for n in found.notes if n.code == "correlated"]
    assert [n.data["parameters"] for n in said if abs(n.data["correlation"]) > 0.99] == [["C0", "prop_moment"]]


@pytest.mark.parametrize("spread", [1e-5, 8e-6, 6.3e-6])
def test_least_squares_of_filtered_signals_has_a_covariance_too(spread):
    j = _sensitivities(spread)
    residual = np.random.default_rng(2).standard_normal(j.shape[0]).cumsum()
    plain = Transfer(np.ones(1), np.ones(1))
    _, inverse = instrumental_variables(j, j, residual)
    found = coloured_covariance([Series(j, residual, plain, 0.05)], inverse)
    sigma = np.sqrt(np.diag(found))
    assert np.all(sigma > 0.0)
    assert np.max(np.abs(found / np.outer(sigma, sigma))) < 1.0 + 1e-9


@pytest.mark.parametrize("normal", [np.zeros((2, 2)), np.diag([1e-80, 1e-90])])
def test_without_any_information_an_error_is_a_number_beyond_all_bounds(normal):
    with np.errstate(all="raise", under="ignore"):
        spread = covariance(normal)
    assert np.isfinite(spread).all()
    assert (np.sqrt(np.diag(spread)) > 1e30).all()
