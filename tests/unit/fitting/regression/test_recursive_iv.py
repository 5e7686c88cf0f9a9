"""Recursive instrumental variables: the sums after every row against the update as it is written, and against the block."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks.rls_speed import plain_update

from fieldsid.fitting.regression.instruments import instrumental_variables
from fieldsid.fitting.regression.recursive_iv import recursive_iv


def rows(count=60, size=3, seed=5):
    """Instruments (n, p), columns (n, p) that they are a part of, and target (n,)."""
    rng = np.random.default_rng(seed)
    z = rng.standard_normal((count, size))
    phi = z + 0.3 * rng.standard_normal((count, size))
    return z, phi, phi @ np.arange(1.0, size + 1.0) + 0.1 * rng.standard_normal(count)


@pytest.mark.parametrize("beta", [1.0, 0.97])
def test_it_is_the_update_as_it_is_written(beta):
    z, phi, q = rows()
    theta, big = np.zeros(3), 1e9 * np.eye(3)
    for i in range(60):
        theta, big = plain_update(theta, big, z[i], phi[i], q[i], beta)
    values, _, inverse = recursive_iv(z, np.column_stack([phi, q]), beta, np.arange(60))
    np.testing.assert_allclose(values[-1], theta, rtol=1e-6)
    np.testing.assert_allclose(inverse, big, rtol=1e-5, atol=1e-9)


def test_without_forgetting_it_ends_at_the_block_and_is_nan_before_the_rows_determine_it():
    z, phi, q = rows()
    z[:20, 1] = 0.0
    values, errors, inverse = recursive_iv(z, np.column_stack([phi, q]), 1.0, np.arange(60))
    block, transposed = instrumental_variables(z, phi, q)
    np.testing.assert_allclose(values[-1], block, rtol=1e-9)
    np.testing.assert_allclose(inverse, transposed.T, rtol=1e-9)
    assert np.isnan(values[:20]).all()
    assert np.isnan(errors[:20]).all()
    assert np.isfinite(values[20:]).all()


def test_errors_are_the_scatter_under_white_noise_of_variance_one():
    z, phi, _ = rows()
    rng, found, errors = np.random.default_rng(6), [], np.zeros(3)
    for _ in range(400):
        q = phi @ [1.0, 2.0, 3.0] + rng.standard_normal(60)
        values, told, _ = recursive_iv(z, np.column_stack([phi, q]), 0.97, np.array([30, 59]))
        found.append(values[-1])
        errors = told[-1]
    np.testing.assert_allclose(errors, np.std(found, axis=0), rtol=0.15)
