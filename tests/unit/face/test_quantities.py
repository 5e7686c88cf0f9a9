"""Quantities as a user types them: a number with its unit, or bare in the first; what may be meant in two ways is refused."""

from __future__ import annotations

import math

import pytest

from fieldsid.errors import UsageError
from fieldsid.face.quantities import BANDWIDTH, DECIBEL, parse_quantity, parse_share, parse_time


@pytest.mark.parametrize(("text", "seconds"), [("4s", 4.0), ("400ms", 0.4), (" 2.5 ", 2.5), ("0.3 s", 0.3), ("1e-1s", 0.1)])
def test_times(text, seconds):
    assert parse_time(text, "--settling") == pytest.approx(seconds)


def test_bandwidths_and_decibels():
    assert parse_quantity("1.5rad/s", "--bandwidth", BANDWIDTH, "1rad/s") == 1.5
    assert parse_quantity("0.5hz", "--bandwidth", BANDWIDTH, "1rad/s") == pytest.approx(math.pi)
    assert parse_quantity("6dB", "--require-gain-margin", DECIBEL, "6dB") == 6.0


@pytest.mark.parametrize(("text", "share"), [("10%", 0.1), ("10", 0.1), ("0.5%", 0.005), ("0", 0.0)])
def test_shares(text, share):
    assert parse_share(text, "--overshoot") == pytest.approx(share)


@pytest.mark.parametrize("text", ["soon", "4m", "", "nan", "infs", "10deg"])
def test_what_is_no_time_is_refused_with_an_example(text):
    with pytest.raises(UsageError) as caught:
        parse_time(text, "--settling", "4s")
    assert caught.value.hint == "write `--settling 4s`"


def test_a_bare_share_that_may_be_per_cent_is_refused_with_both_readings():
    with pytest.raises(UsageError, match=r"is 0\.2 % or 20 %") as caught:
        parse_share("0.2", "--overshoot")
    assert caught.value.hint == "write `--overshoot 20%`, or `0.2%` where that is meant"
