"""Frames: against rotation matrices multiplied out, and there and back."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fieldsid.logs.convert.frames import (
    Frame,
    about_level,
    angles_of_quaternion,
    heading_of_enu,
    to_ned_frd,
    unwrapped,
)

ENU_TO_NED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
FLU_TO_FRD = np.diag([1.0, -1.0, -1.0])
ROS = Frame("ENU", "FLU")
yaws = st.floats(-3.1, 3.1)
pitches = st.floats(-1.5, 1.5)


def quaternion_of_angles(yaw, pitch, roll):
    """Body-to-world quaternions (n, 4), x y z w, of z-y-x angles (n,) in rad, both in one pair of frames."""
    cy, sy = np.cos(yaw / 2), np.sin(yaw / 2)
    cp, sp = np.cos(pitch / 2), np.sin(pitch / 2)
    cr, sr = np.cos(roll / 2), np.sin(roll / 2)
    return np.stack(
        [sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy],
        axis=-1,
    )


@given(yaws, pitches, yaws)
def test_a_ros_quaternion_gives_the_angles_of_the_turned_matrix(yaw, pitch, roll):
    ours = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix()
    theirs = Rotation.from_matrix(ENU_TO_NED.T @ ours @ FLU_TO_FRD.T).as_quat()
    found = np.concatenate(angles_of_quaternion(theirs[None, :], ROS))
    np.testing.assert_allclose(Rotation.from_euler("ZYX", found).as_matrix(), ours, atol=1e-12)


@given(yaws, pitches, yaws, st.floats(0.1, 10.0))
def test_angles_come_back_from_a_quaternion_of_any_length(yaw, pitch, roll, length):
    q = length * quaternion_of_angles(np.array([yaw]), np.array([pitch]), np.array([roll]))
    found = np.concatenate(angles_of_quaternion(q, Frame()))
    np.testing.assert_allclose(found, [yaw, pitch, roll], atol=1e-10)


@given(yaws, pitches, yaws)
def test_scalars_and_quaternions_agree_in_ros_frames(yaw, pitch, roll):
    angles = [np.array([v]) for v in (yaw, pitch, roll)]
    by_quaternion = angles_of_quaternion(quaternion_of_angles(*angles), ROS)
    by_scalar = [to_ned_frd(n, v, ROS)[1] for n, v in zip(("yaw_rad", "pitch_rad", "roll_rad"), angles, strict=True)]
    turn = (np.concatenate(by_quaternion) - np.concatenate(by_scalar)) / (2 * math.pi)
    np.testing.assert_allclose(turn, np.round(turn), atol=1e-9)


def test_north_and_east_of_enu_are_headings_zero_and_ninety():
    np.testing.assert_allclose(heading_of_enu(np.array([math.pi / 2, 0.0])), [0.0, math.pi / 2])


@pytest.mark.parametrize(
    ("signal", "name", "sign"),
    [("pitch_rad", "pitch_rad", -1), ("yaw_rate_rad_s", "yaw_rate_rad_s", -1), ("pitch_rate_rad_s", "pitch_rate_rad_s", -1),
     ("sway_m_s", "sway_m_s", -1), ("heave_m_s", "heave_m_s", -1), ("surge_m_s", "surge_m_s", 1), ("roll_rad", "roll_rad", 1),
     ("roll_rate_rad_s", "roll_rate_rad_s", 1), ("x_m", "y_m", 1), ("y_m", "x_m", 1),
     ("rudder_rad", "rudder_rad", 1), ("depth_m", "depth_m", 1)],
)  # fmt: skip
def test_ros_signals_change_sign_and_place_as_rep_103_says(signal, name, sign):
    assert to_ned_frd(signal, np.array([2.0]), ROS) == (name, np.array([2.0 * sign]))


def test_a_height_becomes_a_depth_only_in_enu():
    assert to_ned_frd("depth_m", np.array([-5.0]), ROS, is_height=True)[1] == 5.0
    assert to_ned_frd("depth_m", np.array([5.0]), Frame(), is_height=True)[1] == 5.0


@given(st.sampled_from(["yaw_rad", "pitch_rad", "sway_m_s", "x_m", "y_m", "depth_m"]), st.floats(-10, 10))
def test_turning_twice_changes_nothing(signal, value):
    once = to_ned_frd(signal, np.array([value]), ROS, is_height=True)
    twice = to_ned_frd(*once, ROS, is_height=True)
    assert twice[0] == signal
    assert twice[1][0] == pytest.approx(value, abs=1e-12)


def test_a_quaternion_of_zeros_is_no_attitude():
    assert np.isnan(np.concatenate(angles_of_quaternion(np.zeros((2, 4)), ROS))).all()


def test_pitch_keeps_its_digits_near_the_vertical():
    pitch = np.array([math.pi / 2 - 1e-6])
    q = quaternion_of_angles(np.array([0.3]), pitch, np.array([0.0]))
    assert angles_of_quaternion(q, Frame())[1][0] == pytest.approx(pitch[0], abs=1e-9)


@given(st.lists(st.floats(-1.0, 1.0), min_size=2, max_size=50))
def test_a_wrapped_heading_comes_back_unwrapped_up_to_whole_turns(steps):
    heading = np.cumsum(steps)
    wrapped = (heading + math.pi) % (2 * math.pi) - math.pi
    off = unwrapped(wrapped) - heading
    np.testing.assert_allclose(off, off[0], atol=1e-9)


def test_unwrapping_leaves_gaps_and_small_steps_alone():
    heading = np.array([3.0, np.nan, -3.0, -2.9])
    np.testing.assert_allclose(unwrapped(heading), [3.0, np.nan, 2 * math.pi - 3.0, 2 * math.pi - 2.9])
    small = np.array([0.1, 0.3, -0.2])
    assert (unwrapped(small) == small).all()


@pytest.mark.parametrize("middle", [0.02, -0.02, math.pi, 1.0])
@pytest.mark.parametrize("begin", [0.0, -math.pi, -2.0 * math.pi])
def test_a_roll_that_its_logger_wraps_comes_back_about_level(middle, begin):
    roll = middle + 0.05 * np.sin(np.arange(200.0))
    roll[7] = np.nan
    turned = about_level((roll - begin) % (2.0 * math.pi) + begin)
    off = (turned - roll)[np.isfinite(roll)]
    assert np.isnan(turned[7])
    np.testing.assert_allclose(off, 2.0 * math.pi * round(off[0] / (2.0 * math.pi)), atol=1e-12)
    assert abs(np.nanmedian(turned)) <= math.pi + 0.1


def test_a_roll_that_is_level_and_one_beyond_a_turn_stay_as_they_are():
    level, degrees = np.array([0.1, -0.2, 0.0]), np.array([-20.0, 5.0, 355.0])
    assert (about_level(level) == level).all()
    assert about_level(degrees) is degrees
