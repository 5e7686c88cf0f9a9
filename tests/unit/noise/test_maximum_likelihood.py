"""The white floor from differences, noise families by restricted likelihood, and the correction for short records."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from truth.noise import ar1
from truth.paper import YAW, paper_run

from fieldsid.fitting.covariance.kenward_roger import kenward_roger, noise_covariance, with_log_steps
from fieldsid.fitting.covariance.reml import linearise_runs, restricted_likelihood, select_noise
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise
from fieldsid.models.record import record_of
from fieldsid.noise.maximum_likelihood import estimate_noise, log_likelihood, log_prior
from fieldsid.noise.moment_response import base_responses
from fieldsid.noise.noise_kinds import NOISE_FIELDS, NOISE_KINDS
from fieldsid.noise.white_floor import WhiteBounds, lowered_noise_floor, white_noise_floor
from fieldsid.noise.whiten import base_dynamics, noise_vector
from fieldsid.numerics.white_noise import white_noise_std

SIGMA = 0.005
TRUTH = np.array([YAW[1].a22, YAW[1].b2, YAW[1].C0])


@pytest.mark.parametrize("size", [660, 200_000])
def test_the_floor_of_a_smooth_signal_is_its_white_noise(size):
    rng, t = np.random.default_rng(1), np.arange(size) * 0.05
    values = 0.3 * np.sin(0.4 * t) + 0.002 * t + SIGMA * rng.standard_normal(size)
    assert white_noise_std(values, np.ones(size, dtype=bool)) == pytest.approx(SIGMA, rel=0.1)


def test_kinks_and_gaps_do_not_count_as_noise():
    rng, t = np.random.default_rng(2), np.arange(660) * 0.05
    ok = np.ones(660, dtype=bool)
    ok[200:240] = False
    values = np.where(ok, 0.2 * np.abs((t % 8.0) - 4.0) + SIGMA * rng.standard_normal(660), 0.0)
    assert white_noise_std(values, ok) == pytest.approx(SIGMA, rel=0.15)


def test_too_few_samples_in_a_row_give_no_floor():
    assert np.isnan(white_noise_std(np.zeros(15), np.ones(15, dtype=bool)))


def test_the_floor_behind_a_fast_vehicles_motion_is_its_sensors_noise():
    """At 10 Hz a hull of a third of a second shows its motion in the differences; what a rough model leaves does not."""
    rng, n, small = np.random.default_rng(3), 600, 1e-3
    clock, fin = np.arange(n) * 0.1, np.repeat(rng.choice([-0.2, 0.2], n // 6), 6)
    rate, angle = np.zeros(n), np.zeros(n)
    for i in range(n - 1):
        to, gone = 2.0 * fin[i], -np.expm1(-0.3)
        rate[i + 1] = rate[i] + (to - rate[i]) * gone
        angle[i + 1] = angle[i] + 0.1 * to + (rate[i] - to) * gone / 3.0
    noisy = (v + small * rng.standard_normal(n) for v in (angle, rate))
    log = dict(zip(("yaw_rad", "yaw_rate_rad_s"), noisy, strict=True)) | {"rudder_rad": fin}
    record = record_of(Run("fast", clock, log), Axis.YAW)
    heard = white_noise_floor([record])
    assert heard.rate > 3.0 * small
    rough = [np.stack([record.angle - 0.98 * angle, record.rate - 0.98 * rate])]
    below = lowered_noise_floor(heard, [record], rough)
    assert (below.angle, below.rate) == (pytest.approx(small, rel=0.15), pytest.approx(small, rel=0.15))
    louder = [np.stack([record.angle, record.rate]) + rng.standard_normal((2, n))]
    assert lowered_noise_floor(heard, [record], louder) == heard


def problem(coloured=0.0, gust=0.0, seed=3):
    log = paper_run(YAW[1], angle_noise=SIGMA / 4, rate_noise=SIGMA / 4, seed=seed)
    rng = np.random.default_rng(seed)
    for name in ("yaw_rad", "yaw_rate_rad_s"):
        log[name] = log[name] + ar1(rng, 660, coloured, 0.5, 0.05)
    if gust:  # its motion, added to the open-loop answer
        w, p, y = ar1(rng, 660, gust, 1.0, 0.05), np.zeros(660), np.zeros(660)
        for i in range(659):
            p[i + 1] = p[i] * np.exp(-0.05 * TRUTH[0]) + w[i] * (1 - np.exp(-0.05 * TRUTH[0])) / TRUTH[0]
            y[i + 1] = y[i] + 0.025 * (p[i] + p[i + 1])
        log["yaw_rad"], log["yaw_rate_rad_s"] = log["yaw_rad"] + y, log["yaw_rate_rad_s"] + p
    record = record_of(Run("paper", log.pop("time_s"), log), Axis.YAW)
    return Problem((record,), layout_of([record], Axis.YAW, ())), np.concatenate([TRUTH, [0.0, 0.0]])


@pytest.mark.parametrize(
    ("numbers", "family"), [({"coloured": SIGMA}, "coloured"), ({"gust": 0.03}, "disturbance"), ({}, "white")]
)
def test_the_family_of_the_noise_is_found(numbers, family):
    found, noise, _ = select_noise(*problem(**numbers), Noise(SIGMA, SIGMA))
    assert found == family
    if family == "coloured":
        assert noise.coloured_angle == pytest.approx(SIGMA, rel=0.4)
        assert noise.coloured_time == pytest.approx(0.5, rel=0.6)
    if family == "disturbance":
        assert noise.disturbance == pytest.approx(0.03, rel=0.4)


def test_restricted_likelihood_does_not_move_with_the_point_of_linearisation():
    known, x = problem(gust=0.03)
    off = x + np.array([0.002, 0.001, 1e-4, 0.01, 0.002])
    vector = noise_vector(Noise(SIGMA / 4, SIGMA / 4, 0.03, 1.0))
    one, two = (restricted_likelihood(linearise_runs(known, at), 5)(vector) for at in (x, off))
    assert one == pytest.approx(two, abs=0.2)


def test_the_search_gives_back_the_noise_that_was_put_in():
    rng = np.random.default_rng(8)
    known, _ = problem()
    residual = np.stack([SIGMA * rng.standard_normal(660), 2 * SIGMA * rng.standard_normal(660)])

    def likelihood(v):
        powers = residual[0] @ residual[0] / v[0] ** 2 + residual[1] @ residual[1] / v[1] ** 2
        return -660 * (np.log(v[0]) + np.log(v[1])) - 0.5 * float(powers)

    noise, _ = estimate_noise(known.records, [(1.0, 0.0)], [residual], "white", Noise(SIGMA, SIGMA), likelihood)
    assert noise.angle == pytest.approx(min(float(residual[0].std()), 2.2 * SIGMA / 4), rel=0.2)


STARTS = [
    Noise(SIGMA, SIGMA),
    Noise(SIGMA, SIGMA, 0.3, 10.0),
    Noise(SIGMA, SIGMA, 1e-5, 0.2),
    Noise(SIGMA, SIGMA, 0.02, 0.3, 0.02, 0.02, 5.0),
]


@pytest.mark.parametrize("family", ["disturbance", "both"])
def test_the_search_for_a_noise_ends_at_the_same_likelihood_wherever_it_begins(family):
    """Its numbers may be a ridge, or one of them on its way to nothing."""
    known, x = problem(gust=0.03)
    residual, dynamics = known.residual(x, 0)[0], [(TRUTH[0], 0.0)]
    found = [estimate_noise(known.records, dynamics, [residual], family, start)[1] for start in STARTS]
    assert max(found) - min(found) < 1.0


@pytest.mark.parametrize("gust", [0.0, 0.03])
def test_a_search_that_wakes_nothing_loses_none_of_the_likelihood_it_begins_with(gust):
    known, x = problem(gust=gust)
    residual, dynamics, calm = known.residual(x, 0)[0], [(TRUTH[0], 0.0)], Noise(SIGMA / 4, SIGMA / 4)
    found, likelihood = estimate_noise(known.records, dynamics, [residual], "both", calm)
    again, still = estimate_noise(known.records, dynamics, [residual], "both", found, reinitialise=False)
    assert likelihood - 1e-6 <= still < likelihood + 0.3
    assert again.disturbance == pytest.approx(found.disturbance, rel=0.2, abs=1e-4)


def test_a_prior_counts_with_the_likelihood_and_is_at_its_highest_where_the_search_ends():
    known, x = problem(gust=0.03)
    records, residual, dynamics = known.records, known.residual(x, 0)[0], [(TRUTH[0], 0.0)]
    found, value = estimate_noise(records, dynamics, [residual], "disturbance", STARTS[0], has_prior=True)

    def density(noise):
        return log_likelihood(records, dynamics, [residual], noise) + log_prior(noise)

    assert value == pytest.approx(density(found), abs=1e-9)
    for name in NOISE_KINDS["disturbance"].fields:
        for factor in (0.8, 1.25):
            assert density(replace(found, **{name: getattr(found, name) * factor})) < value


def test_what_drifts_through_a_whole_run_is_no_sea():
    known, x = problem()
    records, dynamics, time = known.records, [(TRUTH[0], 0.0)], known.records[0].time
    base = base_responses(records[0].nominal_steps, *base_dynamics(*dynamics[0]))[0]
    drift = known.residual(x, 0)[0] + 0.01 * base * time / time[-1]
    (plain, likelihood), (found, density) = (
        estimate_noise(records, dynamics, [drift], "disturbance", STARTS[0], has_prior=p) for p in (False, True)
    )
    assert found.disturbance_time < 0.8 * plain.disturbance_time
    assert density < likelihood - 1.0


def test_the_number_of_a_noise_that_its_kind_does_not_have_has_no_prior():
    assert log_prior(Noise(SIGMA, SIGMA)) == log_prior(Noise(SIGMA, SIGMA, coloured_angle=SIGMA, coloured_time=9.0)) == 0.0
    assert log_prior(Noise(SIGMA, SIGMA, 0.01, 2.0)) == pytest.approx(0.0)
    assert log_prior(Noise(SIGMA, SIGMA, 0.01, 8.0)) == pytest.approx(-2.0)  # two standard deviations


def test_the_spread_of_a_noise_number_is_that_of_a_sample_variance():
    """n white residuals know the log of their standard deviation to sqrt(1 / 2n)."""
    n, vector = 200, noise_vector(Noise(1.0, 1.0))
    spread = noise_covariance(lambda v: -n * (np.log(v[0]) + np.log(v[1])) - 0.5 * n * (v[0] ** -2 + v[1] ** -2), vector, "white")
    np.testing.assert_allclose(spread, np.eye(2) / (2 * n), rtol=0.02, atol=1e-5)


def test_a_variance_known_from_ten_samples_widens_the_interval_to_students():
    from scipy.stats import t as student

    n, vector = 10, noise_vector(Noise(1.0, 1.0))
    wide = kenward_roger(lambda v: (np.zeros(1), np.array([[v[0] ** 2]])), vector, "white", np.diag([0.5 / n, 0.0]))
    assert np.sqrt(wide[0, 0]) * 1.96 == pytest.approx(student.ppf(0.975, n), rel=0.01)


@pytest.mark.parametrize("family", NOISE_KINDS)
def test_moving_a_number_moves_that_one_alone(family):
    vector = np.arange(1.0, 8.0)
    for i, name in enumerate(NOISE_KINDS[family].fields):
        there = with_log_steps(vector, NOISE_KINDS[family].fields, ((i, np.log(2.0)),))
        at = NOISE_FIELDS.index(name)
        assert there[at] == pytest.approx(2 * vector[at])
        assert np.delete(there, at) == pytest.approx(np.delete(vector, at))


def test_white_noise_stays_above_an_error_below_which_no_model_follows():
    known, x = problem()
    residual, dynamics, error = known.residual(x, 0)[0], [(TRUTH[0], 0.0)], Noise(3 * SIGMA, 2 * SIGMA)
    start = Noise(SIGMA, SIGMA, 1e-3)
    found, _ = estimate_noise(known.records, dynamics, [residual], "disturbance", start, white=WhiteBounds.above(error))
    near, _ = estimate_noise(known.records, dynamics, [residual], "disturbance", start, white=WhiteBounds.near(error))
    assert (found.angle, found.rate) == (pytest.approx(error.angle), pytest.approx(error.rate))
    assert near.angle < 0.5 * error.angle
    assert near.rate < 0.9 * error.rate
