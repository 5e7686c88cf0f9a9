"""`sysid init`, `inspect` and `import` as a user types them: what comes out, and what every bad input says."""

from __future__ import annotations

import gzip
import io
import json
from pathlib import Path

import numpy as np
import pytest
from bags import MAPPING, write_bag

from fieldsid.artifacts import to_yaml
from fieldsid.logs import Run, load_run, save_run
from fieldsid.records.named_inputs import sha256_of

TIME = np.arange(400) / 20
SIGNALS = {
    "yaw_rad": 0.5 * np.sin(0.5 * TIME),
    "yaw_rate_rad_s": 0.25 * np.cos(0.5 * TIME),
    "surge_m_s": 1.5 + 0.1 * np.sin(TIME),
    "rudder_rad": 0.2 * np.sign(np.sin(0.5 * TIME + 0.01)),
}


@pytest.fixture
def log(tmp_path):
    return save_run(Run("run7", TIME, SIGNALS), tmp_path / "logs" / "run7.csv")


def edited(log, change):
    """Rewrite a CSV through a function of its rows of cells, the header first."""
    rows = [line.split(",") for line in log.read_text().splitlines()]
    log.write_text("\n".join(",".join(row) for row in change(rows)) + "\n")
    return log


def column(rows, name, values):
    place = rows[0].index(name)
    return [rows[0], *[[*r[:place], str(values(i, r[place])), *r[place + 1 :]] for i, r in enumerate(rows[1:])]]


def with_column(name, values):
    return lambda path: edited(path, lambda rows: column(rows, name, values))


def test_init_makes_a_trial_folder_and_never_touches_one(run_cli, tmp_path):
    folder = tmp_path / "pandan"
    answer = run_cli("init", folder, "--json").json
    files = ["vehicle.yaml", "mapping.yaml", "notes.md", "journal.jsonl"]
    assert sorted(p.name for p in folder.iterdir()) == sorted([*files, "logs", "models", "runs"])
    assert answer["files"] == [str(folder / n) for n in files]
    assert "name: 'pandan'" in (folder / "vehicle.yaml").read_text()
    before = sha256_of(folder)
    again = run_cli("init", folder)
    assert again.code == 2
    assert "exists" in again.err
    assert sha256_of(folder) == before


def test_init_names_the_templates_for_a_wrong_one(run_cli, tmp_path):
    answer = run_cli("init", tmp_path / "a", "--template", "torpeddo")
    assert answer.code == 2
    assert "`torpedo`" in answer.err
    assert not (tmp_path / "a").exists()


def test_import_writes_a_run_that_reads_back(run_cli, log, tmp_path):
    answer = run_cli("import", log, "-o", tmp_path / "runs", "--json").json
    (item,) = answer["runs"]
    assert answer["schema"] == "fieldsid/import/1"
    assert (item["samples"], item["rate_hz"]) == (400, pytest.approx(20.0))
    back = load_run(Path(item["file"]))
    for name, values in SIGNALS.items():
        np.testing.assert_array_equal(back[name], values)


@pytest.mark.parametrize("form", ["parquet", "csv", "csv.gz"])
def test_the_format_of_a_folder_of_runs_is_chosen(run_cli, log, tmp_path, form):
    assert run_cli("import", log, "-o", tmp_path / "runs", "--format", form).code == 0
    assert [p.name for p in (tmp_path / "runs").iterdir()] == [f"run7.{form}"]


def test_one_log_may_go_to_one_file_and_be_cut_to_times(run_cli, log, tmp_path):
    assert run_cli("import", log, "-o", tmp_path / "part.csv", "--from", 2, "--to", 5).code == 0
    part = load_run(tmp_path / "part.csv")
    assert (part.time[0], part.time[-1]) == (2.0, 5.0)


def test_channels_map_a_table_by_index_and_count_more_than_names(run_cli, tmp_path):
    log = tmp_path / "plain.txt"
    log.write_text(
        "\n".join(f"{t} {np.degrees(y)} {r}" for t, y, r in zip(TIME, SIGNALS["yaw_rad"], SIGNALS["rudder_rad"], strict=True))
    )
    channels = [x for c in ("time=0:s", "yaw_rad=1:deg", "rudder_rad=2") for x in ("--channel", c)]
    assert run_cli("import", log, "-o", tmp_path / "a.parquet", *channels).code == 0
    np.testing.assert_allclose(load_run(tmp_path / "a.parquet")["yaw_rad"], SIGNALS["yaw_rad"], atol=1e-12)


