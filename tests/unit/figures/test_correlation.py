"""What a fit leaves: white residuals stay in the band, what the fin explains shows at the lag it has."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.figures.correlation import autocorrelation, correlation_with_fin

RNG = np.random.default_rng(4)
STEP = 0.05


def test_white_residuals_stay_in_the_band_as_often_as_it_says():
    assert np.mean([autocorrelation(RNG.standard_normal(2000), STEP)[1] for _ in range(20)]) == pytest.approx(0.01, abs=0.008)


def test_coloured_residuals_leave_it():
    assert autocorrelation(np.convolve(RNG.standard_normal(2000), np.ones(20)), STEP)[1] > 0.15


def test_what_the_fin_explains_stands_at_its_lag():
    fin = np.repeat(RNG.choice([-1.0, 1.0], 100), 20)
    panel = correlation_with_fin(np.roll(fin, 10) + RNG.standard_normal(2000), fin, STEP)
    (stems,) = (s for s in panel.series if s.form == "stems")
    peak = np.argmax(stems.y)
    assert stems.x[peak] == pytest.approx(10 * STEP)
    assert stems.y[peak] > 0.6
