"""The workers of a batch: rows for every log whatever becomes of a process, here and on a cluster that loses a worker."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import wraps
from pathlib import Path

import pytest
from cli import trial

from fieldsid.batch import local_pool
from fieldsid.batch.archive import all_rows, known_rows, without_copies
from fieldsid.batch.local_pool import run_here
from fieldsid.batch.task import Settings, Task, logs_in
from fieldsid.errors import UsageError

SETTINGS = Settings("yaw", diagnose=False)
BESIDE = {"timeout_s": 120.0, "memory_mb": 4000.0}

STAND_IN = """
import json, os, signal, sys, time
for line in sys.stdin:
    log = json.loads(line)["log"]
    if "kill" in log:
        os.kill(os.getpid(), signal.SIGKILL)
    if "once" in log and not os.path.exists(log):
        open(log, "w").close()
        sys.exit(3)
    if "slow" in log:
        time.sleep(60)
    if "large" in log:
        kept = bytearray(300_000_000)
        time.sleep(60)
    print(json.dumps([{"log": log, "status": "done", "pid": os.getpid()}]), flush=True)
"""


@pytest.fixture
def stand_in(monkeypatch, tmp_path):
    """Workers that do what the name of the log says."""
    import subprocess

    script = tmp_path / "worker.py"
    script.write_text(STAND_IN)
    started = subprocess.Popen

    def start(_command, **more):
        return started([sys.executable, str(script)], **more)

    monkeypatch.setattr(local_pool.subprocess, "Popen", start)


def found(tasks, workers=2, **more):
    return {Path(task.log).name: rows[0] for task, rows in run_here(tasks, workers, **(BESIDE | more))}


def test_a_log_that_ends_its_process_stops_no_other(stand_in, tmp_path):
    tasks = [Task(str(tmp_path / name), SETTINGS) for name in ("a", "kill", "b", "once", "c", "d")]
    rows = found(tasks)
    assert [n for n, r in rows.items() if r["status"] == "done"] != []
    assert {n for n, r in rows.items() if r["status"] == "done"} == {"a", "b", "once", "c", "d"}
    assert rows["kill"]["found"] == "signal 9"


def test_a_log_that_hangs_is_given_up(stand_in, tmp_path):
    rows = found([Task(str(tmp_path / name), SETTINGS) for name in ("slow", "a")], timeout_s=3.0)
    assert "took longer than 3 s" in rows["slow"]["what"]
    assert rows["a"]["status"] == "done"


def test_a_log_that_takes_too_much_memory_is_given_up(stand_in, tmp_path):
    rows = found([Task(str(tmp_path / name), SETTINGS) for name in ("large", "a")], memory_mb=200.0)
    assert "took more memory than 200 MB" in rows["large"]["what"]
    assert rows["a"]["status"] == "done"


def test_a_process_is_replaced_after_so_many_logs(stand_in, tmp_path, monkeypatch):
    monkeypatch.setattr(local_pool, "LOGS_A_PROCESS", 3)
    rows = found([Task(str(tmp_path / f"a{i}"), SETTINGS) for i in range(9)], workers=1)
    assert len({r["pid"] for r in rows.values()}) == 3


def test_a_real_worker_reads_fits_and_says_why_not(tmp_path):
    good = trial.flown(tmp_path)
    bad = tmp_path / "bad.csv"
    bad.write_text("no,log\n1,2\n")
    rows = found([Task(str(good), SETTINGS), Task(str(bad), SETTINGS)], workers=1)
    assert rows[good.name]["status"] == "done"
    for name, truth in trial.TRUTH["yaw"].items():
        assert abs(rows[good.name][name] - truth) < 4.0 * rows[good.name][f"{name}_std_error"]
    assert rows["bad.csv"]["status"] == "skipped"
    assert "no column" in rows["bad.csv"]["what"]


def test_answers_are_kept_and_asked_again_only_where_log_or_question_changed(tmp_path):
    log = tmp_path / "a.csv"
    log.write_text("1")
    task, asked = Task(str(log), SETTINGS), []

    def work(tasks):
        for one in tasks:
            asked.append(one)
            yield one, [{"log": one.log, "status": "done"}]

    assert all_rows(tmp_path / "out", [task], work, lambda: None)[1] == 0
    assert all_rows(tmp_path / "out", [task], work, lambda: None)[1] == 1
    assert len(asked) == 1
    all_rows(tmp_path / "out", [Task(str(log), Settings("pitch"))], work, lambda: None)
    log.write_text("12")
    all_rows(tmp_path / "out", [Task(str(log), SETTINGS)], work, lambda: None)
    assert len(asked) == 3


def test_what_failed_is_tried_again(tmp_path):
    task = Task(str(tmp_path / "a"), SETTINGS)
    all_rows(tmp_path, [task], lambda ts: iter([(t, [{"log": t.log, "status": "failed"}]) for t in ts]), lambda: None)
    assert known_rows(tmp_path, task) is None


def test_a_folder_stands_for_the_logs_in_and_below_it_each_once(tmp_path):
    (tmp_path / "sub").mkdir()
    for name in ("b.csv", "sub/a.csv", ".hidden"):
        (tmp_path / name).write_text("x")
    assert [p.name for p in logs_in([tmp_path, tmp_path / "b.csv"])] == ["b.csv", "a.csv"]


OWN_PROCESS = "FIELDSID_TEST_IN_OWN_PROCESS"


def in_own_process(test):
    """Run a test in a process of its own: Dask leaves threads and a process behind, beside which no other test may fork."""

    @wraps(test)
    def started(tmp_path):
        if os.environ.get(OWN_PROCESS):
            return test(tmp_path)
        pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
        words = [sys.executable, "-m", "pytest", "-q", "-m", "", "-p", "no:cacheprovider", f"{__file__}::{test.__name__}"]
        done = subprocess.run(words, env=os.environ | {OWN_PROCESS: "1"}, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        return None

    return started


@in_own_process
def test_a_cluster_answers_for_every_log_and_one_that_is_not_there_is_said(tmp_path):
    distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    from fieldsid.batch import dask_cluster

    (tmp_path / "bad.csv").write_text("no,log\n1,2\n")
    tasks = [Task(str(log), SETTINGS) for log in (trial.flown(tmp_path), tmp_path / "bad.csv")]
    with distributed.LocalCluster(n_workers=1, processes=False, dashboard_address=None, silence_logs=50) as cluster:
        rows = dict(dask_cluster.run_on_cluster(tasks, cluster.scheduler_address))
    assert [rows[task][0]["status"] for task in tasks] == ["done", "skipped"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dask_cluster, "CONNECT_S", 1)
        with pytest.raises(UsageError, match="no Dask scheduler"):
            next(dask_cluster.run_on_cluster([], "tcp://127.0.0.1:9"))


@pytest.mark.slow  # two processes that begin, and one anew
@in_own_process
def test_a_cluster_that_loses_a_worker_still_answers_for_every_log(tmp_path):
    distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    from fieldsid.batch import dask_cluster

    logs = [trial.flown(tmp_path, seed=i, name=f"run{i}") for i in range(6)]
    (tmp_path / "bad.csv").write_text("no,log\n1,2\n")
    tasks = [Task(str(log), SETTINGS) for log in [*logs, tmp_path / "bad.csv"]]
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster:
        rows, killed = {}, False
        with distributed.Client(cluster) as client:
            pids = client.run(os.getpid)
        for task, of_it in dask_cluster.run_on_cluster(tasks, cluster.scheduler_address):
            rows[task] = of_it
            if not killed and len(rows) == 3:
                os.kill(next(iter(pids.values())), 9)
                killed = True
    assert set(rows) == set(tasks)
    assert [r[0]["status"] for t, r in rows.items() if not t.log.endswith("bad.csv")] == ["done"] * len(logs)


def test_a_copy_of_a_log_is_no_second_flight_and_two_runs_of_one_log_are_two():
    rows = [
        {"log": log, "run": run, "status": "done", "sha256": digest, "b2": -1.0}
        for log, run, digest in (("a.csv", "a_1", "1"), ("a.csv", "a_2", "1"), ("b.csv", "b", "2"), ("c.csv", "c", "1"))
    ]
    *kept, copy = without_copies(rows)
    assert kept == rows[:3]
    assert (copy["status"], copy["what"]) == ("skipped", "`c.csv` is a copy of `a.csv`")
    assert "b2" not in copy
