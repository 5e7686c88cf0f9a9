"""Clocks, dates and GPS weeks are seconds that go on."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldsid.errors import LogError
from fieldsid.logs.convert.times.dates import days_of
from fieldsid.logs.convert.times.time_column import GPS_EPOCH_S, seconds_of


def of(cells, unit=None, **more):
    return seconds_of(np.array(cells, dtype=object), unit, name="Time", **more)


@pytest.mark.parametrize(
    ("cells", "unit", "expected"),
    [
        (["14:20:18.50", "14:20:19.00", "14:20:19.50"], None, [0.0, 0.5, 1.0]),
        (["23:59:59.5", "00:00:00.0", "0:00:00.5"], None, [0.0, 0.5, 1.0]),
        (["59:59.6", "00:00.1", "00:00.6"], None, [0.0, 0.5, 1.0]),
        (["14:20:18,5", "14:20:19,0", "14:20:19,5"], None, [0.0, 0.5, 1.0]),
        (["11:59:59 AM", "12:00:00 PM", "12:00:01 PM"], None, [0.0, 1.0, 2.0]),
        (["11:58 AM", "11:59 AM", "1:02 PM"], None, [0.0, 60.0, 3840.0]),
        (["3/1/2024 11:58 AM", "3/1/2024 11:59 AM", "3/1/2024 1:02 PM"], None, [0.0, 60.0, 3840.0]),
        (["14:20", "14:21", "14:23"], "hh:mm", [0.0, 60.0, 180.0]),
        (["3/1/24 14:20:18", "3/1/24 14:20:19", "3/2/24 14:20:19"], None, [0.0, 1.0, 86401.0]),
        (["01.03.2024 23:59:59", "02.03.2024 00:00:00", "02.03.2024 00:00:01"], None, [0.0, 1.0, 2.0]),
        (["01-Mar-2024 23:59:59", "02-Mar-2024 00:00:00", "02-Mar-2024 00:00:01"], None, [0.0, 1.0, 2.0]),
    ],
)
def test_a_clock_goes_on(cells, unit, expected):
    found, notes = of(cells, unit)
    np.testing.assert_allclose(found, expected, atol=1e-6)
    assert "time_origin" in {n.code for n in notes}


def test_an_hour_that_a_spreadsheet_dropped_is_said():
    notes = of(["59:59.6", "00:00.1", "00:00.6"])[1]
    assert "the hour is not in it; it starts again 1 time," in next(n.message for n in notes if n.code == "lost_hours")


def test_a_clock_in_digits_is_read_where_the_mapping_says_so():
    found, _ = seconds_of(np.array([235959.5, 0.0, 0.5]), "hhmmss", name="UTC")
    np.testing.assert_allclose(found, [0.0, 0.5, 1.0], atol=1e-6)


@pytest.mark.parametrize(
    "days", [["12/31/23", "1/1/24"], ["31/12/23", "1/1/24"], ["2023-12-31", "2024-01-01"], ["31.12.2023", "01.01.2024"]]
)
def test_a_date_in_a_column_of_its_own_counts_the_days(days):
    dates = np.array([days[0], days[1], days[1]], dtype=object)
    found, _ = of(["23:59:59", "00:00:01", "18:00:00"], dates=[dates])
    assert found.tolist() == [0.0, 2.0, 64801.0]


def test_of_two_orders_of_a_date_that_of_the_fewest_days_is_taken():
    assert np.ptp(days_of(np.array(["3/1/24", "4/1/24"], dtype=object))) == 1.0


@pytest.mark.parametrize(("unit", "factor"), [("s", 1.0), (None, 1e3), ("ms", 1e3)])
def test_a_gps_week_and_its_time_go_on_over_the_week(unit, factor):
    tow = np.array([604799.5, 0.0, 0.5]) * factor
    found, notes = seconds_of(tow, unit, name="TOW", weeks=np.array([2300, 2301, 2301]))
    np.testing.assert_allclose(found, [0.0, 0.5, 1.0], atol=1e-6)
    assert notes[0].data["origin_ns"] == pytest.approx((2300 * 604800 + 604799.5 + GPS_EPOCH_S) * 1e9, abs=1e3)


def test_a_column_that_is_no_clock_is_refused_with_its_first_cell():
    with pytest.raises(LogError, match="no clock") as error:
        of(["north", "east"], "hh:mm:ss")
    assert "'north'" in error.value.found


@given(st.lists(st.floats(0.01, 1700.0), min_size=2, max_size=40), st.sampled_from([3600, 86400]))
def test_any_steps_below_half_a_round_come_back(steps, period):
    time = np.round(np.concatenate([[0.0], np.cumsum(steps)]), 2)
    clock = [t % period for t in time]
    texts = [
        f"{int(t // 60):02d}:{t % 60:05.2f}" if period == 3600 else f"{int(t // 3600):02d}:{int(t // 60) % 60:02d}:{t % 60:05.2f}"
        for t in clock
    ]
    if any(":60.00" in t for t in texts):
        return
    np.testing.assert_allclose(of(texts)[0], time - time[0], atol=0.011)
