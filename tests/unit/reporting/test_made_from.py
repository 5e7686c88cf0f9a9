"""What was made from what: every hash is told once, and many inputs of one folder are one part."""

from __future__ import annotations

from hashlib import sha256

from fieldsid.reporting.made_from import HASH, lineage
from fieldsid.trial_folder.state import FolderState, Item, Source


def state(folder, *items):
    for item in items:
        place = folder / item.path
        place.parent.mkdir(exist_ok=True)
        place.write_text(item.path)
    return FolderState(folder, items, (), 0)


def source(folder, name, text=None):
    return Source(name, folder / name, sha256((text or name).encode()).hexdigest())


def test_runs_are_told_once_and_their_logs_in_the_same_row(tmp_path):
    runs = [Item(f"runs/{i}.csv", "run", (source(tmp_path, f"logs/{i}.bag"),)) for i in range(5)]
    logs = [Item(f"logs/{i}.bag", "log") for i in range(6)]
    model = Item("m.yaml", "model", tuple(source(tmp_path, r.path) for r in runs))
    less = Item("n.yaml", "model", tuple(source(tmp_path, r.path) for r in runs[1:]))
    rows = {r[0]: r for r in lineage(state(tmp_path, *runs, *logs, model, less)).rows}
    assert set(rows) == {*(r.path for r in runs), "logs/5.bag", "m.yaml", "n.yaml"}
    known = sha256(b"logs/2.bag").hexdigest()[:HASH]
    assert rows["runs/2.csv"][3] == f"logs/2.bag ({known})"
    assert rows["m.yaml"][3] == "runs/*.csv (5)"
    assert rows["n.yaml"][3] == "runs/*.csv (4, without 0)"
    assert rows["m.yaml"][1] == sha256(b"m.yaml").hexdigest()[:HASH]


def test_an_input_that_has_changed_is_told_with_the_hash_it_had(tmp_path):
    runs = [Item(f"runs/{i}.csv", "run") for i in range(4)]
    was = source(tmp_path, "runs/0.csv", "as it was")
    model = Item("m.yaml", "model", (was, *(source(tmp_path, r.path) for r in runs[1:])), stale="runs/0.csv has changed")
    row = lineage(state(tmp_path, *runs, model)).rows[-1]
    assert row[3] == f"runs/1.csv; runs/2.csv; runs/3.csv; runs/0.csv ({was.sha256[:HASH]})"
    assert row[5] == "stale: runs/0.csv has changed"
