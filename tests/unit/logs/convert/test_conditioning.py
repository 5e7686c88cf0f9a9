"""Time out of order and missing samples: refused with place and number, or left out with a note."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldsid.errors import LogError
from fieldsid.logs.convert.conditioning import gaps_in, in_order, long_gaps, refuse_long_gaps
from fieldsid.logs.reader import ReadOptions


def test_time_in_order_is_left_alone():
    rows, notes = in_order(np.array([0.0, 1.0, 2.5]), "t")
    assert rows.tolist() == [0, 1, 2]
    assert not notes


@pytest.mark.parametrize(
    ("time", "what", "where"), [([0, 1, 0.5, 2], "goes backwards", "sample 3"), ([0, 1, 1, 2], "repeats", "samples 2 and 3")]
)
def test_disorder_is_refused_with_its_first_place(time, what, where):
    with pytest.raises(LogError, match=f"time {what} in t") as error:
        in_order(np.array(time, dtype=float), "t", ReadOptions(command="sysid import a.csv"))
    assert where in error.value.found
    assert "sysid import a.csv --salvage" in error.value.hint


def test_salvage_keeps_what_moves_time_on():
    rows, notes = in_order(np.array([0, 1, 1, 0.5, np.nan, 2, 3]), "t", ReadOptions(salvage=True))
    assert rows.tolist() == [0, 1, 5, 6]
    assert notes[0].data == {"dropped": 2, "of": 6}


@given(st.lists(st.one_of(st.floats(0, 100), st.just(float("nan"))), min_size=1, max_size=60))
def test_salvaged_time_always_increases_and_reaches_its_maximum(times):
    time = np.array(times)
    rows, _ = in_order(time, "t", ReadOptions(salvage=True))
    assert (np.diff(time[rows]) > 0).all()
    if np.isfinite(time).any():
        assert time[rows][-1] == np.nanmax(time)


def test_gaps_are_those_inside_a_signal_only():
    values = np.array([np.nan, 1, np.nan, np.nan, 2, 3, np.nan, 4, np.nan])
    found = [(g.start_s, g.end_s, g.count) for g in gaps_in(np.arange(9.0), values)]
    assert found == [(1.0, 4.0, 2), (5.0, 7.0, 1)]


def test_a_long_gap_in_a_main_signal_is_refused_and_in_a_helper_is_not():
    time = np.arange(0, 10, 0.1)
    holed = np.where((time > 3) & (time < 6), np.nan, 1.0)
    with pytest.raises(LogError, match=r"`yaw_rad` is missing for 2\.9\d s \(limit 2 s\)") as error:
        refuse_long_gaps(time, {"yaw_rad": holed}, ReadOptions(command="sysid import a.csv"))
    assert "`sysid import a.csv --max-gap 3.0 -o imported/`" in error.value.hint
    assert "`sysid import a.csv --from 6.00 --to 9.90 -o imported/`" in error.value.hint
    refuse_long_gaps(time, {"yaw_rad": holed}, limit_s=5.0)
    refuse_long_gaps(time, {"surge_m_s": holed})


def test_a_gap_as_long_as_the_limit_is_taken_however_its_times_are_rounded():
    values = np.ones(100)
    values[30:50] = np.nan
    for start in range(200):
        assert not long_gaps(0.1 * np.arange(start, start + 100), {"yaw_rad": values}, 2.0)


def test_a_slow_sensor_on_a_fast_clock_is_no_gap():
    time = np.arange(0, 10, 0.05)
    slow = np.where(np.arange(time.size) % 20 == 0, 1.0, np.nan)
    refuse_long_gaps(time, {"yaw_rad": slow})
