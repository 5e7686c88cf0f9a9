"""The closed forms of the cross flow's force and moment against sums over the hull, the kernel's own, and their balance."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.dynamics import nonlinear_kernel as kernel
from fieldsid.models.helpers.strip_theory import settled_cross_state, strip_force, strip_moment

DRIFT, RATE = (a.ravel() for a in np.meshgrid([-0.7, -0.2, -0.05, 0.0, 0.1, 0.15, 0.8], [-0.6, -0.3, 0.0, 0.2, 0.5]))


def test_they_are_the_sums_over_the_hull():
    xi = (np.arange(20000) + 0.5) / 20000 - 0.5
    flow = DRIFT[:, None] + xi * RATE[:, None]
    np.testing.assert_allclose(strip_moment(DRIFT, RATE), 32.0 * np.mean(flow * np.abs(flow) * xi, axis=1), atol=1e-7)
    np.testing.assert_allclose(strip_force(DRIFT, RATE)[0], np.mean(flow * np.abs(flow), axis=1), atol=1e-7)
    np.testing.assert_allclose(strip_force(DRIFT, RATE)[1], np.mean(2.0 * np.abs(flow), axis=1), atol=1e-7)


def test_the_kernel_has_the_same_numbers_and_their_derivatives():
    step = 1e-6
    for a, p in zip(DRIFT.tolist(), RATE.tolist(), strict=True):
        assert kernel.crossflow(a, p)[0] == pytest.approx(float(strip_moment(np.array(a), np.array(p))), abs=1e-15)
        assert kernel.crossforce(a, p)[0] == pytest.approx(float(strip_force(np.array(a), np.array(p))[0]), abs=1e-15)
        for ours in (kernel.crossflow, kernel.crossforce):
            assert ours(a, p)[1] == pytest.approx((ours(a + step, p)[0] - ours(a - step, p)[0]) / (2 * step), abs=2e-5)
            assert ours(a, p)[2] == pytest.approx((ours(a, p + step)[0] - ours(a, p - step)[0]) / (2 * step), abs=2e-5)


def test_the_settled_state_balances_its_equation():
    push, one = 0.3 * np.linspace(-1.0, 1.0, RATE.size), np.ones(RATE.size)
    x = settled_cross_state(push, RATE, 0.2 * one, 0.5 * one, 4.0 * one, 0.9 * one)
    held = 0.2 * x + 0.5 * x * np.abs(x) + 4.0 * strip_force(0.9 * x, RATE)[0]
    np.testing.assert_allclose(held, push, atol=1e-12)
