"""Logs as the field has them: what inspect proposes is imported and identified without an edit."""

import json
import re
from functools import cache

import numpy as np
import pytest
from look_alikes import LENGTH_S, STEP, TABLES, A, B, flight

from fieldsid.logs import load_run

PER_COUNT = {"iver": (200.0, 127.0), "spreadsheet": (200.0, 127.0), "pulses": (900.0, 400.0)}
"""Counts a rad, and the travel of the servo, of logs whose fin is in counts."""


def imported(run_cli, log, folder, *more):
    """The run of a log by the mapping that inspect proposes, and what both commands said."""
    inspected = run_cli("inspect", str(log), "--write-mapping", str(folder / "m.yaml"), "--json")
    done = run_cli("import", str(log), "--mapping", str(folder / "m.yaml"), "-o", str(folder / "run.parquet"), "--json", *more)
    return load_run(folder / "run.parquet"), inspected.json, done.json


@pytest.fixture(scope="module")
def of_kind(run_shared, tmp_path_factory):
    """Return a function that gives the folder of a kind of log with its run in it, and the same as `imported`; each once."""

    @cache
    def made(kind):
        folder = tmp_path_factory.mktemp(kind)
        return folder, *imported(run_shared, TABLES[kind](folder), folder)

    return made


@pytest.mark.parametrize("kind", TABLES)
def test_a_log_of_the_field_is_imported_and_identified_without_an_edit(run_cli, of_kind, kind):
    folder, run, _, _ = of_kind(kind)
    f = flight()
    assert len(run) == f["time"].size
    np.testing.assert_allclose(np.diff(run.time), STEP, atol=2e-3)
    off = run["yaw_rad"] - f["yaw"]
    np.testing.assert_allclose(off - 2 * np.pi * np.round(off / (2 * np.pi)), 0.0, atol=2e-3)
    done = run_cli("identify", folder / "run.parquet", "--axis", "yaw", "--json")
    values = {name: p["value"] for name, p in json.loads(done.out)["fits"][0]["parameters"].items()}
    counts, travel = PER_COUNT.get(kind, (1.0, np.radians(30.0)))
    assert -values["a22"] == pytest.approx(A, rel=0.1)
    assert values["b2"] * np.radians(30.0) / travel * counts == pytest.approx(B, rel=0.1)


def findings(record, code):
    return [f["message"] for f in record["findings"] if f["code"] == code]


def test_the_compass_is_taken_before_the_course_and_the_vehicle_before_its_goal(of_kind):
    record = of_kind("iver")[2]
    signals = record["mapping"]["signals"]
    columns = {s: item.get("column") for s, item in signals.items()}
    assert columns["yaw_rad"] == "C True Heading"
    assert columns["surge_m_s"] == "Vehicle Speed (kn)"
    assert columns["depth_m"] == "DFS Depth (m)"
    assert columns["rudder_rad"] == "Fin Yaw T"
    assert signals["rudder_rad"]["unit"] == "counts"
    assert signals["position"] == {"columns": ["Latitude", "Longitude"]}
    assert "roll_rad" not in signals
    assert any("`Fin Yaw B`" in m for m in findings(record, "alternatives"))
    assert record["mapping"]["time"] == {"column": "Time", "date": "Date"}


def test_latitude_and_longitude_are_metres_from_the_first_fix(of_kind):
    run = of_kind("iver")[1]
    f = flight()
    np.testing.assert_allclose(run["x_m"], f["x"], atol=0.2 + 2e-3 * np.abs(f["x"]).max())
    np.testing.assert_allclose(run["y_m"], f["y"], atol=0.2 + 2e-3 * np.abs(f["y"]).max())


def test_what_was_rebuilt_or_taken_is_said(of_kind):
    codes = {kind: {n["code"] for n in of_kind(kind)[3]["runs"][0]["notes"]} for kind in TABLES}
    assert "lost_hours" in codes["spreadsheet"]
    assert {"coarse_time", "counts"} <= codes["pulses"]
    assert "coarse_time" in codes["tank"]
    assert "text_rows" in codes["units_row"]
    assert "lost_hours" not in codes["iver"]


