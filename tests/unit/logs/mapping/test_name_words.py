"""Names split into words and a unit, however a logger writes them."""

import pytest

from fieldsid.logs.mapping.canonical_names import tokens_of, unit_in_name, unit_of_field, words_of
from fieldsid.logs.mapping.word_meaning import meaning_of


@pytest.mark.parametrize(
    ("name", "signal", "unit"),
    [
        ("water_speed_knots", "surge_m_s", "kn"),
        ("VehicleSpeedKts", "surge_m_s", "kn"),
        ("boatSpeedMph", "surge_m_s", "mph"),
        ("STWkn", "surge_m_s", "kn"),
        ("SpeedKmH", "surge_m_s", "km/h"),
        ("speed km/h", "surge_m_s", "km/h"),
        ("speed_fps", "surge_m_s", "ft/s"),
        ("speed_ms", "surge_m_s", "m/s"),
        ("velocityKnots", "surge_m_s", "kn"),
        ("AuvDepthFt", "depth_m", "ft"),
        ("ftDepth", "depth_m", "ft"),
        ("depthInFeet", "depth_m", "ft"),
        ("depth_fathoms", "depth_m", "fathom"),
        ("DEPTH (0.1 m)", "depth_m", "0.1 m"),
        ("depthcm", "depth_m", "cm"),
        ("depth_psi", "depth_m", "psi"),
        ("depth_kPa", "depth_m", "kPa"),
        ("DepthPressurehPa", "depth_m", "hPa"),
        ("depth_MPa", "depth_m", "MPa"),
        ("pos_x_ft", "x_m", "ft"),
        ("PitchDeg", "pitch_rad", "deg"),
        ("pitch_centidegrees", "pitch_rad", "cdeg"),
        ("HeadDeg", "yaw_rad", "deg"),
        ("HEADINGDEG", "yaw_rad", "deg"),
        ("Hdg°", "yaw_rad", "deg"),
        ("rollMrad", "roll_rad", "mrad"),
        ("PitchRateDegSec", "pitch_rate_rad_s", "deg/s"),
        ("gyro_z_degs", "yaw_rate_rad_s", "deg/s"),
        ("rollRateRadPerSec", "roll_rate_rad_s", "rad/s"),
        ("gyr_z[mdps]", "yaw_rate_rad_s", "mdeg/s"),
        ("yaw_rate_deg", "yaw_rate_rad_s", "deg/s"),
        ("heading_dps", "yaw_rate_rad_s", "deg/s"),
        ("imu_yaw_rps", "yaw_rate_rad_s", "rad/s"),
        ("rot_deg_min", "yaw_rate_rad_s", "deg/min"),
        ("shaft_prop_rps", "propeller_rpm", "rev/s"),
    ],
)
def test_a_unit_word_in_a_name_is_read_and_the_signal_with_it(name, signal, unit):
    assert meaning_of(name)[0] == signal
    assert unit_in_name(name, signal) == unit


@pytest.mark.parametrize("name", ["wind_knots", "airspeed", "speed_min", "knots", "x_in", "water_head_ft", "header.seq"])
def test_words_beside_a_unit_may_still_name_another_thing(name):
    assert meaning_of(name) is None


@pytest.mark.parametrize(
    ("name", "signal"), [("heading_deg_s", "yaw_rad"), ("depth_in", "depth_m"), ("rudder_rev", "rudder_rad")]
)
def test_a_unit_that_does_not_fit_is_none(name, signal):
    assert unit_in_name(name, signal) is None


def test_known_words_are_told_apart_where_they_are_glued_and_unknown_ones_are_kept():
    assert tokens_of("yawratedeg") == ("yaw", "rate", "deg")
    assert tokens_of("SOGkts") == ("sog", "kts")
    assert tokens_of("GPSHeading") == ("gps", "heading")
    assert tokens_of("elevation finish") == ("elevation", "finish")
    assert words_of("Heading (desired)") == ["heading", "desired"]


def test_a_topic_of_one_number_may_state_its_unit():
    assert unit_of_field("/boat/speed_knots", "data", "surge_m_s") == "kn"
    assert unit_of_field("/boat/speed_knots", "twist.linear.x", "surge_m_s") is None
