"""Correlations at many shifts at once against the sum written out for each."""

import numpy as np
import pytest

from fieldsid.numerics.shifted_correlation import BLOCK_SAMPLES, lag_of, shifted_correlations


def written_out(a, b, k):
    a, b = a[max(k, 0) : a.size + min(k, 0)], b[max(-k, 0) : b.size - max(k, 0)]
    a, b = a - a.mean(), b - b.mean()
    return a @ b / np.sqrt((a @ a) * (b @ b))


@pytest.mark.parametrize(
    ("count", "reach"), [(50, 12), (1000, 20), (BLOCK_SAMPLES, 7), (BLOCK_SAMPLES + 1, 40), (3 * BLOCK_SAMPLES + 17, 100)]
)
def test_each_shift_is_the_correlation_of_what_both_have(count, reach):
    rng = np.random.default_rng(count)
    a = np.cumsum(rng.normal(size=count)) + 300.0
    b = 0.3 * np.roll(a, -5) + rng.normal(size=count)
    found = shifted_correlations(a, b, reach)
    expected = [written_out(a, b, k) for k in range(-reach, reach + 1)]
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_a_constant_has_no_correlation():
    assert shifted_correlations(np.ones(100), np.arange(100.0), 3).tolist() == [0.0] * 7


def test_a_delay_is_where_the_correlation_has_its_peak_and_none_where_it_still_rises():
    values = np.convolve(np.random.default_rng(5).standard_normal(500), np.hanning(15), "same")
    late, gain = lag_of(np.roll(values, 4), values, 20)
    assert late == pytest.approx(4.0, abs=0.05)
    assert gain > 0.1
    assert lag_of(np.roll(values, 4), values, 3) == (0.0, 0.0)
    assert lag_of(values, values, 0) == (0.0, 0.0)
