"""Stamps with too few digits come back at the logger's even steps, and nothing else is touched."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fieldsid.logs.convert.times.coarse_stamps import rebuilt
from fieldsid.logs.convert.times.time_column import seconds_of


def digits(time, count):
    return np.array([float(f"{t:.{count - 1}e}") for t in time])


def test_three_digits_of_a_number_that_grows_come_back():
    time = 0.137 * np.arange(4000)
    found, notes = rebuilt(digits(time, 3), "t")
    assert np.abs(found - time).max() < 0.1
    assert np.ptp(np.diff(found)) < 1e-9
    assert notes[0].data["count"] > 2000


@pytest.mark.parametrize("cut", [np.floor, np.round])
def test_whole_seconds_of_an_epoch_come_back_across_a_gap(cut):
    time = 0.13 * np.arange(2000)
    time[900:] += 47.0
    found, notes = seconds_of(cut(1.7e9 + time).astype(np.int64), "s", name="t")
    assert np.abs(found - time).max() < 1.0
    assert np.diff(found).min() > 0.12
    assert np.abs(np.diff(found)[899] - 47.13) < 1.1
    assert [n.code for n in notes] == ["coarse_time", "time_origin"]


def test_a_clock_that_drifts_is_spread_from_stamp_to_stamp():
    rng = np.random.default_rng(5)
    time = np.cumsum(rng.uniform(0.05, 0.25, 3000))
    found, notes = rebuilt(np.floor(time), "t")
    assert notes
    assert np.diff(found).min() > 0.0
    assert np.abs(found - time).max() < 1.3


@pytest.mark.parametrize("row", [100, 3])
def test_a_row_that_was_written_twice_is_left_to_be_refused(row):
    time = np.round(0.05 * np.arange(400), 2)
    time = np.insert(time, row, time[row])
    found, notes = rebuilt(time, "t")
    assert found is time
    assert not notes


@settings(max_examples=60)
@given(st.floats(0.02, 0.4), st.integers(0, 1))
def test_steps_finer_than_the_last_digit_come_back_whatever_they_are(step, decimals):
    time = step * np.arange(600)
    coarse = np.round(time, decimals)
    found, _ = rebuilt(coarse, "t")
    assert np.abs(found - time).max() < 10.0**-decimals


def test_an_epoch_near_a_round_number_keeps_its_stamps():
    rng = np.random.default_rng(4)
    time = np.round(1.7e9 + 0.05 * np.delete(np.arange(400), [90, 250]) + rng.normal(0.0, 1e-3, 398), 3)
    found, notes = rebuilt(time, "t")
    assert found is time
    assert not notes


@pytest.mark.parametrize("missing", [1, 4, 12])
@pytest.mark.parametrize("seed", range(4))
def test_a_round_step_keeps_its_stamps_where_rows_are_missing(missing, seed):
    rows = np.sort(np.random.default_rng(seed).choice(np.arange(1, 459), missing, replace=False))
    time = np.round(120.0 + 0.1 * np.delete(np.arange(460), rows), 2)
    found, notes = rebuilt(time, "t")
    assert found is time
    assert not notes
