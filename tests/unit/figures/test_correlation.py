"""What a fit leaves: white residuals stay in the band, what the fin explains shows at the lag it has."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.collections import LineCollection

from fieldsid.figures import canvas
from fieldsid.figures.correlation import draw_autocorrelation, draw_with_fin

RNG = np.random.default_rng(4)
STEP = 0.05


def axes():
    return canvas.sheet().add_subplot()


def lines(ax):
    (found,) = (c for c in ax.collections if isinstance(c, LineCollection))
    return np.array([s[1] for s in found.get_segments()])


def test_white_residuals_stay_in_the_band_as_often_as_it_says():
    assert np.mean([draw_autocorrelation(RNG.standard_normal(2000), STEP, axes()) for _ in range(20)]) == pytest.approx(
        0.01, abs=0.008
    )


def test_coloured_residuals_leave_it():
    assert draw_autocorrelation(np.convolve(RNG.standard_normal(2000), np.ones(20)), STEP, axes()) > 0.15


def test_what_the_fin_explains_stands_at_its_lag():
    fin = np.repeat(RNG.choice([-1.0, 1.0], 100), 20)
    ax = axes()
    draw_with_fin(np.roll(fin, 10) + RNG.standard_normal(2000), fin, STEP, ax)
    peak = lines(ax)[np.argmax(lines(ax)[:, 1])]
    assert peak[0] == pytest.approx(10 * STEP)
    assert peak[1] > 0.6
