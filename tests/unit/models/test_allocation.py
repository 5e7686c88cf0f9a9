"""Several fins of one plane: what each is told for a command, within its limit, and what of a vehicle.yaml is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from fieldsid.errors import VehicleError
from fieldsid.models.allocation import Fins, plane_fins_of
from fieldsid.records.keys import body_of
from fieldsid.vehicle import vehicle_of

X = Fins(("a", "b", "c", "d"), (0.25, 0.25, -0.25, -0.25), (0.25, -0.25, 0.25, -0.25), (0.35,) * 4)
BOAT = {"names": ["port", "stbd"], "to_rudder": [-0.01, 0.01], "limits": [30, 20], "unit": "N"}


def test_an_x_tail_moves_each_fin_by_the_rudder_and_the_elevator():
    assert_allclose(X.fin_commands(0.1, 0.05)[:, 0], [0.15, 0.05, -0.05, -0.15])
    assert_allclose(X.of("yaw").shares, [1, 1, -1, -1])
    assert_allclose(X.of("pitch").shares, [1, -1, 1, -1])
    assert X.of("yaw").reach == pytest.approx(0.35)


def test_the_least_fins_that_make_a_command_of_rows_that_are_not_apart():
    """Worked by hand: rows (1, 0) and (1, 1) give fin 1 = rudder, fin 2 = elevator - rudder."""
    fins = Fins(("a", "b"), (1.0, 0.0), (1.0, 1.0), (1.0, 1.0))
    assert_allclose(fins.fin_commands(0.2, 0.5)[:, 0], [0.2, 0.3])
    assert_allclose(fins.of("yaw").shares, [1.0, -1.0])


@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_no_fin_goes_beyond_its_limit_and_the_command_keeps_its_direction(rudder, elevator):
    commands = X.fin_commands(rudder, elevator)
    assert (np.abs(commands) <= 0.35 * (1 + 1e-12)).all()
    back = np.array([v[0] for v in X.rudder_and_elevator(commands)])
    share = min(1.0, 0.35 / max(abs(rudder) + abs(elevator), 1e-300))
    assert_allclose(back, [rudder * share, elevator * share], atol=1e-12)


def test_thrusters_of_unequal_limits_reach_as_far_as_the_weaker():
    vehicle = vehicle_of({"name": "boat", "fins": BOAT})
    fins = vehicle.fins.of("yaw")
    assert_allclose(fins.shares, [-50.0, 50.0])
    assert vehicle.rudder_max_rad == pytest.approx(0.4)  # 20 N at 50 N a rad
    assert vehicle.fin_max_rad("pitch") is None
    assert_allclose(fins.fin_commands([0.4, 0.8]), [[-20.0, -20.0], [20.0, 20.0]])


def test_a_stated_limit_below_the_fins_reach_stays():
    vehicle = vehicle_of(
        {"name": "a", "rudder_max_rad": 0.2, "fins": {"names": ["a", "b"], "to_rudder": [0.5, 0.5], "limits": 0.3}}
    )
    assert vehicle.rudder_max_rad == 0.2
    assert vehicle.signal_limits == {"rudder_rad": 0.2}


@pytest.mark.parametrize(
    ("fins", "says"),
    [
        ({"names": ["a", "a"], "to_rudder": [1, 1], "limits": 0.3}, "are the same"),
        ({"names": ["a", "b"], "limits": 0.3}, "one of `to_rudder` and `to_elevator` is needed"),
        ({"names": ["a", "b"], "to_rudder": [1], "limits": 0.3}, "1 numbers for 2 fins"),
        ({"names": ["a", "b"], "to_rudder": [1, 1], "limits": [0.3]}, "`limits` has 1 numbers for 2 fins"),
        ({"names": ["a", "b"], "to_rudder": [0, 0], "limits": 0.3}, "zero for every fin"),
        ({"names": ["a", "b"], "to_rudder": [1, -1], "to_elevator": [-2, 2], "limits": 0.3}, "the same fins in the same way"),
        ({"names": ["a", "b"], "to_rudder": [1, 1], "limits": 0}, "limits"),
        ({"names": ["a", "b"], "to_rudder": [1, 1], "limits": 0.3, "to_yaw": [1, 1]}, "to_yaw"),
        ({"names": ["fin 1"], "to_rudder": [1], "limits": 0.3}, "names"),
    ],
)
def test_fins_that_cannot_be_meant_are_refused(fins, says):
    with pytest.raises(VehicleError) as caught:
        vehicle_of({"name": "a", "fins": fins})
    assert says in f"{caught.value.what} {caught.value.found}"


def test_a_limit_beyond_the_fins_reach_is_refused_with_the_one_to_write():
    with pytest.raises(VehicleError, match="more than the fins reach") as caught:
        vehicle_of({"name": "a", "rudder_max_rad": 0.5, "fins": {"names": ["a", "b"], "to_rudder": [0.5, 0.5], "limits": 0.35}})
    assert "`rudder_max_rad: 0.35`" in caught.value.hint


def test_fins_come_back_from_a_file():
    fins = X.of("yaw")
    assert plane_fins_of(body_of(fins)) == fins
    with pytest.raises(ValueError, match="a share and a limit"):
        plane_fins_of(body_of(fins) | {"limits": [0.3]})