def test_a_table_without_names_is_known_by_its_numbers_and_says_why(run_cli, of_kind):
    record = of_kind("tank")[2]
    columns = {s: item["column"] for s, item in record["mapping"]["signals"].items()}
    assert {"x_m": 1, "y_m": 2, "yaw_rad": 4, "surge_m_s": 5, "yaw_rate_rad_s": 7, "rudder_rad": 8}.items() <= columns.items()
    assert any("derivative of column 4" in m for m in findings(record, "evidence"))
    assert any("explains" in m for m in findings(record, "evidence"))
    said = run_cli("inspect", record["path"]).out
    counted = re.search(r"; (\d+) finding", said)
    listed = [line for line in said.partition("\nfindings\n")[2].splitlines() if line.startswith("- ") and line != "- none"]
    assert len(listed) == (int(counted[1]) if counted else 0)
    assert "\nwhy these\n- " in said


def test_the_scale_of_counts_makes_them_angles_and_the_note_goes(run_cli, tmp_path):
    log = TABLES["pulses"](tmp_path)
    (tmp_path / "m.yaml").write_text(
        "time: {column: epoch, unit: s}\nsignals:\n  yaw_rad: {column: compass, unit: deg}\n"
        f"  rudder_rad: {{column: rudder_servo, unit: counts, centre: 1500, scale: {1 / 900}}}\n"
    )
    run = load_run(log, tmp_path / "m.yaml")
    np.testing.assert_allclose(run["rudder_rad"], flight()["rudder"], atol=1e-3)
    assert "counts" not in {n.code for n in run.notes}


def test_the_angle_of_a_pose_in_the_plane_is_the_heading(run_cli, tmp_path):
    f = flight()
    rows = "\n".join(",".join(f"{f[k][i]:.5f}" for k in ("time", "x", "y", "yaw", "rudder")) for i in range(f["time"].size))
    (tmp_path / "pose.csv").write_text("t,x,y,theta,delta\n" + rows + "\n")
    run, _, _ = imported(run_cli, tmp_path / "pose.csv", tmp_path)
    np.testing.assert_allclose(run["yaw_rad"], f["yaw"], atol=1e-4)
    assert not run.has("pitch_rad")
    assert LENGTH_S - run.time[-1] == pytest.approx(STEP)


def stopped(folder):
    """A log of two stretches under way between three stops, at 2 Hz."""
    f = flight(step=0.5)
    stop = (f["time"] < 30.0) | ((f["time"] > 100.0) & (f["time"] < 140.0)) | (f["time"] > 200.0)
    speed = np.where(stop, 0.02, f["speed"])
    rows = "\n".join(f"{t},{y:.5f},{r:.4f},{u:.3f}" for t, y, r, u in zip(f["time"], f["yaw"], f["rudder"], speed, strict=True))
    (folder / "stops.csv").write_text("time_s,yaw_rad,rudder_rad,surge_m_s\n" + rows + "\n")
    return folder / "stops.csv"


def test_stretches_of_one_log_are_runs_of_their_own_and_whole_keeps_them(run_cli, tmp_path):
    log = stopped(tmp_path)
    body = run_cli("import", log, "-o", tmp_path / "runs", "--json").json
    assert [r["run"] for r in body["runs"]] == ["stops_1", "stops_2"]
    assert [(r["start_s"], r["end_s"]) for r in body["runs"]] == [(30.0, 100.0), (140.0, 200.0)]
    assert all("--whole" in next(n["message"] for n in r["notes"] if n["code"] == "stretches") for r in body["runs"])
    (whole,) = run_cli("import", log, "-o", tmp_path / "whole", "--whole", "--json").json["runs"]
    assert (whole["start_s"], whole["end_s"]) == (0.0, 239.5)
    again = run_cli("import", log, "-o", tmp_path / "runs")
    assert again.code == 0
    assert "already imported" in again.out


def test_both_stretches_of_one_log_are_identified_together(run_cli, tmp_path):
    run_cli("import", stopped(tmp_path), "-o", tmp_path / "runs", "--json").json  # noqa: B018 - reading it says that it went well
    fits = run_cli("identify", *sorted((tmp_path / "runs").iterdir()), "--axis", "yaw", "--json").json["fits"]
    assert [f["run"] for f in fits] == ["stops_1", "stops_2"]
    assert all(f["parameters"]["b2"]["value"] == pytest.approx(B, rel=0.1) for f in fits)
