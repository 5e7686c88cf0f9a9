"""A journal that anybody may have written: a bad line is counted, a link is none, and any name leaves a line that can be read."""

from __future__ import annotations

import json

import pytest

from fieldsid.cli.app import main
from fieldsid.trial_folder.journal import JOURNAL, Entry, Stamp, append, is_trial, made_by, read

STAMP = Stamp("models/m.yaml", "0" * 64, 10, 20)
GOOD = Entry("2026-05-01T10:00:00+00:00", ("sysid", "identify"), 0, 1.5, "says", (STAMP,), (STAMP,))


def line_of(tmp_path, **changes):
    append(tmp_path, GOOD)
    text = (tmp_path / JOURNAL).read_text()
    return json.dumps({**json.loads(text), **changes})


STAMPED = {"path": "a", "sha256": "b", "size": 1, "modified_ns": 2}


@pytest.mark.parametrize(
    "changes",
    [
        {"exit": 10**30}, {"exit": 1e400}, {"exit": "0"}, {"exit": None}, {"seconds": "x"}, {"seconds": float("nan")},
        {"time": "noon"}, {"time": 3}, {"time": "0001-01-01T00:00:00+23:59"}, {"command": "sysid"}, {"command": ["sysid"]},
        {"command": [["sysid"], {}]}, {"verdict": []}, {"inputs": {}}, {"inputs": [3]},
        {"inputs": [{**STAMPED, "path": ["a"]}]}, {"outputs": [{**STAMPED, "size": [1]}]}, {"outputs": [{"path": "a"}]},
        {"schema": []}, {"schema": "other/1"}, {"verdict": "\\ud800"},
    ],
    ids=str,
)  # fmt: skip
def test_a_line_of_wrong_values_is_counted_and_left(tmp_path, changes):
    text = line_of(tmp_path, **changes).replace("\\\\ud800", "\\ud800")
    good = (tmp_path / JOURNAL).read_text()
    (tmp_path / JOURNAL).write_text(f"{good}{text}\n{good}")
    assert read(tmp_path) == ((GOOD, GOOD), 1)


@pytest.mark.parametrize("raw", [b"[" * 50_000, b"\xff\xfe", b"9" * 6000, b"null", b"{", b'{"a":' * 3000, b"\x00" * 9])
def test_a_line_that_is_no_json_is_counted_and_left(tmp_path, raw):
    append(tmp_path, GOOD)
    with (tmp_path / JOURNAL).open("ab") as stream:
        stream.write(raw + b"\n")
    append(tmp_path, GOOD)
    assert read(tmp_path) == ((GOOD, GOOD), 1)


def test_a_verdict_with_the_line_ends_of_other_scripts_is_one_line(tmp_path):
    entry = Entry(GOOD.time, GOOD.command, 0, 1.5, "a\u2028b\x85c")
    append(tmp_path, entry)
    assert read(tmp_path) == ((entry,), 0)


def test_a_link_is_no_journal_and_nothing_is_written_where_it_leads(tmp_path, monkeypatch, capsys):
    (tmp_path / "target").write_text("mine\n")
    folder = tmp_path / "received"
    folder.mkdir()
    (folder / JOURNAL).symlink_to(tmp_path / "target")
    monkeypatch.chdir(folder)
    assert not is_trial(folder)
    assert read(folder) == ((), 0)
    with pytest.raises(OSError, match=r"symbolic|link|loop"):
        append(folder, GOOD)
    assert main(["status"]) == 0
    assert "is a symbolic link" in capsys.readouterr().err
    assert (tmp_path / "target").read_text() == "mine\n"


def test_a_name_that_is_no_utf8_leaves_a_line(tmp_path):
    odd = "f\udcff.csv"
    append(tmp_path, Entry(GOOD.time, ("sysid", "import", odd), 0, 1.0, "done", (), (Stamp("f\\udcff.csv", "0" * 64, 1, 2),)))
    (entry,), broken = read(tmp_path)
    assert (entry.command[2], broken) == ("f\\udcff.csv", 0)
    assert made_by([entry], "f\\udcff.csv") == entry
