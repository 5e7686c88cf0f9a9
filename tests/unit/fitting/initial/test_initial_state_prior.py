"""The prior of a run's start against a least-squares line and how such lines scatter."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.fitting.initial.initial_state_prior import FEWEST_SAMPLES, line_start


def test_it_is_where_the_least_squares_line_begins_and_as_far_off_as_such_lines_are():
    time, rng = np.array([0.0, 0.1, 0.25, 0.3, 0.55, 0.8, 0.9]), np.random.default_rng(1)
    starts = []
    for _ in range(4000):
        values = 1.0 - 2.0 * time + 0.1 * rng.standard_normal(time.size)
        start, std_error = line_start(time, values, 0.1)
        starts.append(start)
        assert start == pytest.approx(np.polyfit(time, values, 1)[1], abs=1e-12)
    # where the line leaves less than the sensor's noise, that is what it is off by
    _, std_error = line_start(time, 1.0 - 2.0 * time, 0.1)
    assert std_error == pytest.approx(np.std(starts), rel=0.04)
    assert np.mean(starts) == pytest.approx(1.0, abs=0.01)


def test_a_few_samples_tell_of_no_start():
    few = np.linspace(0.0, 1.0, FEWEST_SAMPLES - 1)
    assert line_start(few, few, 0.1) is None
