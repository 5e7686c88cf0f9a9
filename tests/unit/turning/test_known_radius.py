"""A radius is a number with its band, or the band alone where that is too wide."""

from __future__ import annotations

import math

import pytest

from fieldsid.turning.prediction import is_band_only, radius_cell, turn_words


@pytest.mark.parametrize(("band", "alone"), [((4.4, 5.5), False), ((4.13, 5.86), False), ((4.1, 5.9), True), ((4.0, 11.0), True)])
def test_a_band_wider_than_a_third_of_the_radius_stands_alone(band, alone):
    assert is_band_only(5.0, band) is alone
    assert radius_cell(5.0, band) == ("(5.00)" if alone else "5.00")


def test_the_words_of_a_band_have_no_number_in_the_middle():
    assert turn_words(5.0, (4.4, 5.5), "to port") == "5.00 m to port, 95 % 4.40 .. 5.50 m"
    assert turn_words(5.0, (4.0, 11.0), "to port") == "between 4.00 and 11.0 m (95 %) to port"


def test_what_is_not_a_number_is_no_band():
    assert not is_band_only(math.nan, (4.0, 11.0))
    assert not is_band_only(5.0, (math.nan, math.nan))
