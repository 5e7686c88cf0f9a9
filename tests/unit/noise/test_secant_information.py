"""An information matrix that follows what the score has done: by its equation, and on a likelihood that bends less than said."""

from __future__ import annotations

import numpy as np

from fieldsid.noise.secant_information import with_secants

EXPECTED = np.array([[4.0, 1.0], [1.0, 3.0]])
STEP = np.array([0.1, -0.2])


def test_the_last_secant_is_met_and_the_matrix_stays_symmetric_and_positive():
    fall = 0.3 * EXPECTED @ STEP + np.array([0.01, -0.02])
    found = with_secants(EXPECTED, [(np.array([0.2, 0.1]), np.array([0.3, 0.2])), (STEP, fall)])
    assert np.allclose(found @ STEP, fall)
    assert np.allclose(found, found.T)
    assert np.linalg.eigvalsh(found).min() > 0.0


def test_a_secant_that_says_nothing_new_or_nothing_of_the_end_of_its_step_is_left_out():
    as_expected, rising, long = (STEP, EXPECTED @ STEP), (STEP, -STEP), (10.0 * STEP, STEP)
    for secant in (as_expected, rising, long):
        assert with_secants(EXPECTED, [secant]) is EXPECTED


def test_scoring_by_it_climbs_in_a_few_steps_where_the_curvature_is_a_tenth_of_what_is_expected():
    curvature, x, secants = 0.1 * EXPECTED, np.array([0.4, 0.3]), []
    while np.abs(x).max() > 1e-6 and len(secants) < 20:
        score = -curvature @ x
        step = np.linalg.solve(with_secants(EXPECTED, secants[-2:]), score)
        secants.append((step, curvature @ step))
        x = x + step
    assert len(secants) <= 6
