"""`sysid batch`: a row for every run of an archive, bad logs among them, resumed, with its trend."""

from __future__ import annotations

import json
import os

import numpy as np
import pandas as pd
import pytest
from cli import trial

pytestmark = pytest.mark.usefixtures("batch_here")


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    folder = tmp_path_factory.mktemp("archive")
    for i in range(7):
        os.utime(trial.flown(folder, seed=i, name=f"run{i}"), (1.7e9 + 1e5 * i, 1.7e9 + 1e5 * i))
    (folder / "broken.csv").write_text("time_s,yaw_rad\n0,1\n")
    (folder / "notes.txt").write_text("calm\n")
    return folder


def test_an_archive_becomes_a_table_whatever_lies_in_it_and_goes_on_where_it_was(run_cli, archive, tmp_path):
    arguments = ("batch", archive, "--axis", "yaw", "-o", tmp_path / "out", "--no-diagnose", "--workers", "1", "--json")
    first = run_cli(*arguments)
    assert first.code == 1
    body = json.loads(first.out)
    assert (body["logs"], body["runs"], body["known_logs"]) == (9, 7, 0)
    assert {r["run"] for r in body["skipped_runs"]} == {"broken", "notes"}
    assert all(r["what"] for r in body["skipped_runs"])
    table, text = pd.read_parquet(body["table"]), pd.read_csv(body["csv"])
    assert list(table.columns) == list(text.columns)
    done = table[table.status == "done"]
    for name, truth in trial.TRUTH["yaw"].items():
        assert (np.abs(done[name] - truth) < 5.0 * done[f"{name}_std_error"]).all()
    trial.flown(archive, seed=9, name="run9")
    again = json.loads(run_cli(*arguments, "--trend").out)
    assert (again["logs"], again["known_logs"]) == (10, 9)
    assert {t["parameter"] for t in again["trend"]} >= {"a22", "b2"}
    assert (tmp_path / "out" / "trend_yaw.png").is_file()


def test_each_run_is_diagnosed(run_cli, tmp_path):
    log = trial.flown(tmp_path)
    answer = run_cli("batch", log, "--axis", "yaw", "-o", tmp_path / "out", "--workers", "1")
    assert answer.code == 0, answer.err
    assert answer.out.startswith("1 run identified, 0 not; 1 ")
    row = pd.read_parquet(tmp_path / "out" / "batch_yaw.parquet").iloc[0]
    assert row.verdict in {"sufficient", "undecided", "disturbed", "unexplained", "effect"}
    assert row.says


def test_a_folder_without_logs_is_said(run_cli, tmp_path):
    answer = run_cli("batch", tmp_path, "--axis", "yaw")
    assert answer.code == 2
    assert "there are no logs here" in answer.err


def test_a_log_that_is_not_used_is_named_in_what_is_said_of_it(run_cli, tmp_path):
    for name in ("one", "two"):
        (tmp_path / f"{name}.csv").write_text("time_s,yaw_rad\n0,1\n")
    answer = run_cli("batch", tmp_path, "--axis", "yaw", "-o", tmp_path / "out", "--no-diagnose", "--workers", "1")
    (line,) = (x for x in answer.out.splitlines() if x.startswith("not used"))
    assert line == f"not used: `{tmp_path / 'one.csv'}` has too few samples; the same of 1 more"
