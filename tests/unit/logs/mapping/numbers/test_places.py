"""Latitude and longitude known by their numbers, or taken from names and stamps that only look like other signals."""

import numpy as np
import pytest
from look_alikes import SPEED, truth, write_table

from fieldsid.errors import LogError
from fieldsid.logs import load_run
from fieldsid.logs.convert.units import UNITS
from fieldsid.logs.inspection import inspect_log, write_proposal

KNOT = UNITS["kn"].factor

TRUTH = truth(noise=0.0)
LATITUDE_DEG, LONGITUDE_DEG = 57.05, 9.87
METRE_DEG = np.degrees(1.0 / 6.378e6)
GEOGRAPHIC = {
    "lat": LATITUDE_DEG + METRE_DEG * TRUTH["x_m"],
    "lon": LONGITUDE_DEG + METRE_DEG * TRUTH["y_m"] / np.cos(np.radians(LATITUDE_DEG)),
}
HEADING_DEG = np.degrees(TRUTH["yaw_rad"]) % 360.0
RUDDER_DEG = np.degrees(TRUTH["rudder_rad"])


def read_as_proposed(log):
    found = inspect_log(log)
    return found, load_run(log, write_proposal(found, log.with_suffix(".yaml")))


def without_header(log):
    log.write_text("\n".join(log.read_text().splitlines()[1:]) + "\n")
    return log


def test_degrees_of_the_globe_without_a_name_are_no_metres(tmp_path):
    columns = {
        "t": TRUTH["time_s"],
        **GEOGRAPHIC,
        "h": HEADING_DEG,
        "v": SPEED / KNOT + 0.01 * np.sin(TRUTH["time_s"]),
    }
    found, run = read_as_proposed(without_header(write_table(tmp_path / "boat.csv", columns)))
    assert found.proposal.body["signals"]["position"] == {"columns": [1, 2]}
    assert found.proposal.body["signals"]["surge_m_s"] == {"column": 4, "unit": "kn"}
    for name in ("x_m", "y_m"):
        np.testing.assert_allclose(run[name] - run[name][0], TRUTH[name] - TRUTH[name][0], atol=0.01 * np.ptp(TRUTH[name]))


def test_metres_without_a_name_stay_metres(tmp_path):
    columns = {"t": TRUTH["time_s"], "x": TRUTH["x_m"], "y": TRUTH["y_m"], "h": HEADING_DEG}
    found, _ = read_as_proposed(without_header(write_table(tmp_path / "boat.csv", columns)))
    assert {"x_m", "y_m"} <= found.proposal.body["signals"].keys()


def test_a_heading_without_a_name_is_the_column_along_which_a_named_way_is_made(tmp_path):
    columns = {"time": TRUTH["time_s"], "x": TRUTH["x_m"], "y": TRUTH["y_m"], "q1": HEADING_DEG,
               "q9": SPEED + 0.01 * np.sin(TRUTH["time_s"]), "rudder_deg": RUDDER_DEG}  # fmt: skip
    found, run = read_as_proposed(write_table(tmp_path / "boat.csv", columns))
    signals = found.proposal.body["signals"]
    assert signals["yaw_rad"] == {"column": "q1", "unit": "deg"}
    assert signals["surge_m_s"] == {"column": "q9", "unit": "m/s"}
    np.testing.assert_allclose(run["yaw_rad"] - run["yaw_rad"][0], TRUTH["yaw_rad"] - TRUTH["yaw_rad"][0], atol=1e-5)


def test_a_heading_beyond_a_turn_is_in_rad_where_its_course_turns_so_far(tmp_path):
    columns = {"time": TRUTH["time_s"], "x": TRUTH["x_m"], "y": TRUTH["y_m"], "yaw": TRUTH["yaw_rad"] + 8.0 * np.pi,
               "rudder": TRUTH["rudder_rad"]}  # fmt: skip
    found, run = read_as_proposed(write_table(tmp_path / "boat.csv", columns))
    assert "unit" not in found.proposal.body["signals"]["yaw_rad"]
    assert any("count turns" in n.message for n in found.notes)
    np.testing.assert_allclose(np.diff(run["yaw_rad"]), np.diff(TRUTH["yaw_rad"]), atol=1e-6)


