"""What a record names is looked for inside or beside its trial, is a plain file or folder, and is hashed up to a size."""

from __future__ import annotations

import os
from hashlib import sha256
from pathlib import Path

import pytest

from fieldsid.records.named_inputs import (
    LARGEST_HASHED,
    MOST_HASHED,
    first_allowed,
    inputs_in,
    sha256_of,
    sha256_of_named,
    where_now,
)


@pytest.fixture
def trial(tmp_path, monkeypatch):
    for name in ("day/trial/models", "day/trial/runs", "day/logs", "far"):
        (tmp_path / name).mkdir(parents=True)
    for name in ("day/trial/runs/a.csv", "day/logs/b.csv", "far/c.csv"):
        (tmp_path / name).write_text(name)
    (tmp_path / "day" / "trial" / "models" / "m.yaml").write_text("x: 1\n")
    monkeypatch.chdir(tmp_path / "day" / "trial")
    return tmp_path / "day" / "trial"


def entry(path):
    return {"path": str(path), "sha256": sha256(b"").hexdigest()}


def test_files_inside_and_beside_a_trial_are_found_and_others_are_not(trial):
    record = Path("models/m.yaml")
    assert where_now(entry("runs/a.csv"), record) == Path("runs/a.csv")
    assert where_now(entry("../logs/b.csv"), record) == Path("../logs/b.csv")
    assert where_now(entry(trial.parent / "logs" / "b.csv"), record) == trial.parent / "logs" / "b.csv"
    for far in ("/dev/zero", "dev/zero", "/usr", "usr", trial.parents[1] / "far" / "c.csv", "nosuch", "\0", "x" * 5000, ""):
        assert where_now(entry(far), record) is None or far == ""


def test_entries_of_any_kind_name_nothing(trial):
    assert inputs_in({"inputs": [3, None, {}, {"path": []}, entry("nosuch")]}, trial / "models" / "m.yaml") == ()
    assert inputs_in({"inputs": 3}, trial / "models" / "m.yaml") == ()


def test_a_pipe_is_not_there(trial):
    os.mkfifo(trial / "pipe")
    assert first_allowed([trial / "pipe"], trial) is None
    assert sha256_of_named(trial / "pipe") is None


def test_what_is_too_large_or_too_many_is_not_hashed(trial):
    with (trial / "sparse.bin").open("wb") as stream:
        stream.truncate(LARGEST_HASHED + 1)
    assert sha256_of_named(trial / "sparse.bin") is None
    assert sha256_of_named(trial / "runs") == sha256_of(trial / "runs")
    for i in range(MOST_HASHED):
        (trial / "runs" / f"{i}.csv").touch()
    assert sha256_of_named(trial / "runs") is None
