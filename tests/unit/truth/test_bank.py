"""The blind bank is deterministic, honest about its floor, and gives the base model back where nothing is hidden."""

from __future__ import annotations

import numpy as np
import pytest
from truth.bank import Hidden, accepted, make_case
from truth.basefit import Sample, fit_base, left_over
from truth.maneuvers import Maneuver, pulses, zigzag
from truth.noise import Clock
from truth.physics import Physics
from truth.simple import fly

CLOCK = Clock(0.05, 1200)


def sample(numbers, maneuver, ratio, group, *, pitching=False):
    motion = fly(numbers, CLOCK, maneuver, pitching=pitching)
    return Sample(motion.command, motion.angle, motion.rate, CLOCK.sample, ratio, group)


def test_base_fit_gives_a_clean_base_model_back():
    numbers = Physics(damping=0.8, stiffness=0.5, authority=1.1, trim=0.02)
    fast = numbers._replace(authority=2.3, damping=1.2)
    runs = [
        sample(numbers, pulses(CLOCK.time), 1.0, 0, pitching=True),
        sample(fast, pulses(CLOCK.time), 1.5, 1, pitching=True),
    ]
    fit = fit_base(runs, (1.0, 1.0), (0.005, 0.005), exponent=1.0)
    assert [fit.damping, fit.stiffness, fit.trim] == pytest.approx([0.8, 0.5, 0.02], rel=1e-4)
    assert fit.authority == pytest.approx([1.1, 2.3 / 1.5**2], rel=1e-4)
    check = sample(numbers, zigzag(CLOCK.time), 1.0, 0, pitching=True)
    assert np.abs(left_over(fit, check, (0.005, 0.005))).max() < 1e-5


def test_a_case_depends_on_its_seed_and_index_alone():
    first, again, other = make_case(7, 11), make_case(7, 11), make_case(8, 11)
    assert first.ratio == again.ratio
    for one, two in zip(first.training, again.training, strict=True):
        assert all(np.array_equal(one[k], two[k]) for k in one)
    assert other.training[0]["surge_m_s"][0] != first.training[0]["surge_m_s"][0]


@pytest.mark.parametrize("index", range(4))
def test_nothing_hidden_leaves_the_base_model_near_the_floor(index):
    case = make_case(index, 5, kind="none")
    assert case.expected == {"sufficient", "disturbed"}
    assert not case.visible
    assert case.ratio < 1.35


MORE = [pytest.param(kind, marks=pytest.mark.slow) for kind in ("imperfect", "uncatalogued", "pair")]


@pytest.mark.parametrize("kind", ["single", *MORE])
def test_what_is_hidden_shows_in_the_base_models_error(kind):
    found = [make_case(i, 2, kind=kind) for i in range(4)]
    assert sum(c.visible for c in found) >= 2
    assert all(c.ratio > 1.35 for c in found if c.visible)
    assert all(len(c.training) == 3 and len(c.validation) == 2 for c in found)


def test_floor_is_the_sensor_noise_where_the_day_is_calm():
    case = next(c for c in (make_case(i, 3, kind="none") for i in range(30)) if c.details["colour"] == "white")
    log = case.validation[0]
    angle, rate = ("yaw_rad", "yaw_rate_rad_s") if case.axis == "yaw" else ("pitch_rad", "pitch_rate_rad_s")
    rough = {"angle_rad": np.diff(np.unwrap(log[angle]), 4), "rate_rad_s": np.diff(log[rate], 4)}
    for channel, differences in rough.items():
        # fourth differences of white noise have 70 times its variance, and of a slow motion hardly anything
        assert np.median(np.abs(differences)) / 0.6745 / np.sqrt(70) == pytest.approx(case.floor[channel], rel=0.1)


def test_logs_have_canonical_columns_of_one_length():
    case = make_case(1, 4)
    fin = "rudder_rad" if case.axis == "yaw" else "elevator_rad"
    for log in case.training + case.validation:
        assert {"time_s", "surge_m_s", "depth_m", "roll_rad", "thrust", fin} <= set(log)
        assert {v.shape for v in log.values()} == {log["time_s"].shape}
        assert all(np.isfinite(v).all() for v in log.values())


@pytest.mark.parametrize(("offset", "right"), [(-0.2, {"clock_offset", "delay"}), (0.2, {"clock_offset"})])
def test_late_sensors_may_be_called_a_late_fin_and_early_ones_may_not(offset, right):
    hidden = Hidden([["clock_offset", lambda s, _u, _i: {"clock_offset": offset * s}, None, 1.0]])
    assert accepted(("clock_offset",), hidden) == right


def test_delay_and_a_late_clock_are_the_same_to_a_linear_hull():
    late_fin = fly(Physics(delay=0.2), CLOCK, pulses(CLOCK.time))
    late_clock = fly(Physics(clock_offset=-0.2), CLOCK, Maneuver("same", late_fin.command, np.zeros(CLOCK.samples, dtype=int)))
    assert late_clock.rate == pytest.approx(late_fin.rate, abs=1e-6)


def test_median_speed_of_a_run_is_that_of_its_leg_however_the_thrust_varies():
    case = next(c for c in (make_case(i, 12, kind="none") for i in range(40)) if c.details["swing"] > 0.15)
    for log, speed in zip(case.training + case.validation, case.details["speeds"], strict=True):
        assert np.ptp(log["surge_m_s"]) > 0.1
        assert np.median(log["surge_m_s"]) == pytest.approx(speed, rel=0.01)
