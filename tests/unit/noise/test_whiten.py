"""Whitening, its likelihood and the sandwich's middle against a dense covariance built from the noise's own definition."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.noise.fisher_scoring import information, innovations_of
from fieldsid.noise.kalman.transition import transition
from fieldsid.noise.kalman.univariate import kalman_filter
from fieldsid.noise.maximum_likelihood import log_likelihood
from fieldsid.noise.sandwich_covariance import score_covariance
from fieldsid.noise.whiten import noise_vector, whiten
from fieldsid.numerics.jit import plain_of

WHITE = Noise(0.005, 0.004)
NOISES = {
    "disturbance": Noise(0.005, 0.004, 0.05, 0.8),
    "coloured": Noise(0.005, 0.004, 0.0, 1.0, 0.006, 0.003, 0.5),
    "both": Noise(0.005, 0.004, 0.05, 0.8, 0.006, 0.003, 0.5),
}
WITH_OWN_MOMENT = {f"{family} and own moment": replace(n, own_moment=0.03) for family, n in (*NOISES.items(), ("white", WHITE))}
A, K = 1.2, 0.3


def record(*, gaps: bool) -> Record:
    rng = np.random.default_rng(3)
    time = np.cumsum(rng.uniform(0.04, 0.06, 40)) if gaps else np.arange(40) * 0.05
    ok = np.ones((2, 40), dtype=bool)
    if gaps:
        ok[0, 10:14], ok[1, 20:22] = False, False
    zero = np.zeros(40)
    return Record("short", Axis.YAW, time, zero, True, False, zero, zero, ok[0], ok[1], zero, ~ok[0], {}, 1.0)


def settled_record(*, gaps: bool = False) -> Record:
    """Long enough for the gains to settle, twice: the step changes on the way, and with gaps each channel is lost for a while."""
    time = np.cumsum(np.concatenate([np.full(250, 0.05), np.full(150, 0.08)]))
    zero, ok = np.zeros(400), np.ones((2, 400), dtype=bool)
    if gaps:
        ok[0, 150:153], ok[1, 330:331] = False, False
    return Record("long", Axis.YAW, time, zero, True, False, zero, zero, ok[0], ok[1], zero, ~ok[0], {}, 1.0)


def dense(log: Record, noise: Noise) -> np.ndarray:
    """Covariance (2n, 2n), angle first, of y' = p, p' = -A p - K y + w with everything zero at the start but w and n."""
    n, vector = len(log), noise_vector(noise)
    states = np.zeros((5, 5 * n + 5))
    states[2, 0], states[3, 1], states[4, 2] = vector[2], vector[4], vector[5]
    rows = []
    for i in range(n):
        rows.append(np.stack([states[0] + states[3], states[1] + states[4]]))
        if i == n - 1:
            break
        h = log.nominal_steps[i]
        f = np.zeros((5, 5))
        f[:3, :3] = expm(np.array([[0, 1, 0], [-K, -A, 1], [0, 0, 0]]) * h)
        f[2, 2], f[3, 3] = np.exp(-h / vector[3]), np.exp(-h / vector[6])
        f[4, 4] = f[3, 3]
        states = f @ states
        for j, (row, sigma) in enumerate(((2, vector[2]), (3, vector[4]), (4, vector[5]))):
            states[row, 5 + 5 * i + j] = sigma * np.sqrt(1.0 - f[row, row] ** 2)
    loading = np.concatenate([np.array([r[ch] for r in rows]) for ch in range(2)])
    own = noise.own_moment * pushed(log).ravel()
    return loading @ loading.T + np.diag(np.repeat(vector[:2] ** 2, n)) + np.outer(own, own)


def pushed(log: Record) -> np.ndarray:
    """Angle and rate (2, n) under a unit moment from rest, each sample by one exponential from the first."""
    system = np.array([[0, 1, 0], [-K, -A, 1], [0, 0, 0]])
    since = np.concatenate([[0.0], np.cumsum(log.nominal_steps)])
    return np.array([(expm(system * t) @ [0.0, 0.0, 1.0])[:2] for t in since]).T


def seen(log: Record) -> np.ndarray:
    return np.concatenate([log.angle_ok, log.rate_ok])


@pytest.mark.parametrize(
    "log",
    [record(gaps=False), record(gaps=True), settled_record(), settled_record(gaps=True)],
    ids=["even", "gaps", "settled", "settled with gaps"],
)
@pytest.mark.parametrize("family", WITH_OWN_MOMENT | NOISES)
def test_innovations_have_the_products_and_determinant_of_the_dense_covariance(family, log):
    rng = np.random.default_rng(1)
    series = np.where(seen(log).reshape(2, -1), rng.standard_normal((3, 2, len(log))), 0.0)
    noise = (WITH_OWN_MOMENT | NOISES)[family]
    white, logs = whiten(log, noise, A, K, series)
    keep = seen(log)
    cov = dense(log, noise)[np.ix_(keep, keep)]
    flat = series.reshape(3, -1)[:, keep]
    mine = white.reshape(3, -1) @ white.reshape(3, -1).T
    np.testing.assert_allclose(mine, flat @ np.linalg.solve(cov, flat.T), rtol=1e-5)
    assert logs == pytest.approx(np.linalg.slogdet(cov)[1], rel=1e-6)


@pytest.mark.parametrize("log", [record(gaps=True), settled_record(gaps=True)], ids=["gaps", "settled with gaps"])
@pytest.mark.parametrize("family", NOISES)
def test_the_spreads_add_up_to_the_determinant_and_are_one_where_nothing_was_measured(family, log):
    noise = noise_vector(NOISES[family])
    out, spread = np.empty((2, 2, len(log)))
    logs = kalman_filter(log.nominal_steps, log.ok, A, K, noise, np.ones((1, 2, len(log))), out[None], spread)
    assert (spread[~log.ok] == 1.0).all()
    assert (out[~log.ok] == 0.0).all()
    assert logs == pytest.approx(2.0 * float(np.log(spread).sum()), rel=1e-12)


@pytest.mark.parametrize("family", NOISES)
def test_a_compiled_filter_gives_the_numbers_of_its_python_source(family):
    log, noise = settled_record(gaps=True), noise_vector(NOISES[family])
    series = np.random.default_rng(8).standard_normal((2, 2, len(log)))
    found = []
    for kalman in (kalman_filter, plain_of(kalman_filter)):
        out, spread = np.empty_like(series), np.empty((2, len(log)))
        found.append((kalman(log.nominal_steps, log.ok, A, K, noise, series, out, spread), out, spread))
    for fast, slow in zip(*found, strict=True):
        np.testing.assert_allclose(fast, slow, rtol=1e-12, atol=1e-14)


def test_the_likelihood_is_that_of_the_dense_gaussian():
    log, noise = record(gaps=True), WITH_OWN_MOMENT["both and own moment"]
    keep = seen(log)
    cov = dense(log, noise)[np.ix_(keep, keep)]
    e = np.zeros(80)
    e[keep] = np.random.default_rng(2).multivariate_normal(np.zeros(cov.shape[0]), cov)
    expected = -0.5 * (np.linalg.slogdet(cov)[1] + e[keep] @ np.linalg.solve(cov, e[keep]))
    assert log_likelihood([log], [(A, K)], [e.reshape(2, -1)], noise) == pytest.approx(expected, rel=1e-6)


def moved(noise: np.ndarray, place: int, by: float) -> np.ndarray:
    return np.where(np.arange(7) == place, noise * np.exp(by), noise)


def informed(log: Record, noise: np.ndarray, place: np.ndarray, residual: np.ndarray):
    here = innovations_of(log, A, K, noise, residual)
    return here.likelihood, *information(log, A, K, noise, place, residual, here)


PLACES = {"disturbance": np.array([0, 1, 2, 3]), "coloured": np.array([0, 1, 4, 5, 6]), "both": np.arange(7)}


@pytest.mark.parametrize("log", [record(gaps=True), settled_record()], ids=["gaps", "settled"])
@pytest.mark.parametrize("family", NOISES)
def test_the_score_is_the_slope_of_the_likelihood(family, log):
    noise, step = noise_vector(NOISES[family]), 1e-4
    residual = np.where(seen(log), 0.01 * np.random.default_rng(4).standard_normal(2 * len(log)), 0.0).reshape(2, -1)
    total, score, fisher = informed(log, noise, PLACES[family], residual)

    def likelihood(v: np.ndarray) -> float:
        return log_likelihood([log], [(A, K)], [residual], Noise(*v.tolist()))

    assert total == pytest.approx(likelihood(noise), rel=1e-9)  # where both are noisy no gain is kept
    slopes = [(likelihood(moved(noise, p, step)) - likelihood(moved(noise, p, -step))) / (2 * step) for p in PLACES[family]]
    # forward differences are off by half a step of the information
    np.testing.assert_allclose(score, slopes, atol=5e-4 * float(np.diag(fisher).max()))


@pytest.mark.parametrize("family", NOISES)
def test_the_information_is_on_average_that_of_the_dense_covariance(family):
    """F = 1/2 tr(S^-1 dS S^-1 dS')."""
    log, noise, step, rng = record(gaps=True), noise_vector(NOISES[family]), 1e-4, np.random.default_rng(5)
    keep, place = seen(log), PLACES[family]
    block = np.ix_(keep, keep)
    cov = dense(log, NOISES[family])[block]
    slopes = [(dense(log, Noise(*moved(noise, p, step))) - dense(log, Noise(*moved(noise, p, -step))))[block] for p in place]
    share = [np.linalg.solve(cov, s / (2 * step)) for s in slopes]
    expected = np.array([[0.5 * np.sum(a * b.T) for b in share] for a in share])
    drawn = np.zeros((300, 80))
    drawn[:, keep] = rng.multivariate_normal(np.zeros(cov.shape[0]), cov, size=300)
    found = np.mean([informed(log, noise, place, e.reshape(2, -1))[2] for e in drawn], axis=0)
    np.testing.assert_allclose(found, expected, rtol=0.15, atol=0.05 * float(np.diag(expected).max()))


@pytest.mark.parametrize("family", NOISES)
def test_the_middle_of_the_sandwich_is_the_dense_one(family):
    log = record(gaps=True)
    weighted = np.where(seen(log).reshape(2, -1), np.random.default_rng(5).standard_normal((3, 2, 40)), 0.0)
    flat = weighted.reshape(3, -1)
    expected = flat @ dense(log, NOISES[family]) @ flat.T
    np.testing.assert_allclose(score_covariance(log, noise_vector(NOISES[family]), A, K, weighted), expected, rtol=1e-6)


@pytest.mark.parametrize(("a", "k", "h"), [(1.2, 0.3, 0.05), (8.0, 0.0, 0.5), (1e-3, 0.0, 2.0), (0.5, 20.0, 0.3)])
def test_the_transition_is_the_matrix_exponential(a, k, h):
    yy, yp, py, pp, wy, wp = transition(a, k, h)
    exact = expm(np.array([[0, 1, 0], [-k, -a, 1], [0, 0, 0]]) * h)
    np.testing.assert_allclose([[yy, yp, wy], [py, pp, wp]], exact[:2], atol=1e-7)
