"""Logs that nobody here wrote: the towing tank's tables, the vehicle logs, bags of other tools."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from bags import KINDS, MAPPING, write_bag

from fieldsid.errors import FieldsidError, LogError
from fieldsid.logs import load_run, segment
from fieldsid.logs.inspection import inspect_log, write_proposal
from fieldsid.logs.mapping.mapping_file import mapping_of

pytestmark = pytest.mark.field

TANK = {
    "time": {"column": 0},
    "signals": {
        "x_m": 1,
        "y_m": 2,
        "yaw_rad": {"column": 3, "unit": "deg"},
        "surge_m_s": 4,
        "sway_m_s": 5,
        "yaw_rate_rad_s": {"column": 6, "unit": "deg/s"},
        "rudder_rad": {"column": 8, "unit": "deg"},
    },
}


def columns_of(log):
    return {s: item["column"] for s, item in inspect_log(log).proposal.body["signals"].items()}


def test_the_tanks_columns_are_known_by_their_numbers_the_rudder_beside_a_roll_that_goes_with_it(shared_data):
    wanted = {s: item if isinstance(item, int) else item["column"] for s, item in TANK["signals"].items()}
    for log in sorted((shared_data / "kvlcc2").glob("*.dat")):
        found = columns_of(log)
        assert found.items() <= wanted.items()
        assert wanted.keys() - found.keys() <= {"sway_m_s"}


@pytest.mark.parametrize(
    "flight", ["zigzag_v1.90", *(pytest.param(f, marks=pytest.mark.slow) for f in ("zigzag_v1.00", "rudder_v1.50"))]
)
def test_a_vehicles_noisy_columns_without_names_are_told_apart(shared_data, tmp_path, flight):
    table = pd.read_csv(shared_data / "lauv" / f"{flight}.csv.gz")
    table.to_csv(tmp_path / "log.dat", header=False, index=False, sep=" ")
    found = columns_of(tmp_path / "log.dat")
    assert {s: table.columns[c] for s, c in found.items()} == {s: s for s in found}
    assert {"yaw_rad", "yaw_rate_rad_s", "surge_m_s", "x_m", "y_m", "rudder_rad"} <= found.keys()


def test_the_tanks_tables_come_in_by_index(shared_data):
    logs = sorted((shared_data / "kvlcc2").glob("*.dat"))
    assert len(logs) == 5
    for log in logs:
        run = load_run(log, mapping_of(TANK))
        rows = [line.split() for line in log.read_text(encoding="cp1252").splitlines()[4:] if line.strip()]
        np.testing.assert_array_equal(run.time, [float(r[0]) for r in rows])
        np.testing.assert_allclose(run["yaw_rate_rad_s"], np.radians([float(r[6]) for r in rows]), atol=1e-15)
        assert not {n.code for n in run.notes} & {"unit", "rate_sign", "rate_scale", "swapped", "speed_unit", "clock_offset"}
        found = segment(run, "yaw")
        assert found.end_s - found.start_s > 0.5 * (run.time[-1] - run.time[0])


def test_the_vehicle_logs_need_no_mapping_and_have_no_fault(shared_data):
    logs = sorted((shared_data / "lauv").glob("*.csv.gz"))
    assert len(logs) > 30
    for log in logs:
        run = load_run(log)
        table = pd.read_csv(log)
        assert len(run) == len(table)
        np.testing.assert_array_equal(run["rudder_rad"], table["rudder_rad"])
        lost = [n.data["times_s"] for n in run.notes if n.code == "wrap_interpolated"]
        turns = ((run["yaw_rad"] - table["yaw_rad"]) / (2 * np.pi))[~np.isin(run.time, lost)]
        np.testing.assert_allclose(turns, np.round(turns), atol=1e-12)
        assert np.abs(np.diff(run["yaw_rad"])).max() < 0.1
        assert {n.code for n in run.notes} <= {"constant", "wrap_interpolated"}


LINES_S = {
    "circle_half_stbd_v1.25": [20.75],
    "circle_port_v1.50": [18.85],
    "circle_stbd_v1.00": [44.15],
    "circle_stbd_v1.50": [30.45, 45.35],
    "circle_stbd_v1.70": [14.75],
    "circle_stbd_v1.90": [14.15],
    "uturn_v1.70": [14.75],
    "uturn_v1.90": [14.15],
}


def test_headings_interpolated_across_their_wrap_follow_the_rate(shared_data):
    for log in sorted((shared_data / "lauv").glob("*.csv.gz")):
        run = load_run(log)
        lost = [t for n in run.notes if n.code == "wrap_interpolated" for t in n.data["times_s"]]
        assert lost == pytest.approx(LINES_S.get(log.name.removesuffix(".csv.gz"), []))
        rate = run["yaw_rate_rad_s"]
        turned = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(run.time))])
        np.testing.assert_allclose(run["yaw_rad"] - run["yaw_rad"][0], turned, atol=0.1)


def test_pulse_runs_are_cut_from_before_the_pulses_to_the_recovery(shared_data):
    for log in sorted((shared_data / "lauv").glob("rudder_*.csv.gz")):
        found = segment(load_run(log), "yaw")
        assert found.start_s == pytest.approx(13.0, abs=0.1)
        assert 35.0 < found.end_s < 50.0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", [pytest.param("rudder_v1.50", marks=pytest.mark.slow), "uturn_v1.90"])
def test_a_vehicle_log_through_ros_and_back_is_the_same_log(shared_data, tmp_path, kind, name):
    log = shared_data / "lauv" / f"{name}.csv.gz"
    table = pd.read_csv(log)
    bag = write_bag(tmp_path / "bag", kind, {c: table[c].to_numpy(dtype=float) for c in table.columns})
    ours, theirs = load_run(bag, mapping_of(MAPPING)), load_run(log)
    np.testing.assert_array_equal(ours.time, theirs.time)
    for signal in ours.signals:
        np.testing.assert_allclose(ours[signal], theirs[signal], atol=1e-12, rtol=0, err_msg=signal)


def test_a_real_robots_bag_is_understood(shared_data, tmp_path):
    log = shared_data / "bags" / "husky_jackal_odom_imu.bag"
    found = inspect_log(log)
    assert {c.kind for c in found.inventory.channels} == {"sensor_msgs/msg/Imu", "nav_msgs/msg/Odometry"}
    run = load_run(log, write_proposal(found, tmp_path / "m.yaml"))
    assert len(run) > 3000
    assert {"yaw_rad", "yaw_rate_rad_s", "surge_m_s"} <= set(run.signals)
    codes = {n.code for n in run.notes}
    assert "no_fin" in codes
    assert not codes & {"unit", "rate_sign", "swapped"}


@pytest.mark.parametrize("name", ["example-lz4.bag", "ros2/talker_mcap", "ros2/talker_db3", "ros2/talker_db3/talker.db3"])
def test_bags_of_other_tools_are_listed(shared_data, name):
    found = inspect_log(shared_data / "bags" / name)
    assert sum(c.count for c in found.inventory.channels) >= 20


@pytest.mark.parametrize("name", ["no-messages.bag", "ros2/empty_db3", "ros2/empty_db3/empty_bag_0.db3"])
def test_a_bag_without_messages_is_a_clear_error(shared_data, name):
    with pytest.raises(LogError, match="has no messages") as error:
        inspect_log(shared_data / "bags" / name)
    assert error.value.found
    with pytest.raises(FieldsidError, match="has no"):
        load_run(shared_data / "bags" / name, mapping_of(MAPPING))


TURTLE = {"signals": {"yaw_rad": {"topic": "/turtle1/pose", "field": "theta"}}}


def test_a_compressed_bag_that_is_cut_after_its_block_is_whole(shared_data, tmp_path):
    whole = shared_data / "bags" / "example-lz4.bag"
    cut = tmp_path / "cut.bag"
    cut.write_bytes(whole.read_bytes()[: int(0.9 * whole.stat().st_size)])
    run, full = (load_run(log, mapping_of(TURTLE), salvage=True) for log in (cut, whole))
    np.testing.assert_array_equal(run["yaw_rad"], full["yaw_rad"])
    assert "truncated" in {n.code for n in run.notes}


@pytest.mark.parametrize("share", [0.2, 0.5])
def test_a_compressed_bag_that_is_cut_inside_its_only_block_says_that_all_is_lost(shared_data, tmp_path, share):
    whole = (shared_data / "bags" / "example-lz4.bag").read_bytes()
    cut = tmp_path / "cut.bag"
    cut.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(LogError, match="has no messages") as error:
        load_run(cut, mapping_of(TURTLE), salvage=True)
    assert "is cut: 0 of its" in error.value.found