def test_a_stamp_of_a_sensor_is_not_its_signal_and_a_wind_speed_is_no_speed(tmp_path):
    columns = {
        "time_s": TRUTH["time_s"], "estlat": GEOGRAPHIC["lat"], "estlon": GEOGRAPHIC["lon"], "ws_spd": 7.0 + 0.0 * HEADING_DEG,
        "gps_spd": SPEED + 0.01 * np.sin(TRUTH["time_s"]), "depth_ts": 1.7e9 + TRUTH["time_s"], "depth": TRUTH["depth_m"],
        "heading": HEADING_DEG, "rudder": RUDDER_DEG,
    }  # fmt: skip
    found, run = read_as_proposed(write_table(tmp_path / "boat.csv", columns))
    signals = found.proposal.body["signals"]
    assert signals["position"] == {"columns": ["estlat", "estlon"]}
    assert (signals["depth_m"]["column"], signals["surge_m_s"]["column"]) == ("depth", "gps_spd")
    np.testing.assert_allclose(run["depth_m"], TRUTH["depth_m"], atol=1e-6)


def test_a_speed_that_the_way_made_confirms_is_in_no_other_unit(tmp_path):
    fast = 8.5 / SPEED
    columns = {k: fast * TRUTH[k] if k in ("x_m", "y_m", "surge_m_s") else TRUTH[k] for k in TRUTH if k != "course_rad"}
    confirmed = inspect_log(write_table(tmp_path / "ship.csv", columns))
    alone = inspect_log(write_table(tmp_path / "alone.csv", {k: v for k, v in columns.items() if k not in ("x_m", "y_m")}))
    said = [{n.data.get("signal") for n in found.notes if n.code == "unit"} for found in (confirmed, alone)]
    assert said == [set(), {"surge_m_s"}]


@pytest.mark.parametrize("date", ["1969-11-31", "2014-00-07"])
def test_a_clock_counts_behind_a_date_that_no_calendar_has(tmp_path, date):
    stamps = [
        f"{date} {17 + s // 3600}:{s // 60 % 60:02d}:{s % 60 + 0.5 * (k % 2):04.1f}" for k, s in enumerate(np.arange(400) // 2)
    ]
    rows = [f"{k},{stamp},{30 * np.sin(0.05 * k):.4f},{10 * np.sign(np.sin(0.05 * k + 0.1)):g}" for k, stamp in enumerate(stamps)]
    log = tmp_path / "boat.csv"
    log.write_text("\n".join(["entry,gps_time,heading,rudder", *rows]) + "\n")
    found, run = read_as_proposed(log)
    assert found.proposal.body["time"] == {"column": "gps_time"}
    np.testing.assert_allclose(run.time, 0.5 * np.arange(400), atol=1e-9)
    assert "has no date" in next(n.message for n in found.notes if n.code == "time_origin")


def test_sentences_of_several_kinds_are_no_table(tmp_path):
    log = tmp_path / "receiver.txt"
    fixes = (
        f"$GPGGA,1014{k:02d},5703.48,N,00952.39,E,2,10,0.8,-1.9,M,40.6,M,1.5,0123\n$GPVTG,{k},T,1,M,5.2,N,9.7,K,D\n"
        for k in range(40)
    )
    log.write_text("".join(fixes))
    with pytest.raises(LogError, match="NMEA 0183"):
        inspect_log(log)


@pytest.mark.parametrize(("name", "is_said"), [("gps_head", True), ("heading", False)])
def test_a_heading_that_a_receiver_gives_is_said_to_be_one(tmp_path, name, is_said):
    columns = {"time_s": TRUTH["time_s"], name: HEADING_DEG, "rudder": RUDDER_DEG}
    found = inspect_log(write_table(tmp_path / "boat.csv", columns))
    assert any("course over ground" in n.message for n in found.notes) == is_said