def test_inspect_proposes_a_mapping_that_import_takes(run_cli, tmp_path):
    log = write_bag(tmp_path / "bag", "mcap", {"time_s": TIME, **SIGNALS})
    record = run_cli("inspect", log, "--write-mapping", tmp_path / "m.yaml", "--json").json
    assert {c["name"] for c in record["channels"]} == {"/odom", "/imu", "/rudder_cmd", "/elevator_cmd"}
    assert run_cli("import", log, "-m", tmp_path / "m.yaml", "-o", tmp_path / "runs").code == 0
    np.testing.assert_allclose(load_run(tmp_path / "runs" / "bag.parquet")["yaw_rad"], SIGNALS["yaw_rad"], atol=1e-12)


def test_inspect_prints_channels_mapping_and_findings_on_stdout_only(run_cli, log):
    with_column("yaw_rate_rad_s", lambda _, v: -float(v))(log)
    answer = run_cli("inspect", log)
    assert answer.code == 0
    assert "yaw_rad: {column: yaw_rad, unit: rad}" in answer.out
    assert "[rate_sign]" in answer.out
    assert answer.err == ""


def test_import_warns_on_stderr_and_keeps_the_finding_in_the_run(run_cli, log, tmp_path):
    with_column("yaw_rate_rad_s", lambda _, v: -float(v))(log)
    answer = run_cli("import", log, "-o", tmp_path / "runs", "--json")
    assert "[rate_sign]" in answer.err
    json.loads(answer.out)
    assert "rate_sign" in {n.code for n in load_run(tmp_path / "runs" / "run7.parquet").notes}


