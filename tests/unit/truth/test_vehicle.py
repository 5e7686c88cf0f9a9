"""The six-degree-of-freedom REMUS trims, turns and obeys its fins as the published vehicle does."""

from __future__ import annotations

import numpy as np
import pytest
from truth.hull import REMUS, STEADY, inverse_mass, with_fins, yaw_plane
from truth.pilots import Autopilot, excited, steady_turn, zigzagging
from truth.remus_cases import remus_case
from truth.vehicle import QUIET, Fins, Sea, fly_vehicle, thrust_for


def test_thrust_at_the_published_cruise_is_the_published_one():
    assert thrust_for(1.54) == pytest.approx(3.86, rel=0.01)


def test_published_hull_is_unstable_in_yaw_and_bigger_fins_steady_it():
    assert np.linalg.eigvals(yaw_plane(REMUS, 1.54)[0]).real.max() > 0.1
    assert np.linalg.eigvals(yaw_plane(STEADY, 1.54)[0]).real.max() < -0.1


def test_fin_area_of_one_changes_nothing():
    assert with_fins(REMUS, 1.0) == REMUS


def test_mass_matrix_is_symmetric_and_positive():
    inverse = inverse_mass(REMUS)
    assert inverse == pytest.approx(inverse.T)
    assert np.linalg.eigvalsh(inverse).min() > 0


@pytest.mark.parametrize("hull", [REMUS, STEADY], ids=["published", "bigger fins"])
def test_straight_running_trims_out(hull):
    truth = fly_vehicle(Autopilot(depth=5.0), 120.0, hull=hull, sensors=QUIET).truth
    end = {name: float(values[-1]) for name, values in truth.items()}
    assert end["depth_m"] == pytest.approx(5.0, abs=1.0)
    assert abs(end["yaw_rad"]) < 0.05
    assert end["surge_m_s"] == pytest.approx(1.5, abs=0.08)
    # 7 N of buoyancy are carried by a body that runs slightly nose down
    assert -0.1 < end["pitch_rad"] < 0.0
    assert end["roll_rad"] == pytest.approx(-0.543 / (0.0196 * 299.0), abs=0.02)  # propeller torque against righting moment


def test_steady_turn_is_of_the_vehicles_scale_and_tighter_with_more_rudder():
    hard, gentle = steady_turn(-0.26), steady_turn(-0.1)
    assert 3.0 < hard["radius_m"] < gentle["radius_m"] < 15.0
    assert hard["speed_m_s"] < gentle["speed_m_s"] < 1.54
    assert hard["rate_rad_s"] > 0.0  # negative rudder turns to starboard
    assert hard["drift_rad"] < 0.0  # and the bow points into the turn


def test_track_of_a_turn_is_the_circle_its_speed_and_rate_say():
    truth = fly_vehicle(lambda t, m: (-0.2, Autopilot(heading=None)(t, m)[1]), 120.0, sensors=QUIET).truth
    late = truth["time_s"] > 80.0
    x, y = truth["x_m"][late], truth["y_m"][late]
    design = np.stack([x, y, np.ones(x.size)], axis=1)
    a, b, c = np.linalg.lstsq(design, x**2 + y**2, rcond=None)[0]
    assert np.sqrt(c + a * a / 4 + b * b / 4) == pytest.approx(steady_turn(-0.2)["radius_m"], rel=0.02)


def test_current_carries_the_vehicle_and_leaves_its_motion_through_the_water():
    still = fly_vehicle(Autopilot(), 30.0, sensors=QUIET).truth
    carried = fly_vehicle(Autopilot(), 30.0, sensors=QUIET, sea=Sea(current=(0.3, -0.2))).truth
    t = still["time_s"]
    assert carried["x_m"] - still["x_m"] == pytest.approx(0.3 * t, abs=1e-6)
    assert carried["y_m"] - still["y_m"] == pytest.approx(-0.2 * t, abs=1e-6)
    assert carried["yaw_rate_rad_s"] == pytest.approx(still["yaw_rate_rad_s"], abs=1e-9)


def test_fins_lag_stop_and_wait_as_told():
    fins = Fins(delay=0.12, lag=0.2, limit=0.2)
    flight = fly_vehicle(lambda t, _m: (0.3 if t >= 1.0 - 1e-9 else 0.0, 0.0), 4.0, fins=fins, sensors=QUIET)
    t, angle = flight.truth["time_s"], flight.truth["rudder_rad"]
    assert flight.log["rudder_rad"].max() == 0.2
    after = t + 0.05 - 1.0 - 0.12  # the angle kept is that at the end of the interval
    assert angle == pytest.approx(np.where(after > 0, 0.2 * (1 - np.exp(-np.maximum(after, 0.0) / 0.2)), 0.0), abs=2e-3)


def test_program_overrides_one_fin_and_the_pilot_recovers():
    times = np.arange(0.0, 20.0, 0.05)
    program = np.where((times >= 2) & (times < 4), 0.26, np.nan)
    flight = fly_vehicle(excited(Autopilot(), "yaw", times, program), 40.0, sensors=QUIET, run_up=Autopilot(), run_up_s=20.0)
    log = flight.log
    assert log["rudder_rad"][(log["time_s"] > 2.02) & (log["time_s"] < 3.98)] == pytest.approx(0.26)
    assert np.abs(log["yaw_rad"]).max() > 0.2
    assert abs(log["yaw_rad"][-1]) < 0.05


@pytest.mark.parametrize("axis", ["yaw", "pitch"])
def test_zigzag_swings_to_both_sides(axis):
    pilot = Autopilot(depth=None if axis == "pitch" else 5.0)
    log = fly_vehicle(zigzagging(pilot, axis, fin=0.17, angle=0.2), 60.0, sensors=QUIET).log
    fin = log["rudder_rad" if axis == "yaw" else "elevator_rad"]
    assert np.count_nonzero(np.diff(np.sign(fin[np.abs(fin) == 0.17]))) >= 4


def test_same_seed_same_flight_and_noise_of_the_asked_size():
    one, two = (fly_vehicle(Autopilot(), 20.0, seed=3) for _ in range(2))
    assert np.array_equal(one.log["yaw_rad"], two.log["yaw_rad"])
    noise = one.log["yaw_rate_rad_s"] - one.truth["yaw_rate_rad_s"]
    assert np.std(noise) == pytest.approx(0.3 * np.pi / 180, rel=0.1)


def test_remus_case_shows_effects_beyond_the_base_model():
    case = remus_case(0, 1)
    assert case.visible
    assert case.ratio > 2.0
    assert remus_case(0, 1).ratio == case.ratio
