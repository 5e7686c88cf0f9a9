"""A run becomes a record: its speed, and what of its helper signals is taken."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fieldsid.logs.doctor.examine import examine
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import left_out, part_of, record_of


def run_of(surge):
    time = 0.05 * np.arange(surge.size)
    zero = np.zeros(surge.size)
    return Run("a", time, {"yaw_rad": zero, "yaw_rate_rad_s": zero, "rudder_rad": zero, "surge_m_s": surge})


@pytest.mark.parametrize("seed", range(6))
def test_the_speed_of_a_run_between_two_levels_is_that_of_the_speed_without_its_noise(seed):
    time = 0.05 * np.arange(1200)
    truth = 1.4 + 0.06 * np.tanh(3.0 * np.sin(2.0 * np.pi * time / 43.0))
    noisy = truth + 0.03 * np.random.default_rng(seed).standard_normal(time.size)
    assert record_of(run_of(noisy), Axis.YAW).speed == pytest.approx(float(np.median(truth)), rel=0.006)


def test_a_run_without_a_speed_sensor_has_none():
    assert np.isnan(record_of(run_of(np.full(400, np.nan)), Axis.YAW).speed)


def test_a_sensors_spikes_count_as_not_measured():
    rng, n = np.random.default_rng(2), 800
    time = 0.05 * np.arange(n)
    heading, rate = 3.0 + 0.05 * time + 0.003 * rng.standard_normal(n), 0.05 + 0.002 * rng.standard_normal(n)
    heading[[50, 500]] += [0.06, -0.06]
    rate[[200, 201 + 90]] = [np.nan, 0.2]
    signals = {"yaw_rad": np.angle(np.exp(1j * heading)), "yaw_rate_rad_s": rate, "rudder_rad": np.where(time < 9.0, 0.1, -0.1)}
    run = Run("run", time, signals)
    record = record_of(run, Axis.YAW)
    assert np.flatnonzero(~record.angle_ok).tolist() == [50, 500]
    assert np.flatnonzero(~record.rate_ok).tolist() == [200, 291]
    told = left_out([replace(run, notes=examine(run, {}))], Axis.YAW)
    assert [(n.code, n.data["run"], n.data["signal"], n.data["count"]) for n in told] == [
        ("spikes", "run", "yaw_rad", 2),
        ("spikes", "run", "yaw_rate_rad_s", 1),
    ]
    assert left_out([replace(run, notes=examine(run, {}))], Axis.PITCH) == ()


def test_the_cross_speed_is_kept_as_it_was_measured():
    rng, n = np.random.default_rng(4), 600
    time = 0.05 * np.arange(n)
    sway = 0.2 * np.sin(0.5 * time) + 0.02 * rng.standard_normal(n)
    sway[[100, 350]] = [np.nan, 3.0]
    own = run_of(np.full(n, 1.4))
    record = record_of(replace(own, signals={**own.signals, "sway_m_s": sway}), Axis.YAW)
    assert np.flatnonzero(~record.cross_ok).tolist() == [100, 350]
    np.testing.assert_array_equal(record.cross, np.where(record.cross_ok, sway, 0.0))
    assert "cross" not in record.signals
    part = part_of(record, slice(0, 200))
    np.testing.assert_array_equal(part.cross, record.cross[:200])
    assert part.cross_ok.sum() == 199


@pytest.mark.parametrize("logged", [{}, {"sway_m_s": np.zeros(400)}, {"heave_m_s": np.linspace(0.0, 0.3, 400)}])
def test_a_log_without_a_cross_speed_of_the_axis_has_none_measured(logged):
    own = run_of(np.full(400, 1.4))
    record = record_of(replace(own, signals={**own.signals, **logged}), Axis.YAW)
    assert not record.cross_ok.any()
    assert record.cross.tolist() == [0.0] * 400


def test_a_command_that_is_lost_lies_between_those_around_it():
    time, fin = 0.1 * np.arange(60), 0.3 * np.sin(0.5 * np.arange(60))
    kept = np.delete(np.arange(60), [20, 31, 32])
    zero = np.zeros(kept.size)
    lossy = Run("a", time[kept], {"yaw_rad": zero, "yaw_rate_rad_s": zero, "rudder_rad": fin[kept]})
    path = record_of(lossy, Axis.YAW).commanded
    area = np.cumsum(np.diff(time[kept]) * path.mean)
    wanted = np.cumsum(0.1 * fin[:-1])[kept[1:] - 1]
    np.testing.assert_allclose(area, wanted, atol=0.1 * 0.3 * 0.5**2)  # half the bend of the sine over two lost samples
    held = np.cumsum(np.diff(time[kept]) * fin[kept][:-1])
    assert np.abs(held - wanted).max() > 2.0 * np.abs(area - wanted).max()
    np.testing.assert_array_equal(path.start, fin[kept][:-1])
    assert np.flatnonzero(path.end != path.start).tolist() == [19, 29]


def test_a_log_without_a_usual_step_has_lost_nothing_that_could_be_told():
    time = np.cumsum(np.random.default_rng(3).uniform(0.02, 0.2, 80))
    zero, fin = np.zeros(80), 0.3 * np.sin(time)
    path = record_of(Run("a", time, {"yaw_rad": zero, "yaw_rate_rad_s": zero, "rudder_rad": fin}), Axis.YAW).commanded
    np.testing.assert_array_equal(path.start, path.end)


@pytest.mark.parametrize(
    ("logged", "taken"),
    [
        (("propeller_rpm",), "propeller_rpm"),
        (("thrust_ratio", "propeller_rpm"), "thrust_ratio"),
        (("propeller_rpm", "thrust_ratio", "thrust"), "thrust"),
        ((), ""),
    ],
)
def test_the_thrust_is_taken_from_the_column_nearest_to_a_force(logged, taken):
    run = run_of(np.full(400, 1.5))
    levels = {name: np.where(run.time < 9.0, 1.0 + i, 2.0 + i) for i, name in enumerate(logged)}
    record = record_of(replace(run, signals={**run.signals, **levels}), Axis.YAW)
    assert record.thrust_column == taken
    if logged:
        assert np.median(np.abs(record["thrust"] - levels[taken])) < 1e-9
    else:
        assert "thrust" not in record.signals
