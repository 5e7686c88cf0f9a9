"""An angle as it is typed: with its unit, or in rad where it can be; never a guess."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.angles import FIN, FIN_RATE, HEADING, TILT, TURN, parse_angle, parse_margin, said
from fieldsid.errors import UsageError


@pytest.mark.parametrize(
    ("text", "value"),
    [("0.35", 0.35), ("0.35rad", 0.35), ("20deg", np.radians(20)), (" 5 deg", np.radians(5)), ("15DEG", np.radians(15)),
     ("60rad", 60.0), ("-2deg", np.radians(-2)), ("30deg/s", np.radians(30)), ("0", 0.0)],
)  # fmt: skip
def test_angles_are_read_with_their_unit_or_in_rad(text, value):
    assert parse_angle(text, "--max-roll", FIN) == pytest.approx(value)


@pytest.mark.parametrize(("text", "most"), [("60", HEADING), ("5", HEADING), ("1", FIN), ("20", TILT), ("30", FIN_RATE)])
def test_a_bare_number_that_cannot_be_rad_is_refused_with_both_readings(text, most):
    with pytest.raises(UsageError) as caught:
        parse_angle(text, "--x", most)
    assert f"{text}deg`, or `{text}rad` where that is meant" in caught.value.hint
    assert (
        f"{text} deg is {np.radians(float(text)):.4g} rad, {text} rad is {np.degrees(float(text)):.4g} deg" in caught.value.found
    )
    for reading in ("deg", "rad"):
        parse_angle(text + reading, "--x", most)


@pytest.mark.parametrize("text", ["", "deg", "wide", "nan", "infrad", "1 2deg", "1m"])
def test_what_is_no_angle_is_refused(text):
    with pytest.raises(UsageError, match="is not an angle"):
        parse_angle(text, "--x", FIN)


@pytest.mark.parametrize(("text", "most"), [("400deg", TURN), ("-7rad", TURN), ("46deg", FIN), ("-1rad", FIN)])
def test_what_cannot_be_meant_with_its_unit_is_refused_with_the_most_that_can(text, most):
    with pytest.raises(UsageError, match="more than can be meant") as caught:
        parse_angle(text, "--x", most, most)
    assert parse_angle(caught.value.hint.split("--x ")[1].rstrip("`"), "--x", most, most) == pytest.approx(most)


def test_only_readings_that_can_be_meant_are_advised():
    with pytest.raises(UsageError, match="-270 deg or -270 rad") as caught:
        parse_angle("-270", "--x", TURN, TURN)
    assert caught.value.hint == "write `--x -270deg`"
    assert parse_angle("-270deg", "--x", TURN, TURN) == pytest.approx(np.radians(-270.0))
    with pytest.raises(UsageError, match="400 deg or 400 rad") as caught:
        parse_angle("400", "--x", TURN, TURN)
    assert caught.value.hint == "write at most `--x 360deg`"


@pytest.mark.parametrize("text", ["-10", "-10deg", "181deg", "400", "4rad"])
def test_a_margin_is_between_nil_and_half_a_turn(text):
    with pytest.raises(UsageError):
        parse_margin(text, "--x")


def test_an_angle_is_said_in_both_units():
    assert said(np.radians(60.0)) == "60 deg (1.05 rad)"
