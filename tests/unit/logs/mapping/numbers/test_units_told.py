"""A unit that nothing states is told by other signals, or said to be assumed."""

import numpy as np
import pytest
from look_alikes import truth, write_table

from fieldsid.logs import load_run
from fieldsid.logs.inspection import inspect_log
from fieldsid.logs.mapping.mapping_file import mapping_of

TRUTH = truth()


def table(tmp_path, **columns):
    named = {"time": TRUTH["time_s"]} | {name: TRUTH[signal] / factor for name, (signal, factor) in columns.items()}
    return write_table(tmp_path / "log.csv", named)


def read_as_proposed(log):
    found = inspect_log(log)
    return load_run(log, mapping_of(found.proposal.body)), {n.code: n for n in found.notes}


@pytest.mark.parametrize("factor", [0.514444, 0.44704, 0.277778, 0.3048, 0.01], ids=["kn", "mph", "km/h", "ft/s", "cm/s"])
def test_a_speed_without_a_unit_is_checked_against_the_way_made(tmp_path, factor):
    log = table(tmp_path, heading=("yaw_rad", 1.0), speed=("surge_m_s", factor), x=("x_m", 1.0), y=("y_m", 1.0))
    run, _ = read_as_proposed(log)
    np.testing.assert_allclose(np.median(run["surge_m_s"]), 1.5, rtol=0.01)
    assert "speed_unit" not in {n.code for n in run.notes}


def test_a_depth_without_a_unit_is_checked_against_speed_and_pitch(tmp_path):
    log = table(tmp_path, heading_deg=("yaw_rad", np.pi / 180), pitch_deg=("pitch_rad", np.pi / 180),
                speed_m_s=("surge_m_s", 1.0), depth=("depth_m", 0.3048))  # fmt: skip
    run, notes = read_as_proposed(log)
    np.testing.assert_allclose(run["depth_m"], TRUTH["depth_m"], rtol=1e-5)
    assert "0.3" in notes["evidence"].message or "`unit: ft`" in notes["evidence"].message
    assert "unit_assumed" not in notes


def test_what_no_name_and_no_other_signal_tells_is_said_to_be_assumed(tmp_path):
    log = table(tmp_path, heading_deg=("yaw_rad", np.pi / 180), speed=("surge_m_s", 0.5144), depth=("depth_m", 0.3048))
    _, notes = read_as_proposed(log)
    assert notes["unit_assumed"].data["signals"] == ["depth_m", "surge_m_s"]
    assert "surge_m_s from `speed` in m/s" in notes["unit_assumed"].message


def test_units_that_are_stated_or_agree_with_others_are_not_assumed(tmp_path):
    log = table(tmp_path, HeadDeg=("yaw_rad", np.pi / 180), gyro_z=("yaw_rate_rad_s", 1.0), SpeedKts=("surge_m_s", 0.514444),
                x=("x_m", 1.0), y=("y_m", 1.0), RudderDeg=("rudder_rad", np.pi / 180))  # fmt: skip
    run, notes = read_as_proposed(log)
    assert "unit_assumed" not in notes
    for signal in ("yaw_rad", "yaw_rate_rad_s", "rudder_rad", "x_m"):
        np.testing.assert_allclose(run[signal], TRUTH[signal], atol=1e-5)
    np.testing.assert_allclose(run["surge_m_s"], TRUTH["surge_m_s"], rtol=1e-5)


def test_a_speed_that_makes_too_much_way_in_a_turn_of_the_propeller_is_found(tmp_path):
    columns = {"time": TRUTH["time_s"], "heading_deg": np.degrees(TRUTH["yaw_rad"]), "speed": 100.0 * TRUTH["surge_m_s"],
               "rpm": 900.0 + 0.0 * TRUTH["time_s"]}  # fmt: skip
    _, notes = read_as_proposed(write_table(tmp_path / "log.csv", columns))
    assert "speed_unit" in notes


def test_the_counts_of_a_servo_are_known_in_joined_tables_as_in_one(tmp_path):
    write_table(tmp_path / "imu.csv", {"time": TRUTH["time_s"], "heading": np.degrees(TRUTH["yaw_rad"]) % 360.0})
    pulses = np.round(1500.0 + 800.0 * TRUTH["rudder_rad"])
    write_table(tmp_path / "act.csv", {"time": TRUTH["time_s"] + 0.01, "rudder": pulses})
    found = inspect_log(tmp_path).proposal.body["signals"]["rudder_rad"]
    assert found == {"topic": "act", "field": "rudder", "unit": "counts", "centre": 1500}


def test_a_heading_from_0_to_360_stays_in_degrees_beside_a_rate_of_turn_per_minute(tmp_path):
    time = np.arange(0.0, 200.0, 0.1)
    heading = np.pi + 1.1 * np.sin(0.4 * time)  # never wraps, and turns by more than 229 degrees a minute
    rate = np.gradient(heading, time)
    named = {"time": time, "Heading": np.degrees(heading), "Rate of Turn": 60.0 * np.degrees(rate), "rudder": 0.2 * np.sin(time)}
    found = inspect_log(write_table(tmp_path / "log.csv", named))
    signals = found.proposal.body["signals"]
    assert (signals["yaw_rad"]["unit"], signals["yaw_rate_rad_s"]["unit"]) == ("deg", "deg/min")
    run = load_run(tmp_path / "log.csv", mapping_of(found.proposal.body))
    np.testing.assert_allclose(run["yaw_rate_rad_s"], rate, atol=1e-3)
    assert "unit" not in {n.code for n in run.notes}


@pytest.mark.parametrize("goal", ["steps", "wrapping"])
def test_a_setpoint_in_rad_beside_a_heading_in_degrees_is_in_rad(tmp_path, goal):
    time = np.arange(0.0, 100.0, 0.1)
    wanted = np.where(time < 50.0, 1.0, 2.5) if goal == "steps" else (0.2 * time + np.pi) % (2.0 * np.pi) - np.pi
    heading = wanted + 0.05 * np.sin(time)
    named = {"time": time, "heading": np.degrees(heading) % 360.0, "yaw_setpoint": wanted, "rudder": 0.2 * np.sin(time)}
    signals = inspect_log(write_table(tmp_path / "log.csv", named)).proposal.body["signals"]
    assert (signals["yaw_rad"]["unit"], signals["yaw_goal_rad"]["unit"]) == ("deg", "rad")
    named["yaw_setpoint"] = np.degrees(wanted) % 360.0
    signals = inspect_log(write_table(tmp_path / "log.csv", named)).proposal.body["signals"]
    assert signals["yaw_goal_rad"]["unit"] == "deg"


def test_a_stamp_is_no_speed_whatever_its_name(tmp_path):
    named = {"time": TRUTH["time_s"], "last_speed_update": 1.7e9 + np.floor(TRUTH["time_s"]), "current_speed": TRUTH["surge_m_s"],
             "heading_deg": np.degrees(TRUTH["yaw_rad"]), "rudder_deg": np.degrees(TRUTH["rudder_rad"])}  # fmt: skip
    assert (
        inspect_log(write_table(tmp_path / "log.csv", named)).proposal.body["signals"]["surge_m_s"]["column"] == "current_speed"
    )
