"""Tails and quantiles against the distributions of SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from fieldsid.numerics.tail_probabilities import chi_square_tail, f_tail, pearson3_tail, student_quantile, student_tail

PLACES = np.array([-3.0, -0.5, 0.0, 0.3, 2.0, 6.0])


@pytest.mark.parametrize("freedom", [1, 3, 40])
def test_tails_are_those_of_the_distributions(freedom):
    for x in np.abs(PLACES):
        assert chi_square_tail(x, freedom) == pytest.approx(stats.chi2.sf(x, freedom), rel=1e-10)
        assert f_tail(x, 4, freedom) == pytest.approx(stats.f.sf(x, 4, freedom), rel=1e-10)
        assert student_tail(x, freedom) == pytest.approx(stats.t.sf(x, freedom), rel=1e-10)


@pytest.mark.parametrize("skewness", [-1.5, -0.2, -1e-6, 0.0, 1e-6, 0.3, 2.5])
def test_a_skew_tail_is_that_of_pearsons_third_kind(skewness):
    for x in PLACES:
        assert pearson3_tail(x, skewness) == pytest.approx(stats.pearson3.sf(x, skewness), rel=1e-4, abs=1e-12)


def test_a_quantile_without_scatter_is_the_normal_one():
    assert student_quantile(0.975, 7) == pytest.approx(stats.t.ppf(0.975, 7))
    assert student_quantile(0.975, 0) == pytest.approx(stats.norm.ppf(0.975))