def test_the_vehicle_of_the_trial_folder_says_where_the_fin_saturates(run_cli, log, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("vehicle.yaml").write_text("name: a\nrudder_max_rad: 0.15\n")
    assert "[saturated]" in run_cli("import", log, "-o", "runs").err


def test_the_mapping_of_the_trial_folder_is_used_where_names_are_foreign(run_cli, log, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    edited(log, lambda rows: [["t", "hdg", "r", "u", "fin"], *rows[1:]])
    Path("mapping.yaml").write_text("time: {column: t}\nsignals: {yaw_rad: hdg, rudder_rad: fin}\n")
    assert run_cli("import", log, "-o", "runs").code == 0
    assert set(load_run(Path("runs/run7.parquet")).signals) == {"yaw_rad", "rudder_rad"}


def truncated(log):
    packed = gzip.compress(log.read_bytes())
    log.write_bytes(packed[: len(packed) // 2])
    return log


def emptied(log):
    log.write_bytes(b"")
    return log


BAD = {
    "missing column": (
        lambda p: edited(p, lambda r: [["Time", *r[0][1:]], *r[1:]]),
        "needs a mapping",
        "`Time` may be `time_s`",
    ),
    "time backwards": (with_column("time_s", lambda i, v: 1.0 if i == 200 else v), "time goes backwards", "--salvage"),
    "time repeated": (lambda p: edited(p, lambda r: [*r[:100], r[99], *r[100:]]), "time repeats", "--salvage"),
    "no time in a row": (with_column("time_s", lambda i, v: "" if i == 9 else v), "rows without a time", "--salvage"),
    "NaN run": (
        with_column("yaw_rad", lambda i, v: "nan" if 100 <= i < 180 else v),
        "`yaw_rad` is missing for 4.00 s",
        "--max-gap",
    ),
    "words": (with_column("yaw_rad", lambda i, v: "ERR" if i == 9 else v), "cells that are no numbers", "--salvage"),
    "empty": (emptied, "is empty", "copy it"),
    "header only": (lambda p: edited(p, lambda r: r[:1]), "has no rows", "copy it"),
    "truncated gzip": (truncated, "truncated gzip", "--salvage"),
    "a missing file": (lambda p: p.with_name("other.csv"), "there is no log", "path"),
    "a folder": (lambda p: p.parent, "is a folder", ".csv"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_a_three_part_error_and_leaves_everything_as_it_was(run_cli, log, tmp_path, case):
    spoil, what, hint = BAD[case]
    path = spoil(log)
    before = sha256_of(log)
    answer = run_cli("import", path, "-o", tmp_path / "runs", "--json")
    assert answer.code == 2
    assert '"schema": "fieldsid/error/1"' in answer.out
    assert answer.err.startswith("error: ")
    assert what in answer.err.split("  found: ")[0]
    assert hint in answer.err.split("\nhint: ")[1]
    assert sha256_of(log) == before
    assert not (tmp_path / "runs").exists()


def test_one_bad_log_among_several_is_skipped_with_its_reason_and_the_others_are_written(run_cli, log, tmp_path):
    bad = tmp_path / "bad.csv"
    bad.write_text("")
    answer = run_cli("import", bad, log, "-o", tmp_path / "runs", "--json")
    assert answer.code == 1
    assert [p.name for p in (tmp_path / "runs").iterdir()] == ["run7.parquet"]
    body = json.loads(answer.out)
    assert [r["run"] for r in body["runs"]] == ["run7"]
    (skipped,) = body["skipped_runs"]
    assert (skipped["run"], skipped["file"], skipped["found"]) == ("bad", str(bad), "0 bytes")
    assert f"skipped `{bad}`" in answer.err
    assert "1 of 2 logs skipped" in answer.err


def test_nothing_is_written_where_no_log_can_be_used_or_the_mapping_is_wrong(run_cli, log, tmp_path):
    bad = [tmp_path / f"bad{i}.csv" for i in range(2)]
    for path in bad:
        path.write_text("")
    answer = run_cli("import", *bad, "-o", tmp_path / "runs")
    assert answer.code == 2
    assert "no log is left that can be used" in answer.err
    mapping = tmp_path / "m.yaml"
    mapping.write_text("signalz: {}\n")
    answer = run_cli("import", log, log.with_name("no.csv"), "-m", mapping, "-o", tmp_path / "runs")
    assert (answer.code, "skipped" in answer.err) == (2, False)
    answer = run_cli("import", log, log.with_name("no.csv"), "--channel", "yaw=heading", "-o", tmp_path / "runs")
    assert (answer.code, "skipped" in answer.err) == (2, False)
    assert not (tmp_path / "runs").exists()


def test_two_parts_of_one_log_are_two_runs_and_called_as_their_files(run_cli, log, tmp_path):
    for name, part in (("first", ["--to", 9]), ("second", ["--from", 9.05])):
        body = run_cli("import", log, *part, "-o", tmp_path / f"{name}.parquet", "--json").json
        assert body["runs"][0]["run"] == name
    assert load_run(tmp_path / "second.parquet").name == "second"


def test_an_output_that_exists_is_kept_unless_forced(run_cli, log, tmp_path):
    target = tmp_path / "runs" / "run7.parquet"
    target.parent.mkdir()
    target.write_text("mine")
    answer = run_cli("import", log, "-o", tmp_path / "runs")
    assert answer.code == 2
    assert "--force" in answer.err
    assert target.read_text() == "mine"
    assert [p.name for p in target.parent.iterdir()] == ["run7.parquet"]
    assert run_cli("import", log, "-o", tmp_path / "runs", "--force").code == 0
    assert len(load_run(target)) == 400


def test_a_log_is_never_written_over_itself(run_cli, log):
    before = sha256_of(log)
    answer = run_cli("import", log, "-o", log.parent, "--format", "csv", "--force")
    assert answer.code == 2
    assert "over itself" in answer.err
    assert sha256_of(log) == before


def test_two_logs_of_one_name_become_two_runs(run_cli, log, tmp_path):
    other = save_run(load_run(log).between(0.0, 15.0), tmp_path / "run7.csv.gz")
    body = run_cli("import", log, other, "-o", tmp_path / "runs", "--json").json
    assert [r["run"] for r in body["runs"]] == ["logs_run7", f"{tmp_path.name}_run7"]
    assert [len(load_run(Path(r["file"]))) for r in body["runs"]] == [400, 301]


def test_one_log_twice_is_refused_whatever_its_file(run_cli, log, tmp_path):
    copy = save_run(load_run(log), tmp_path / "copy.parquet")
    for twice, says in (((log, log), f"`{log}` is given twice"), ((log, copy), f"`{copy}` holds the same data as `{log}`")):
        answer = run_cli("import", *twice, "-o", tmp_path / "runs")
        assert answer.code == 2
        assert says in answer.err
    assert not (tmp_path / "runs").exists()


MAPPINGS = {
    "missing topic": ({**MAPPING, "signals": {"rudder_rad": {"topic": "/ruder_cmd"}}}, "no topic `/ruder_cmd`", "`/rudder_cmd`"),
    "missing field": (
        {"signals": {"yaw_rate_rad_s": {"topic": "/imu", "field": "angular_velocty.z"}}},
        "no number at",
        "`angular_velocity.z`",
    ),
    "unknown key": ({"signals": {"rudder_rad": {"topik": "/rudder_cmd"}}}, "unknown key", "`topic`"),
    "wrong type": ({"signals": {"rudder_rad": {"topic": ["a"]}}}, "`signals.rudder_rad.topic` is not valid", "correct"),
    "wrong unit": ({"signals": {"rudder_rad": {"topic": "/rudder_cmd", "unit": "kn"}}}, "cannot be in 'kn'", "angle"),
}


@pytest.mark.parametrize("case", MAPPINGS)
def test_a_mapping_that_does_not_fit_is_a_three_part_error(run_cli, tmp_path, case):
    body, what, hint = MAPPINGS[case]
    log = write_bag(tmp_path / "bag", "mcap", {"time_s": TIME[:50]})
    mapping = tmp_path / "m.yaml"
    mapping.write_text(to_yaml(body))
    answer = run_cli("import", log, "-m", mapping, "-o", tmp_path / "runs")
    assert answer.code == 2
    assert what in answer.err
    assert hint in answer.err.split("\nhint: ")[1]
    assert not (tmp_path / "runs").exists()


def test_salvage_takes_what_is_left_and_says_so(run_cli, log, tmp_path):
    answer = run_cli("import", truncated(log), "--salvage", "-o", tmp_path / "runs", "--json")
    assert 50 < answer.json["runs"][0]["samples"] < 400
    assert "[truncated]" in answer.err


def rates(run_cli, log, *options):
    return {c["name"]: c["rate"] for c in run_cli("inspect", log, "--json", *options).json["shown"]}


@pytest.mark.parametrize("suffix", ["csv", "csv.gz", "parquet"])
def test_inspect_says_the_rate_of_each_column_of_a_table(run_cli, tmp_path, suffix):
    slow = np.where(np.arange(TIME.size) % 10 == 0, 5.0 + 0.01 * TIME, np.nan)
    log = save_run(Run("run7", TIME, {**SIGNALS, "depth_m": slow}), tmp_path / f"run7.{suffix}")
    assert rates(run_cli, log) == {"time_s": "20", **dict.fromkeys(SIGNALS, "20"), "depth_m": "2"}


@pytest.mark.parametrize(
    ("head", "scale", "options", "rate"),
    [
        ("Timestamp,a", 1e9, [], "20"),
        ("stamp,a", 1.0, [], "20"),
        ("", 1.0, [], "20"),
        ("tick,a", 1e3, [], "20"),
        ("tick,a", 1e3, ["-m", "ms.yaml"], "20"),
        ("time_ms,a", 1e3, [], "20"),
    ],
)
def test_the_rate_comes_from_the_time_that_names_or_mapping_tell(run_cli, tmp_path, monkeypatch, head, scale, options, rate):
    monkeypatch.chdir(tmp_path)
    Path("ms.yaml").write_text("time: {column: tick, unit: ms}\nsignals: {yaw_rad: a}\n")
    rows = [head] * bool(head) + [f"{round((1.7e9 * (scale == 1e9) + t) * scale, 3):.17g},{0.01 * t:.4f}" for t in TIME]
    Path("plain.csv").write_text("\n".join(rows) + "\n")
    assert set(rates(run_cli, "plain.csv", *options).values()) == {rate}


def test_a_log_on_standard_input_is_said_to_be_that(run_cli, log, tmp_path, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(log.read_bytes())))
    told = run_cli("import", "-", "-o", tmp_path / "runs")
    assert told.code == 0
    assert "rests on standard input: SI" in told.out


def test_import_reads_what_identify_reads_and_says_what_it_leaves_out(run_cli, tmp_path):
    time = np.arange(0.0, 30.0, 0.1)
    columns = [time, 0.1 * np.sin(time), 0.1 * np.cos(time), 0.1 * np.sign(np.sin(time)), 2.9 + 0.02 * np.sin(9.0 * time), time]
    log = tmp_path / "a.csv"
    header = "time_s,yaw_rad,yaw_rate_rad_s,rudder_rad,speed_knots,battery_temp"
    np.savetxt(log, np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.6g")
    answer = run_cli("import", log, "-o", tmp_path / "run.parquet")
    assert answer.code == 0
    assert "surge from speed_knots (kn)" in answer.err
    assert "columns that are not used: battery_temp" in answer.err
    run = load_run(tmp_path / "run.parquet")
    assert run["surge_m_s"] == pytest.approx(columns[4] * 1852.0 / 3600.0, abs=1e-5)
    assert run.signals.keys() == load_run(log, recognise=True).signals.keys()


def test_what_several_logs_leave_out_alike_is_said_once(run_cli, tmp_path):
    header = "time_s,yaw_rad,yaw_rate_rad_s,rudder_rad,battery_temp"
    for i in range(3):
        columns = [TIME, SIGNALS["yaw_rad"] + 0.001 * i, SIGNALS["yaw_rate_rad_s"], SIGNALS["rudder_rad"], TIME]
        np.savetxt(tmp_path / f"a{i}.csv", np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.6g")
    answer = run_cli("import", *sorted(tmp_path.glob("a*.csv")), "-o", tmp_path / "runs")
    assert answer.code == 0
    assert answer.err.count("columns that are not used: battery_temp") == 1
    assert "a0: columns that are not used: battery_temp (and 2 more like it)" in answer.err
