"""One clock: commands stand, measurements are straight between neighbours, gaps stay gaps."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldsid.errors import MappingError
from fieldsid.logs.convert.clock import Track, base_of, interpolated, one_clock, zero_order_hold


def track(times, values):
    return Track(np.array(times, dtype=float), np.array(values, dtype=float), "topic")


def test_a_command_stands_until_the_next_and_is_unknown_before_the_first():
    found = zero_order_hold(track([1.0, 2.0], [10.0, 20.0]), np.array([0.5, 1.0, 1.9, 2.0, 9.0]))
    np.testing.assert_array_equal(found, [np.nan, 10.0, 10.0, 20.0, 20.0])


def test_a_measurement_is_straight_between_neighbours_and_never_beyond_the_ends():
    found = interpolated(track([0.0, 1.0, 2.0], [0.0, 10.0, 0.0]), np.array([-0.1, 0.25, 1.0, 1.5, 2.1]), 2.5)
    np.testing.assert_allclose(found, [np.nan, 2.5, 10.0, 5.0, np.nan])


def test_a_gap_stays_a_gap_but_its_edges_remain():
    found = interpolated(track([0, 1, 2, 6, 7, 8], [0, 1, 2, 6, 7, 8]), np.arange(9.0), 2.5)
    np.testing.assert_array_equal(found, [0, 1, 2, np.nan, np.nan, np.nan, 6, 7, 8])


def test_one_lost_sample_is_bridged_and_two_are_not():
    one = interpolated(track([0, 1, 3, 4, 5, 6], [0, 1, 3, 4, 5, 6]), np.array([2.0]), 2.5)
    two = interpolated(track([0, 1, 4, 5, 6, 7], [0, 1, 4, 5, 6, 7]), np.array([2.0]), 2.5)
    assert one[0] == 2.0
    assert np.isnan(two[0])


def test_missing_values_are_gaps_too():
    found = interpolated(track(np.arange(8), [0, 1, np.nan, np.nan, np.nan, 5, 6, 7]), np.array([2.0, 3.0, 5.5]), 2.5)
    np.testing.assert_array_equal(found, [np.nan, np.nan, 5.5])


@given(st.lists(st.integers(1, 50), min_size=2, max_size=40), st.integers(0, 2**31))
def test_samples_that_coincide_pass_unchanged_to_the_last_bit(steps, seed):
    time = np.cumsum(steps) / 100.0
    values = np.random.default_rng(seed).normal(size=time.size)
    np.testing.assert_array_equal(interpolated(Track(time, values), time, 2.5), values)


@given(st.lists(st.floats(-5, 5), min_size=3, max_size=30), st.floats(0.0, 1.0))
def test_nothing_lies_outside_its_two_neighbours(values, share):
    time = np.arange(len(values), dtype=float)
    at = np.minimum(time[:-1] + share, time[1:])
    found = interpolated(Track(time, np.array(values)), at, 2.5)
    low, high = np.minimum(values[:-1], values[1:]), np.maximum(values[:-1], values[1:])
    assert ((found >= low - 1e-12) & (found <= high + 1e-12)).all()


def test_the_fastest_angle_or_rate_is_the_clock_whatever_else_is_faster():
    tracks = {
        "yaw_rad": track(np.arange(10), np.zeros(10)),
        "yaw_rate_rad_s": track(np.arange(0, 10, 0.5), np.zeros(20)),
        "thrust": track(np.arange(0, 10, 0.1), np.zeros(100)),
    }
    assert base_of(tracks) == "yaw_rate_rad_s"
    assert base_of(tracks, "yaw_rad") == "yaw_rad"
    assert base_of({"thrust": tracks["thrust"]}) == "thrust"


def test_asking_for_a_clock_that_is_not_mapped_names_the_near_one():
    with pytest.raises(MappingError, match="`clock: yaw_ra` is no mapped signal") as error:
        base_of({"yaw_rad": track([0, 1], [0, 0])}, "yaw_ra")
    assert "`yaw_rad`" in error.value.hint


def test_signals_of_three_rates_come_to_one_clock_and_the_note_says_whose():
    tracks = {
        "yaw_rate_rad_s": Track(np.arange(0, 1, 0.1), np.arange(10.0), "/imu.z"),
        "depth_m": Track(np.array([0.0, 0.5, 1.0]), np.array([0.0, 5.0, 10.0]), "/depth.data"),
        "rudder_rad": Track(np.array([0.25]), np.array([0.3]), "/rudder.data"),
    }
    time, signals, notes = one_clock(tracks)
    np.testing.assert_array_equal(time, tracks["yaw_rate_rad_s"].time)
    np.testing.assert_allclose(signals["depth_m"], 10 * time)
    np.testing.assert_array_equal(signals["rudder_rad"], [np.nan] * 3 + [0.3] * 7)
    assert "/imu, 10 Hz" in notes[0].message
    assert "/depth, /rudder" in notes[0].message


def test_a_track_without_a_sample_gives_gaps_only():
    empty = track([0.0, 1.0], [np.nan, np.nan])
    assert np.isnan(interpolated(empty, np.array([0.5]), 2.5)).all()
    assert np.isnan(zero_order_hold(empty, np.array([0.5]))).all()
