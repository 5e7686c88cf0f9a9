"""Units: factors against numbers worked by hand, spellings, and what cannot be meant."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldsid.errors import MappingError
from fieldsid.logs.convert.units import UNITS, depth_of_pressure, dimension_of, factor_to, find_unit, pick_unit, scaled
from fieldsid.logs.run import SIGNALS


@pytest.mark.parametrize(
    ("signal", "unit", "value", "expected"),
    [
        ("yaw_rad", "deg", 180.0, math.pi),
        ("yaw_rate_rad_s", "deg/s", 90.0, math.pi / 2),
        ("yaw_rate_rad_s", "rpm", 60.0, 2 * math.pi),
        ("propeller_rpm", "rpm", 900.0, 900.0),
        ("propeller_rpm", "rev/s", 10.0, 600.0),
        ("propeller_rpm", "rad/s", 2 * math.pi, 60.0),
        ("surge_m_s", "kn", 3600.0, 1852.0),
        ("surge_m_s", "km/h", 3.6, 1.0),
        ("depth_m", "ft", 10.0, 3.048),
        ("thrust", "kgf", 7.0, 7.0),
        ("thrust_ratio", "%", 50.0, 0.5),
    ],
)
def test_a_value_in_a_unit_is_the_value_worked_by_hand(signal, unit, value, expected):
    assert value * factor_to(signal, unit) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    ("spelling", "name"),
    [
        ("Degrees", "deg"),
        ("°/s", "deg/s"),
        ("m/sec", "m/s"),
        ("knots", "kn"),
        ("dps", "deg/s"),
        ("dBar", "dbar"),
        ("kpa", "kPa"),
        ("µs", "us"),
    ],
)
def test_common_spellings_are_understood(spelling, name):
    assert pick_unit(spelling).name == name


def test_an_unknown_unit_lists_the_near_ones():
    with pytest.raises(MappingError, match="no unit 'degg'") as error:
        pick_unit("degg")
    assert "`deg`" in error.value.hint


def test_a_unit_of_another_dimension_is_refused_with_those_that_fit():
    with pytest.raises(MappingError, match="`yaw_rad` cannot be in 'm/s'") as error:
        factor_to("yaw_rad", "m/s")
    assert "deg" in error.value.hint


def test_ten_metres_of_sea_water_are_a_bar_and_a_bit():
    pressure = np.array([101325.0, 101325.0 + 1025.0 * 9.80665 * 10.0])
    np.testing.assert_allclose(depth_of_pressure(pressure, density=1025.0, surface_pa=101325.0), [0.0, 10.0], atol=1e-12)


def test_a_factor_of_one_keeps_the_very_array():
    values = np.array([0.1, 0.2])
    assert scaled(values, 1.0) is values


@given(st.sampled_from(sorted(UNITS)), st.sampled_from(sorted(SIGNALS)))
def test_a_unit_either_fits_a_signal_with_a_positive_factor_or_is_refused(unit, signal):
    fits = dimension_of(signal) in (None, UNITS[unit].dimension)
    if fits:
        assert factor_to(signal, unit) > 0.0
    else:
        with pytest.raises(MappingError):
            factor_to(signal, unit)


@given(st.text(max_size=12))
def test_any_text_is_a_unit_or_none_and_never_a_crash(text):
    unit = find_unit(text)
    assert unit is None or UNITS[unit.name] == unit
