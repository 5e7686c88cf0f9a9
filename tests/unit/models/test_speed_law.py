"""How base parameters move with speed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldsid.models.axis import Axis
from fieldsid.models.speed_law import SpeedLaw, with_speed

GROUPS = SpeedLaw(1.5, 0.8, 2.0, ((1.0, -0.6), (1.5, -1.5), (2.0, -2.4)))


def test_one_run_scales_damping_by_u_and_authority_by_u_squared():
    law = SpeedLaw(1.5)
    assert law.damping_factor(3.0) == pytest.approx(2.0)
    assert law.authority(3.0, -1.5) == pytest.approx(-6.0)


@pytest.mark.parametrize(("speed", "value"), GROUPS.points)
def test_a_group_speed_gives_the_groups_own_authority(speed, value):
    assert GROUPS.authority(speed, -1.5) == pytest.approx(value)


def test_beyond_the_groups_the_power_law_goes_on_from_the_nearest():
    assert GROUPS.authority(4.0, -1.5) == pytest.approx(-2.4 * 4.0)
    assert GROUPS.authority(0.5, -1.5) == pytest.approx(-0.6 / 4.0)


@pytest.mark.parametrize("speed", [0.97, 1.03, 1.46, 1.54, 1.95, 2.05])
def test_a_speed_that_a_groups_runs_may_have_is_that_groups(speed):
    nearest, authority = min(GROUPS.points, key=lambda p: abs(p[0] - speed))
    assert GROUPS.authority(speed, -1.5) == pytest.approx(authority * (speed / nearest) ** 2)


def test_neighbours_a_groups_width_apart_share_what_is_between_them():
    near = SpeedLaw(1.0, 1.0, 2.0, ((1.0, -1.0), (1.06, -1.2)))
    over_law = [near.authority(u, -1.0) / u**2 for u in np.geomspace(1.0, 1.06, 61)]
    assert np.all(np.diff(over_law) <= 1e-12)
    assert over_law[30] == pytest.approx(0.5 * (over_law[0] + over_law[-1]))


def test_one_group_alone_goes_with_u_squared():
    assert SpeedLaw(1.5, points=((1.5, -1.5),)).authority(3.0, -1.5) == pytest.approx(-6.0)


@pytest.mark.parametrize("speed", [float("nan"), 0.0, -1.0])
def test_a_speed_that_is_not_known_leaves_the_reference_values(speed):
    assert GROUPS.scale(speed) == 1.0
    assert SpeedLaw(1.5).authority(speed, -1.5) == -1.5


@pytest.mark.parametrize(("speed", "expected"), [(1.08, 1.0), (1.45, 1.5), (1.25, 1.25)])
def test_a_speed_near_a_group_counts_as_its_speed_where_runs_snap(speed, expected):
    assert SpeedLaw(1.5, points=GROUPS.points, snap=0.12).effective(speed) == pytest.approx(expected)


@given(st.floats(0.3, 5.0), st.floats(0.3, 5.0))
def test_authority_grows_with_speed(one, two):
    slow, fast = sorted([one, two])
    assert abs(GROUPS.authority(slow, -1.5)) <= abs(GROUPS.authority(fast, -1.5)) * (1 + 1e-9)
    assert np.isfinite(GROUPS.authority(slow, -1.5))


def test_only_what_moves_with_speed_is_shown_with_it():
    assert [with_speed(n, Axis.YAW, 1.4, trim_of_fin=True) for n in ("a22", "b2", "C0", "delta_r0", "lag")] == [
        "a22@1.4", "b2@1.4", "C0@1.4", "delta_r0", "lag",
    ]  # fmt: skip
    assert [with_speed(n, Axis.PITCH, 1.4, trim_of_fin=False) for n in ("c22", "c23", "d2", "Cb", "delta_s0")] == [
        "c22@1.4", "c23", "d2@1.4", "Cb", "delta_s0@1.4",
    ]  # fmt: skip
    assert with_speed("b2", Axis.YAW, float("nan"), trim_of_fin=True) == "b2"
