"""The truth's excitations and noise are what they say."""

from __future__ import annotations

import numpy as np
import pytest
from truth import maneuvers, noise
from truth.kernel import HOLD, OPEN
from truth.noise import Clock
from truth.physics import Physics
from truth.simple import fly

CLOCK = Clock(0.05, 1200)
T = CLOCK.time


def test_pulses_are_two_seconds_each_way_then_the_smaller_pair():
    plan = maneuvers.pulses(T, recovery=11.0)
    assert plan.command[(T >= 2.0) & (T < 4.0)] == pytest.approx(0.26)
    assert plan.command[(T >= 4.0) & (T < 6.0)] == pytest.approx(-0.26)
    assert plan.command[(T >= 17.0) & (T < 19.0)] == pytest.approx(0.15)
    assert set(plan.mode[(T > 6.1) & (T < 16.9)]) == {HOLD}


def test_three_two_one_one_has_its_proportions():
    plan = maneuvers.three_two_one_one(T, 0.2, step=1.0)
    first = plan.command[plan.mode == OPEN][:140]
    lengths = np.diff(np.flatnonzero(np.concatenate([[True], np.diff(first) != 0, [True]])))
    assert list(lengths) == [60, 40, 20, 20]


def test_multisine_keeps_within_its_peak():
    plan = maneuvers.multisine(T, np.random.default_rng(1), 0.2)
    assert np.abs(plan.command).max() == pytest.approx(0.2)


def test_prbs_has_two_levels():
    plan = maneuvers.prbs(T, np.random.default_rng(2), 0.15)
    assert set(np.round(plan.command[plan.mode == OPEN], 6)) == {-0.15, 0.15}


@pytest.mark.parametrize("authority", [-0.8, 0.8])
def test_zigzag_turns_back_at_its_angle_whatever_the_sign_of_the_fin(authority):
    motion = fly(Physics(damping=1.0, authority=authority), CLOCK, maneuvers.zigzag(T, 0.17, 0.2))
    busy = (T > 2.02) & (T < 55.9)
    assert set(np.round(np.abs(motion.command[busy]), 6)) == {0.17}
    assert 6 <= np.count_nonzero(np.diff(motion.command[busy])) <= 20
    assert 0.2 < np.abs(motion.angle).max() < 0.45


def test_circle_rests_on_the_course_it_has_reached():
    motion = fly(Physics(damping=1.0, authority=-1.5, kp=0.8, kd=0.4), CLOCK, maneuvers.circle(T, 0.2, length=20.0, rest=8.0))
    resting = (T > 26.0) & (T < 30.0)
    assert np.abs(motion.rate[resting]).max() < 0.05
    assert np.abs(motion.angle[resting]).min() > 4.0


def test_the_pilot_recovers_the_heading_of_the_start():
    motion = fly(Physics(damping=1.0, authority=-1.5, kp=0.8, kd=0.5), CLOCK, maneuvers.pulses(T, recovery=20.0), angle=1.0)
    assert motion.angle[T < 25.9][-1] == pytest.approx(1.0, abs=5e-3)


def test_ar1_has_its_spread_and_its_memory():
    x = noise.ar1(np.random.default_rng(3), 200_000, 2.0, 0.5, 0.05)
    assert np.std(x) == pytest.approx(2.0, rel=0.03)
    assert np.corrcoef(x[10:], x[:-10])[0, 1] == pytest.approx(np.exp(-1.0), abs=0.03)


def test_quantised_values_are_whole_counts():
    assert noise.quantised([0.12, -0.26], 0.1) == pytest.approx([0.1, -0.3])


def test_gaps_are_nan_and_no_longer_than_asked():
    out = noise.with_gaps(np.random.default_rng(4), np.ones(500), 3, 10)
    assert 10 <= np.isnan(out).sum() <= 30


def test_telegraph_has_two_levels_and_jams_last_as_long_as_asked():
    levels = noise.telegraph(np.random.default_rng(5), T, 0.4, 3.0)
    assert set(levels) == {1.0, 0.4}
    assert noise.jams(np.random.default_rng(6), T, 1, 5.0).sum() == pytest.approx(100, abs=1)
