"""A proposed mapping is one that import takes, and gives the signals that were logged."""

import numpy as np
import pytest
from bags import KINDS, write_bag
from binary_logs import write_lsf
from ruamel.yaml import YAML

from fieldsid.artifacts import plain
from fieldsid.errors import ArtifactError
from fieldsid.logs import load_run
from fieldsid.logs.inspection import inspect_log, write_proposal
from fieldsid.logs.mapping.guesses import of_topic
from fieldsid.logs.mapping.mapping_file import mapping_of
from fieldsid.logs.mapping.word_meaning import meaning_of
from fieldsid.logs.reader import ChannelInfo, FieldInfo
from fieldsid.results.logs import inspected

TIME = 0.05 * np.arange(400)
TRUTH = {
    "time_s": TIME,
    "yaw_rad": 0.5 * np.sin(0.5 * TIME),
    "yaw_rate_rad_s": 0.25 * np.cos(0.5 * TIME),
    "surge_m_s": 1.5 + 0.1 * np.sin(TIME),
    "rudder_rad": 0.2 * np.sign(np.sin(0.5 * TIME + 0.01)),
}


def vendor_table(path):
    rows = zip(
        1e3 * TIME,
        np.degrees(TRUTH["yaw_rad"]),
        np.degrees(TRUTH["yaw_rate_rad_s"]),
        TRUTH["surge_m_s"],
        np.degrees(TRUTH["rudder_rad"]),
        strict=True,
    )
    lines = [
        "Time [ms];Heading;gyro_z;Speed (m/s);rudder cmd;mode",
        *(";".join(map(repr, map(float, r))) + ";AUTO" for r in rows),
    ]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_table_of_foreign_names_and_degrees_is_understood(tmp_path):
    log = vendor_table(tmp_path / "vendor.csv")
    mapping = write_proposal(inspect_log(log), tmp_path / "m.yaml")
    run = load_run(log, mapping)
    np.testing.assert_allclose(run.time, TIME, atol=1e-12)
    for name in TRUTH.keys() - {"time_s"}:
        np.testing.assert_allclose(run[name], TRUTH[name], atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_a_bag_of_standard_messages_is_understood(tmp_path, kind):
    log = write_bag(tmp_path / "bag", kind, TRUTH)
    mapping = write_proposal(inspect_log(log), tmp_path / "m.yaml")
    run = load_run(log, mapping)
    for name in TRUTH.keys() - {"time_s"}:
        np.testing.assert_allclose(run[name], TRUTH[name], atol=1e-12)


def test_a_canonical_table_needs_no_mapping_and_its_proposal_still_works(tmp_path):
    log = tmp_path / "run.csv"
    log.write_text("time_s,yaw_deg,rudder_rad\n0,1,0.1\n1,2,0.2\n2,3,0.1\n")
    found = inspect_log(log)
    assert found.needs_none
    np.testing.assert_allclose(load_run(log, write_proposal(found, tmp_path / "m.yaml"))["yaw_rad"], load_run(log)["yaw_rad"])


def test_columns_without_names_give_a_file_to_fill_in_and_say_so(tmp_path):
    log = tmp_path / "run.dat"
    log.write_text("0 1 2\n1 2 3\n2 3 4\n")
    found = inspect_log(log)
    assert "nothing_recognised" in {n.code for n in found.notes}
    assert "signals: {}" in found.yaml()
    assert "column: 0" in found.yaml()


def test_a_mapping_that_exists_is_kept(tmp_path):
    log = vendor_table(tmp_path / "vendor.csv")
    mine = tmp_path / "m.yaml"
    mine.write_text("mine")
    with pytest.raises(ArtifactError, match="exists"):
        write_proposal(inspect_log(log), mine)
    assert mine.read_text() == "mine"


def test_the_record_holds_what_the_page_shows(tmp_path):
    record = plain(inspected(inspect_log(vendor_table(tmp_path / "vendor.csv")), None))
    assert record["schema"] == "fieldsid/inspection/1"
    assert [c["name"] for c in record["channels"]][:2] == ["Time [ms]", "Heading"]
    assert record["mapping"]["signals"]["yaw_rad"]["unit"] == "deg"
    assert set(record["signals"]) == TRUTH.keys() - {"time_s"}


def test_of_a_gliders_table_only_what_is_measured_or_commanded_is_proposed(tmp_path):
    time = 1.6e9 + np.arange(100) * 4.3
    columns = {"m_present_time": time, "m_heading": 0.01 * np.arange(100), "u_heading_rate_deadband": 0.0 * time + 0.1,
               "u_reqd_depth_at_surface": 0.0 * time + 4.0, "c_fin": 0.1 * np.sign(np.sin(0.2 * np.arange(100)))}  # fmt: skip
    rows = "\n".join(" ".join(f"{v:.3f}" for v in row) for row in zip(*columns.values(), strict=True))
    (tmp_path / "a.dat").write_text(" ".join(columns) + "\n" + rows + "\n")
    body = inspect_log(tmp_path / "a.dat").proposal.body
    assert {s: i["column"] for s, i in body["signals"].items()} == {"yaw_rad": "m_heading", "rudder_rad": "c_fin"}
    assert body["time"]["unit"] == "s"


def test_the_row_of_units_says_that_a_yaw_in_degrees_a_second_is_the_rate(tmp_path):
    log = tmp_path / "units.asc"
    columns = (TIME, np.degrees(TRUTH["yaw_rad"]), np.degrees(TRUTH["yaw_rate_rad_s"]), np.degrees(TRUTH["rudder_rad"]))
    rows = "\n".join(" ".join(f"{v:.9f}" for v in row) for row in zip(*columns, strict=True))
    log.write_text("T heading yaw rudder\ns deg deg/s deg\n" + rows + "\n")
    proposal = inspect_log(log).proposal
    assert proposal.body["signals"]["yaw_rate_rad_s"] == {"column": "yaw", "unit": "deg/s"}
    assert not [note for note in proposal.notes if note.code == "alternatives"]


def test_a_table_written_from_messages_gives_its_quaternion_and_its_vectors(tmp_path):
    yaw = 0.4 + TRUTH["yaw_rad"]  # of a message's frame: from east, against the clock
    stem = "field.pose.pose.orientation."
    columns = {
        "%time": 1.7e18 + 1e9 * TIME,
        "field.header.seq": np.arange(TIME.size),
        "field.pose.pose.position.x": 1.5 * TIME,
        "field.pose.pose.position.y": 0.3 * TIME,
        **{f"{stem}{p}": v for p, v in zip("xyzw", (0 * yaw, 0 * yaw, np.sin(yaw / 2), np.cos(yaw / 2)), strict=True)},
        "field.twist.twist.linear.x": TRUTH["surge_m_s"],
        "field.twist.twist.angular.z": TRUTH["yaw_rate_rad_s"],
        "rudder": TRUTH["rudder_rad"],
    }
    log = tmp_path / "echo.csv"
    rows = "\n".join(",".join(f"{v:.9f}" for v in row) for row in zip(*columns.values(), strict=True))
    log.write_text(",".join(columns) + "\n" + rows + "\n")
    body = inspect_log(log).proposal.body
    assert body["frame"] == "ENU/FLU"
    assert body["signals"]["attitude"] == {"columns": [stem + p for p in "xyzw"]}
    run = load_run(log, write_proposal(inspect_log(log), tmp_path / "m.yaml"))
    np.testing.assert_allclose(np.diff(run["yaw_rad"]), -np.diff(yaw), atol=1e-7)
    np.testing.assert_allclose(run["yaw_rate_rad_s"], -TRUTH["yaw_rate_rad_s"], atol=1e-8)


def test_a_vector_of_four_numbers_that_is_no_rotation_is_none(tmp_path):
    log = tmp_path / "four.csv"
    rows = "\n".join(f"{0.1 * i},0.1,0.2,{i},4,{0.01 * i}" for i in range(60))
    log.write_text(f"time,a_x,a_y,a_z,a_w,heading\n{rows}\n")
    assert "attitude" not in inspect_log(log).proposal.body["signals"]


@pytest.mark.parametrize("name", ["PHI_HOST_PORT_DB", "yaw_gain", "u(2)", "x(3)"])
def test_names_that_hold_a_symbol_of_another_thing_name_no_signal(name):
    assert meaning_of(name) is None


@pytest.mark.parametrize(
    ("name", "signal"),
    [
        ("/auv/nav/state phi", "roll_rad"),
        ("est_psi_rad", "yaw_rad"),
        ("yaw (deg)", "yaw_rad"),
        ("HDT", "yaw_rad"),
        ("hdm_deg", "yaw_rad"),
    ],
)
def test_symbols_and_units_still_name_theirs(name, signal):
    assert meaning_of(name)[0] == signal


def test_a_roll_of_thousands_of_degrees_is_something_else(tmp_path):
    log = tmp_path / "port.csv"
    log.write_text("time,heading,roll\n" + "".join(f"{0.1 * i},{i},9001\n" for i in range(60)))
    assert "roll_rad" not in inspect_log(log).proposal.body["signals"]


def planar(name):
    fields = tuple(FieldInfo(path, "float64", (0.1, 0.2)) for path in ("x", "y", "theta"))
    return {g.signal: g for g in of_topic(ChannelInfo(name, "geometry_msgs/msg/Pose2D", 100, 10.0, fields))}


def test_a_pose_in_the_plane_gives_x_y_and_heading_and_a_commanded_one_the_goal():
    assert planar("/NED_pose").keys() == {"x_m", "y_m", "yaw_rad"}
    assert planar("/ref").keys() == {"yaw_goal_rad"}
    assert planar("/NED_pose")["x_m"].sure > planar("/ins_pose")["x_m"].sure


def test_an_estimated_position_comes_before_that_of_a_receiver_which_hears_nothing_under_water():
    for name, signal in (("lat", "latitude"), ("lon", "longitude")):
        assert meaning_of(name)[0] == meaning_of(f"{name}_gps")[0] == signal
        assert meaning_of(name)[1] > meaning_of(f"{name}_gps")[1]


def test_the_servos_of_a_log_that_does_not_say_which_moves_what_are_named_with_the_line_that_is_missing(tmp_path):
    time = 0.1 * np.arange(300)
    path = write_lsf(tmp_path / "Data.lsf", time, {"psi": np.sin(time), "r": np.cos(time), "rudder_rad": 0.1 * np.sin(3 * time)})
    found = inspect_log(path)
    (note,) = (n for n in found.notes if n.code == "which_output")
    assert "SetServomotorPosition[2] value" in note.message
    line = note.message.split("`")[1].replace("[1]", "[2]")
    body = {**found.proposal.body, "signals": found.proposal.body["signals"] | YAML(typ="safe").load(line)}
    run = load_run(path, mapping_of(body))
    np.testing.assert_allclose(run["rudder_rad"], 0.1 * np.sin(3 * time), atol=1e-9)
