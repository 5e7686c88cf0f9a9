"""Block means, the held lag and the white noise against what they are by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from fieldsid.numerics.block_means import block_means, block_width
from fieldsid.numerics.first_order_lag import held_first_order_lag
from fieldsid.numerics.white_noise import robust_white_noise_std, white_noise_std

RNG = np.random.default_rng(24)


def test_an_incomplete_last_block_is_left_out():
    np.testing.assert_array_equal(block_means(np.arange(8.0), 3), [1.0, 4.0])
    assert block_means(np.arange(2.0), 3).size == 0


def test_a_block_has_at_least_one_sample():
    assert block_width(np.full(20, 0.1), 0.25) == 2
    assert block_width(np.full(20, 1.0), 0.25) == 1


def test_a_held_lag_is_a_first_order_filter():
    values, keep = RNG.standard_normal(200), 0.9
    expected = lfilter([1.0 - keep], [1.0, -keep], values, zi=[keep * 0.7])[0]
    got = held_first_order_lag(values, np.full(200, keep), 0.7)
    assert got[0] == 0.7
    np.testing.assert_allclose(got[1:], expected, rtol=1e-12)


def test_jumps_leave_the_robust_noise_alone():
    noise = 0.01 * RNG.standard_normal(6000)
    assert white_noise_std(noise, np.ones(6000, dtype=bool)) == pytest.approx(0.01, rel=0.05)
    for order in (1, 2):
        assert robust_white_noise_std(np.diff(noise, order), order) == pytest.approx(0.01, rel=0.05)
    jumpy = noise + np.cumsum(RNG.random(6000) < 0.05)
    assert robust_white_noise_std(np.diff(jumpy, 1), 1) == pytest.approx(0.01, rel=0.1)
    assert white_noise_std(jumpy, np.ones(6000, dtype=bool)) > 0.05
