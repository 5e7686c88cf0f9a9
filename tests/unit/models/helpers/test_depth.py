"""The depth without its noise: what the pitch has made of it is known better than the sensor says."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.models.helpers.depth import depth_along
from fieldsid.numerics.gcv_smoother import gcv_smooth

STEP, N = 0.05, 1200
TIME = STEP * np.arange(N)
NOISE = 0.02


def dive(speed, lag=0.0):
    """A quick hull's pitch, surge and true depth; its heave follows the pitch rate by a lag."""
    rng = np.random.default_rng(3)
    pitch = sum(a * np.sin(w * TIME + rng.uniform(0.0, 6.0)) for a, w in ((0.12, 0.5), (0.10, 1.7), (0.08, 4.1), (0.05, 7.0)))
    surge = speed + 0.02 * speed * np.sin(0.3 * TIME)
    heave, rate, depth = np.zeros(N), np.gradient(pitch, STEP), np.zeros(N)
    for i in range(1, N):
        heave[i] = heave[i - 1] + STEP * (0.4 * speed * lag * rate[i - 1] - heave[i - 1] / max(lag, STEP)) * (lag > 0.0)
        depth[i] = depth[i - 1] + STEP * (-surge[i - 1] * np.sin(pitch[i - 1]) + heave[i - 1] * np.cos(pitch[i - 1]))
    return pitch, surge, 5.0 + depth


@pytest.mark.parametrize("lag", [0.0, 1.0])
@pytest.mark.parametrize("has_surge", [True, False])
def test_a_quick_hulls_depth_keeps_a_third_of_the_error_it_had(lag, has_surge):
    pitch, surge, depth = dive(3.5, lag)
    measured = depth + NOISE * np.random.default_rng(0).standard_normal(N)
    plain = gcv_smooth(TIME, measured, fastest_s=0.35)
    found = depth_along(TIME, measured, pitch, surge if has_surge else None, np.zeros(N), fastest_s=0.35)
    assert np.std(found - depth) < np.std(plain - depth) / 3.0
    assert np.std(found - depth) < 0.4 * NOISE


def test_a_depth_the_pitch_says_nothing_about_is_smoothed_as_it_is():
    measured = 5.0 + 0.3 * np.sin(0.2 * TIME) + NOISE * np.random.default_rng(0).standard_normal(N)
    pitch = 0.1 * np.random.default_rng(1).standard_normal(N)
    found = depth_along(TIME, measured, pitch, None, np.zeros(N), fastest_s=0.35)
    np.testing.assert_allclose(found, gcv_smooth(TIME, measured, fastest_s=0.35), atol=0.5 * NOISE)


def test_gaps_of_the_depth_are_filled_along_the_path():
    pitch, surge, depth = dive(3.5)
    measured = depth + NOISE * np.random.default_rng(0).standard_normal(N)
    measured[600:640] = np.nan
    found = depth_along(TIME, measured, pitch, surge, np.zeros(N), fastest_s=0.35)
    assert np.max(np.abs(found - depth)[600:640]) < 2.0 * NOISE
