"""Time columns: units, epochs, ISO text, and cells that are no times."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldsid.errors import LogError, MappingError
from fieldsid.logs.convert.times.time_column import likely_time_unit, seconds_of
from fieldsid.logs.reader import ReadOptions


def seconds(cells, unit=None, **more):
    return seconds_of(np.array(cells), unit, name="t", **more)


@pytest.mark.parametrize(
    ("cells", "unit", "expected"),
    [
        ([0, 50, 100], "ms", [0.0, 0.05, 0.1]),
        ([0.0, 0.5], "min", [0.0, 30.0]),
        ([0, 50_000_000], "ns", [0.0, 0.05]),
        ([1.0, 2.0], None, [1.0, 2.0]),
    ],
)
def test_units_of_time_are_exact_seconds(cells, unit, expected):
    found, notes = seconds(cells, unit)
    assert found.tolist() == expected
    assert not notes


def test_nanoseconds_of_an_epoch_keep_every_digit():
    start = 1_700_000_000_123_456_789
    found, notes = seconds([start, start + 1, start + 50_000_000], "ns")
    assert found.tolist() == [0.0, 1e-9, 0.05]
    assert notes[0].code == "time_origin"


def test_an_epoch_in_seconds_starts_at_zero_and_a_long_run_does_not():
    assert seconds([1.7e9, 1.7e9 + 0.5])[0].tolist() == [0.0, 0.5]
    assert seconds([1e6, 1e6 + 0.5])[0].tolist() == [1e6, 1e6 + 0.5]


@pytest.mark.parametrize("text", ["2024-03-01T10:00:00{}Z", "2024-03-01 10:00:00{}", "2024-03-01T12:00:00{}+02:00"])
def test_iso_times_are_seconds_from_the_first(text):
    found, notes = seconds([text.format(".000"), text.format(".050"), text.format(".1")])
    assert found.tolist() == [0.0, 0.05, 0.1]
    assert notes[0].data["origin_ns"] == 1709287200 * 10**9


def test_stamps_of_a_table_are_taken_as_they_are():
    stamps = np.array(["2024-03-01T10:00:00", "2024-03-01T10:00:00.25"], dtype="datetime64[us]")
    assert seconds_of(stamps, None, name="t")[0].tolist() == [0.0, 0.25]


def test_a_row_without_a_time_is_an_error_and_left_out_when_salvaging():
    with pytest.raises(LogError, match="rows without a time") as error:
        seconds([0.0, np.nan, 2.0])
    assert "row 2" in error.value.found
    found, notes = seconds([0.0, np.nan, 2.0], options=ReadOptions(salvage=True))
    assert np.isnan(found[1])
    assert notes[0].code == "no_time"


def test_a_word_among_times_is_an_error_that_shows_it():
    with pytest.raises(LogError, match="cells that are no times") as error:
        seconds_of(np.array(["0.0", "0.1", "ERR", "0.3"], dtype=object), None, name="t")
    assert "'ERR'" in error.value.found


def test_a_unit_that_is_not_of_time_is_refused():
    with pytest.raises(MappingError, match="time cannot be in 'deg'"):
        seconds([0.0], "deg")


def test_no_rows_are_an_error():
    with pytest.raises(LogError, match="no rows"):
        seconds_of(np.zeros(0), None, name="t")


@given(st.integers(-(2**40), 2**60), st.lists(st.integers(0, 10**12), min_size=1, max_size=20))
def test_differences_of_integer_stamps_are_never_lost(start, steps):
    stamps = np.cumsum([start, *steps])
    found, _ = seconds_of(stamps, "ns", name="t")
    expected = (stamps - stamps[0]) / 1e9
    np.testing.assert_allclose(found - found[0], expected, atol=1e-6, rtol=1e-12)


def test_seconds_since_1970_with_a_fraction_are_seconds_however_seldom_they_are_written():
    seldom = 1.56e9 + np.cumsum(np.random.default_rng(3).uniform(5.0, 40.0, 200))
    assert likely_time_unit(seldom) == "s"
    assert likely_time_unit(50.0 * np.arange(200.0)) == "ms"


def test_one_row_of_text_is_a_number_or_refused():
    one = np.array(["12.5"], dtype=object)
    assert seconds_of(one, "s", name="t")[0].tolist() == [12.5]
    with pytest.raises(LogError, match="without a time"):
        seconds_of(np.array(["noon"], dtype=object), "s", name="t")


@pytest.mark.parametrize("year", [1970, 2024])
def test_digits_of_a_date_are_one_in_a_log_whose_clock_was_never_set_too(year):
    assert likely_time_unit(year * 1e10 + 301142018.0 + np.arange(30.0)) == "yyyymmddhhmmss"


@pytest.mark.parametrize(("unit", "factor"), [("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_the_unit_of_an_epoch_is_the_one_in_which_it_is_a_year_of_logs(unit, factor):
    assert likely_time_unit((1.7e9 + 0.1 * np.arange(30.0)) * factor) == unit
