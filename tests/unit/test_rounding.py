"""Values and errors are rounded together, by the examples of the Particle Data Group's own text."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldsid.rounding import in_unit, number, number_against, p_value, with_error


@pytest.mark.parametrize(
    ("value", "error", "expected"),
    [
        (0.827, 0.119, "0.83 +/- 0.12"),
        (0.827, 0.367, "0.8 +/- 0.4"),
        (2.2811, 0.01342, "2.281 +/- 0.013"),
        (-3.0917, 0.0967, "-3.09 +/- 0.10"),
        (14.674, 0.964, "14.7 +/- 1.0"),
        (12345.0, 678.0, "12300 +/- 700"),
        (0.5, 0.0, "0.5000"),
        (0.5, float("nan"), "0.5000"),
        (float("nan"), 0.1, "-"),
    ],
)
def test_value_and_error_show_the_digits_the_error_allows(value, error, expected):
    assert with_error(value, error) == expected


@given(st.floats(-1e6, 1e6), st.floats(1e-5, 1e5))
def test_rounding_moves_neither_by_more_than_the_rule_allows(value, error):
    shown_value, shown_error = (float(part) for part in with_error(value, error).split(" +/- "))
    assert abs(shown_error - error) <= 0.13 * error
    assert abs(shown_value - value) <= 0.5 * error + 1e-9 * abs(value)


@pytest.mark.parametrize(
    ("value", "expected"),
    [(0.0, "0"), (12.345678, "12.35"), (1.5e-9, "1.500e-09"), (None, "-"), (float("inf"), "-"), (-0.0456789, "-0.04568")],
)
def test_a_number_alone_has_four_digits(value, expected):
    assert number(value) == expected


def test_a_plain_number_has_no_unit_behind_it():
    assert [in_unit(u) for u in ("1", "1/s", "rad", "")] == ["", "1/s", "rad", ""]


def test_a_p_value_is_no_number_far_out_in_the_tail():
    assert [p_value(p) for p in (0.63, 0.0162, 0.001, 0.0009, 0.0)] == [
        "p = 0.63",
        "p = 0.016",
        "p = 0.001",
        "p < 0.001",
        "p < 0.001",
    ]


@pytest.mark.parametrize(
    ("value", "limit", "shown"),
    [(44.98, 45.0, "44.98"), (44.2, 45.0, "44.2"), (2.9962, 3.0, "2.996"), (45.0, 45.0, "45.0"), (0.1204, 0.12, "0.1204")],
)
def test_a_number_beside_its_limit_shows_on_which_side_it_is(value, limit, shown):
    assert number_against(value, limit) == shown
