"""The restricted likelihood of a noise: that of its definition, and smooth where sensitivities nearly say the same."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.fitting.covariance.reml import LinearisedRun, restricted_likelihood
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise
from fieldsid.models.record import record_of
from fieldsid.noise.innovations import innovations
from fieldsid.noise.whiten import noise_vector

COUNT, SAMPLES = 7, 300
NOISE = noise_vector(Noise(0.004, 0.006, 0.01, 1.3, 0.003, 0.005, 0.8))
NEARLY = 1e-6
"""How little of a sensitivity the others do not say."""


def lines_of(places):
    """Return linearised runs of random residuals with sensitivities to the parameters of each that nearly say the same."""
    rng = np.random.default_rng(7)
    time = 0.1 * np.arange(SAMPLES)
    common = np.cumsum(rng.standard_normal((2, SAMPLES)), axis=1)
    made = []
    for place in places:
        log = {
            "yaw_rad": rng.standard_normal(SAMPLES),
            "yaw_rate_rad_s": rng.standard_normal(SAMPLES),
            "rudder_rad": np.sin(time),
        }
        record = record_of(Run("run", time, log), Axis.YAW)
        own = rng.standard_normal((len(place), 2, SAMPLES))
        stack = np.concatenate([0.01 * rng.standard_normal((1, 2, SAMPLES)), common + NEARLY * own])
        made.append(LinearisedRun(record, 0.7, 0.0, stack, np.array(place)))
    return made


def by_definition(lines, noise):
    """Return -1/2 (log|S| + r' P r + log|J' S^-1 J|) of whitened columns, by their singular values."""
    rows, logs = [], 0.0
    for line in lines:
        white = np.empty_like(line.stack)
        logs += innovations(line.record.nominal_steps, line.record.ok, line.damping, line.stiffness, noise, line.stack, white)
        block = np.zeros((white[0].size, 1 + COUNT))
        block[:, np.concatenate([[0], 1 + line.place])] = white.reshape(white.shape[0], -1).T
        rows.append(block)
    whole = np.concatenate(rows)
    told = whole[:, 1:][:, np.any(whole[:, 1:] != 0.0, axis=0)]
    turned, sizes, _ = np.linalg.svd(told, full_matrices=False)
    left = whole[:, 0] - turned @ (turned.T @ whole[:, 0])
    return -0.5 * (logs + left @ left + 2.0 * np.log(sizes).sum())


@pytest.mark.parametrize(
    "places",
    [
        pytest.param([[0, 1, 2, 3, 4, 5, 6]], id="one run"),
        pytest.param([[0, 1, 2, 3], [0, 1, 4, 5, 6]], id="two runs with starts of their own"),
        pytest.param([[0, 1, 2], [0, 1, 3], [1, 4, 5]], id="three runs, one parameter told by two, one by none"),
    ],
)
def test_it_is_that_of_its_definition(places):
    lines = lines_of(places)
    found = restricted_likelihood(lines, COUNT)
    for noise in (NOISE, noise_vector(Noise(0.01, 0.02)), noise_vector(Noise(0.004, 0.006, 0.0, 1.0, 0.01, 0.02, 5.0))):
        assert found(noise) == pytest.approx(by_definition(lines, noise), abs=1e-4)


def test_a_parameter_that_nothing_tells_of_is_left_out():
    one, two = lines_of([[0, 1, 2]]), lines_of([[0, 1, 2]])
    silent = np.concatenate([two[0].stack, np.zeros((1, 2, SAMPLES)), two[0].stack[1:2]])
    two = [LinearisedRun(two[0].record, 0.7, 0.0, silent, np.arange(5))]
    assert restricted_likelihood(two, 5)(NOISE) == pytest.approx(restricted_likelihood(one, 3)(NOISE), abs=1e-6)


def test_it_has_slopes():
    """Its third differences over steps of a ten-thousandth are of rounding, not of the digits that products lose."""
    likelihood = restricted_likelihood(lines_of([[0, 1, 2, 3], [0, 1, 4, 5, 6]]), COUNT)
    for place in range(NOISE.size):
        line = []
        for step in np.arange(8) * 1e-4:
            there = NOISE.copy()
            there[place] *= np.exp(step)
            line.append(likelihood(there))
        assert np.abs(np.diff(line, 3)).max() < 2e-5


@pytest.mark.parametrize("beyond", [np.inf, np.nan, 1e300])
@pytest.mark.parametrize("row", [0, 1, 3])
def test_it_is_made_of_a_motion_without_bound_as_well(row, beyond):
    """What has no bound is refused by the search for the noise, in words."""
    lines = lines_of([[0, 1, 2, 3], [0, 1, 4, 5, 6]])
    lines[0].stack[row, 1, 200:] = beyond
    assert restricted_likelihood(lines, COUNT).count <= COUNT
