"""Canonical names, their unit suffixes, and what words in foreign names mean."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldsid.logs.mapping.canonical_names import STEMS, canonical, unit_in_name, words_of
from fieldsid.logs.mapping.word_meaning import meaning_of
from fieldsid.logs.run import SIGNALS


@pytest.mark.parametrize("name", SIGNALS)
def test_every_canonical_name_means_itself(name):
    assert canonical(name).signal == name


@pytest.mark.parametrize(
    ("name", "signal", "unit"),
    [
        ("yaw_deg", "yaw_rad", "deg"),
        ("yaw_rate_deg_s", "yaw_rate_rad_s", "deg/s"),
        ("surge_kn", "surge_m_s", "kn"),
        ("rudder_measured_deg", "rudder_measured_rad", "deg"),
        ("propeller_rps", "propeller_rpm", "rev/s"),
        ("depth_dbar", "depth_m", "dbar"),
        ("time_ms", "time_s", "ms"),
        (" Time_S ", "time_s", "s"),
        ("thrust", "thrust", "1"),
    ],
)
def test_a_suffix_states_the_unit(name, signal, unit):
    assert canonical(name) == (signal, unit)


@pytest.mark.parametrize(
    "name", ["yaw", "yaw_degs", "heading_deg", "yaw_m", "x_deg", "time", "time_deg", "", "_", "yaw_rate", "surge_dbar"]
)
def test_other_names_are_not_canonical(name):
    assert canonical(name) is None


@given(st.text(max_size=20))
def test_any_text_is_canonical_or_not_and_never_a_crash(text):
    found = canonical(text)
    assert found is None or found.signal in {"time_s", *SIGNALS}


@given(st.sampled_from(sorted(STEMS)), st.sampled_from(["rad", "deg", "rad_s", "deg_s", "m_s", "kn", "m", "ft", "rpm", "s"]))
def test_a_stem_and_a_unit_make_a_name_only_when_they_fit(stem, suffix):
    found = canonical(f"{stem}_{suffix}")
    rates = {"rad_s", "deg_s", "rpm"}
    fits = {"rad": {"rad", "deg"}, "rad/s": rates, "m/s": {"m_s", "kn"}, "m": {"m", "ft"}, "1/min": rates}[SIGNALS[STEMS[stem]]]
    assert (found is not None and found.signal == STEMS[stem]) == (suffix in fits)


@pytest.mark.parametrize(
    ("name", "signal", "unit"),
    [("heading [deg]", "yaw_rad", "deg"), ("r (°/s)", "yaw_rate_rad_s", "deg/s"),
     ("fin_deg", "rudder_rad", "deg"), ("u", "surge_m_s", None),
     ("speed [deg]", "surge_m_s", None), ("p_kpa", "depth_m", "kPa"), ("t [ms]", "time_s", "ms")],
)  # fmt: skip
def test_a_foreign_name_may_state_its_unit(name, signal, unit):
    assert unit_in_name(name, signal) == unit


@pytest.mark.parametrize(
    ("name", "signal"),
    [
        ("Heading [deg]", "yaw_rad"),
        ("gyro_z", "yaw_rate_rad_s"),
        ("yawRate", "yaw_rate_rad_s"),
        ("/auv/rudder_cmd", "rudder_rad"),
        ("rudder_feedback", "rudder_measured_rad"),
        ("/sternplane/state", "elevator_measured_rad"),
        ("r", "yaw_rate_rad_s"),
        ("Timestamp", "time_s"),
        ("propeller rpm", "propeller_rpm"),
        ("dvl_u", "surge_m_s"),
        ("DVL.v", "sway_m_s"),
    ],
)
def test_words_of_a_foreign_name_are_understood(name, signal):
    assert meaning_of(name)[0] == signal


@pytest.mark.parametrize("name", ["battery", "mode", "desired_speed", "", "a_b_c"])
def test_other_words_mean_nothing(name):
    assert meaning_of(name) is None


def test_words_leave_the_unit_out():
    assert words_of("/auv/yawRate_deg_s") == ["auv", "yaw", "rate"]
    assert words_of("Heading [deg]") == ["heading"]


@pytest.mark.parametrize(
    ("name", "signal"),
    [
        ("desired_heading", "yaw_goal_rad"),
        ("Yaw Goal", "yaw_goal_rad"),
        ("c_heading", "yaw_goal_rad"),
        ("pitch_setpoint", "pitch_goal_rad"),
        ("yaw_rate_setpoint", None),
        ("heading error", None),
    ],
)
def test_what_an_autopilot_was_told_to_hold_is_a_goal(name, signal):
    found = meaning_of(name)
    assert (found and found[0]) == signal


def test_the_goal_itself_is_surer_than_the_way_to_the_next_point():
    assert meaning_of("Yaw Goal")[1] > meaning_of("Next Heading")[1]
