"""Moments that runs have of their own: their size comes back, and none is found where there is none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm, toeplitz

from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.noise.moment_response import base_responses
from fieldsid.noise.own_moment import disturbance_mean_std, estimate_noise_of_runs, likeliest_std, moment_information
from fieldsid.noise.white_floor import WhiteBounds
from fieldsid.numerics.jit import plain_of

A, K = 1.1, 0.2
WHITE = Noise(0.005, 0.005)
OWN = 4e-4


def a_record(seconds: float = 50.0, step: float = 0.1, *, name: str = "run") -> Record:
    time = np.arange(0.0, seconds, step)
    zero, ok = np.zeros(time.size), np.ones(time.size, dtype=bool)
    return Record(name, Axis.PITCH, time, zero, True, False, zero, zero, ok, ok, zero, ~ok, {}, 1.0)


def moved(records: list[Record], moments: np.ndarray, rng: np.random.Generator, noise: Noise = WHITE) -> list[np.ndarray]:
    """Residuals of runs with moments of their own, a wrong start each, white sensors and an AR(1) moment."""
    found = []
    for record, moment in zip(records, moments, strict=True):
        responses = base_responses(record.nominal_steps, A, K)
        e = np.tensordot([moment, *(rng.standard_normal(2) * 1e-3)], responses, axes=1)
        w, share = noise.disturbance * rng.standard_normal(), np.exp(-record.steps[0] / noise.disturbance_time)
        state = np.zeros(2)
        system = expm(np.array([[0, 1, 0], [-K, -A, 1], [0, 0, 0]]) * record.steps[0])
        for i in range(len(record)):
            e[:, i] += state
            state = (system @ [*state, w])[:2]
            w = share * w + noise.disturbance * np.sqrt(1.0 - share**2) * rng.standard_normal()
        found.append(e + rng.standard_normal(e.shape) * [[noise.angle], [noise.rate]])
    return found


def test_the_responses_are_those_of_the_exponential_at_uneven_steps():
    steps = np.random.default_rng(1).uniform(0.02, 0.3, 60)
    system = np.array([[0, 1, 0], [-K, -A, 1], [0, 0, 0]])
    starts = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    expected = np.array([[(expm(system * t) @ s)[:2] for t in np.concatenate([[0.0], np.cumsum(steps)])] for s in starts])
    np.testing.assert_allclose(base_responses(steps, A, K), expected.transpose(0, 2, 1), rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(base_responses(steps, A, K), plain_of(base_responses)(steps, A, K), rtol=1e-12)


def test_a_run_tells_of_its_moment_what_least_squares_with_a_free_start_does():
    log, rng = a_record(), np.random.default_rng(2)
    (residual,) = moved([log], np.array([OWN]), rng)
    (told,) = moment_information([log], [(A, K)], [residual], WHITE)
    columns = base_responses(log.nominal_steps, A, K).reshape(3, -1).T / WHITE.angle
    solved = np.linalg.lstsq(columns, residual.ravel() / WHITE.angle, rcond=None)[0]
    assert told.information == pytest.approx(1.0 / np.linalg.inv(columns.T @ columns)[0, 0], rel=1e-9)
    assert told.pull / told.information == pytest.approx(solved[0], rel=1e-9)
    assert told.most_probable(1e3) == pytest.approx(solved[0], rel=1e-6)
    assert told.most_probable(0.0) == 0.0


@pytest.mark.parametrize("seed", range(4))
def test_the_size_of_many_runs_moments_comes_back(seed):
    rng = np.random.default_rng(seed)
    records = [a_record() for _ in range(60)]
    residuals = moved(records, OWN * rng.standard_normal(60), rng)
    found = likeliest_std(moment_information(records, [(A, K)] * 60, residuals, WHITE), 0.01)
    # the standard deviation of 60 numbers is known to 9 %
    assert found == pytest.approx(OWN, rel=0.3)
    assert likeliest_std(moment_information(records, [(A, K)] * 60, residuals, WHITE), OWN / 3) == pytest.approx(OWN / 3)


def test_no_moments_are_found_where_there_are_none_but_by_chance():
    rng, records, found = np.random.default_rng(5), [a_record() for _ in range(3)], 0
    for _ in range(200):
        residuals = moved(records, np.zeros(3), rng)
        found += likeliest_std(moment_information(records, [(A, K)] * 3, residuals, WHITE), 0.01) > 0.0
    # half a unit of log likelihood: twice that is exceeded by half a chi-square of one degree in 16 %
    assert found < 0.25 * 200


def test_one_run_does_not_tell_its_moment_from_the_trim():
    log, rng = a_record(), np.random.default_rng(3)
    told = moment_information([log], [(A, K)], moved([log], np.array([10 * OWN]), rng), WHITE)
    assert likeliest_std(told, 0.01) == 0.0
    assert likeliest_std([*told, *told], 0.0) == 0.0


def test_disturbance_and_own_moments_are_told_apart():
    rng, truth = np.random.default_rng(6), Noise(0.003, 0.003, 4e-4, 1.0)
    records = [a_record(100.0) for _ in range(20)]
    residuals = moved(records, 3 * OWN * rng.standard_normal(20), rng, truth)
    white, start = WhiteBounds.near(Noise(0.003, 0.003)), Noise(0.003, 0.003, 1e-3)
    noise, likelihood = estimate_noise_of_runs(records, [(A, K)] * 20, residuals, "disturbance", start, white, 0.01)
    assert noise.own_moment == pytest.approx(3 * OWN, rel=0.5)
    assert noise.disturbance == pytest.approx(4e-4, rel=0.4)
    plain, lower = estimate_noise_of_runs(records, [(A, K)] * 20, residuals, "disturbance", start, white, 0.0)
    assert plain.own_moment == 0.0
    assert likelihood > lower + 10.0


def test_a_motion_without_bound_has_no_noise():
    log = a_record()
    residual = np.full((2, len(log)), np.inf)
    start = Noise(0.003, 0.003, own_moment=OWN)
    white = WhiteBounds.near(start)
    found = estimate_noise_of_runs([log, log], [(A, K)] * 2, [residual] * 2, "disturbance", start, white, 0.01)
    assert found == (start, -np.inf)


@pytest.mark.parametrize("time", [0.5, 5.0, 30.0])
def test_the_mean_of_a_disturbance_has_the_variance_of_its_covariance(time):
    at = np.linspace(0.0, 40.0, 2001)
    covariance = 0.02**2 * toeplitz(np.exp(-at / time))
    weight = np.full(at.size, 1.0)
    weight[[0, -1]] = 0.5
    weight /= weight.sum()
    assert disturbance_mean_std(Noise(1.0, 1.0, 0.02, time), 40.0) == pytest.approx(
        np.sqrt(weight @ covariance @ weight), rel=1e-3
    )
