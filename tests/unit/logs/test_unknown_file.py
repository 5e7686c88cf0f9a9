"""A file that is no log is called what it is, and what helps is true of it."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from fieldsid.errors import LogError
from fieldsid.logs import Run, load_run, save_run
from fieldsid.logs.mapping.mapping_file import mapping_of
from fieldsid.logs.reader import reader_of


def refused(path) -> LogError:
    with pytest.raises(LogError) as caught:
        reader_of(path)
    return caught.value


@pytest.mark.parametrize(
    ("name", "content", "what", "hint"),
    [
        ("a.xlsx", b"PK\x03\x04" + bytes(900), "is a ZIP file, as .xlsx", "unpack it"),
        ("a.png", b"\x89PNG\r\n" + bytes(900), "is a picture, not a log", "give a log: "),
        ("a.parquet", b"\x89MCAP", "starts as a log of another kind does, and is none", "copy it again"),
        ("a.dat", b"\x01\x02\x00\x04" * 200, "is no log this program reads", "give a log: "),
    ],
)
def test_a_format_without_a_reader_is_named(tmp_path, name, content, what, hint):
    path = tmp_path / name
    path.write_bytes(content)
    error = refused(path)
    assert what in error.what
    assert str(len(content)) in error.found
    assert hint in error.hint
    assert "from the vehicle again" not in error.hint


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("schema: fieldsid/schedule/1\ntool: x\n", "is a schedule file of this program, not a log"),
        ("# comment\nschema: fieldsid/identify/1\n", "is an identify file of this program, not a log"),
        ('{"schema": "fieldsid/turn-radius/1", "rows": []}\n', "is a turn-radius file of this program, not a log"),
    ],
)
def test_a_file_of_our_own_is_named_by_its_schema(tmp_path, text, what):
    path = tmp_path / "a.yaml"
    path.write_text(text)
    assert what in refused(path).what


def test_a_model_says_which_logs_it_was_made_from_and_a_mapping_how_it_is_given(tmp_path):
    log = tmp_path / "my run.csv"
    log.write_text("time_s,yaw_rad\n")
    model = tmp_path / "model.yaml"
    model.write_text(f"schema: fieldsid/model/1\ninputs:\n- path: {log}\n  sha256: a\n- path: /gone.csv\n  sha256: b\n")
    assert refused(model).hint == f"give logs, such as those it was made from: `'{log}'`"
    model.write_text("schema: fieldsid/model/1\ninputs: {broken\n")
    assert refused(model).hint.startswith("give a log: .alog")
    suffixes = refused(model).hint.removeprefix("give a log: ").split(", ")
    assert len(suffixes) == len(set(suffixes))
    mapping = tmp_path / "mapping.yaml"
    mapping.write_text("# mine\nschema: fieldsid/mapping/1\n")
    assert refused(mapping).hint == f"give it beside the log: `--mapping {mapping}`"


def test_a_folder_says_what_is_in_it(tmp_path):
    assert refused(tmp_path).found == "it holds nothing"
    run = Run("a", np.arange(3.0), {"yaw_rad": np.arange(3.0)})
    for name in ("a.csv", "b.csv.gz", "c.csv.gz", "notes.md"):
        save_run(run, tmp_path / name) if "csv" in name else (tmp_path / name).write_text("")
    error = refused(tmp_path)
    assert error.found == "it holds a.csv, b.csv.gz, c.csv.gz, notes.md"
    assert error.hint == f"give the logs in it: `{tmp_path}/*.csv.gz`"


def test_a_log_that_is_not_there_may_be_one_that_is(tmp_path):
    (tmp_path / "run7.parquet").write_text("")
    assert refused(tmp_path / "run7.parqet").hint == f"did you mean `{tmp_path / 'run7.parquet'}`?"
    assert refused(tmp_path / "nothing" / "a.csv").found == f"no folder `{tmp_path / 'nothing'}` either"
    assert refused(tmp_path / "run7.parquet" / "a.csv").what.startswith("there is no log")


def test_a_pipe_is_refused_before_it_is_drained(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    assert "is a pipe, which can be read once only" in refused(tmp_path / "pipe").what


@pytest.mark.parametrize("kind", ["file", "folder"])
def test_a_log_without_permission_says_how_to_get_it(tmp_path, monkeypatch, kind):
    path = tmp_path / "closed"
    path.mkdir() if kind == "folder" else path.write_text("a")

    def refuse(*_args, **_more):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open" if kind == "file" else "iterdir", refuse)
    error = refused(path)
    assert error.what == f"`{path}` cannot be read: Permission denied"
    assert error.hint == f"`chmod u+{'r' if kind == 'file' else 'rx'} {path}`"
    monkeypatch.setattr(os, "geteuid", lambda: path.stat().st_uid + 1)
    assert error.hint != refused(path).hint


def test_what_is_wrong_with_standard_input_names_no_file_of_ours(monkeypatch, tmp_path):
    class Stdin:
        class buffer:  # noqa: N801 - as `sys.stdin` has it
            read = staticmethod(lambda: b"time_s,yaw_rad\n0,1\n1,x\n2,3\n3,4\n")

    monkeypatch.setattr("sys.stdin", Stdin)
    with pytest.raises(LogError) as caught:
        load_run("-")
    assert "`sysid import - --salvage -o imported/`" in caught.value.hint
    assert "/stdin" not in str(caught.value)


TEXTS = {
    "NMEA 0183": "".join(f"$GPRMC,1235{k:02d},A,4807.0,N\n$GPGSA,A,3,{k},23,24,25,26,27\n!AIVDM,1,1,,A,15\n" for k in range(40)),
    "JSON": "".join(f'{{"t": {0.1 * k:.1f}, "yaw": {k}}}\n' for k in range(40)),
    "XML": '<?xml version="1.0"?>\n<gpx>\n' + "".join(f'<trkpt lat="{k}" lon="1"/>\n' for k in range(40)) + "</gpx>\n",
    "CAN bus": "".join(f"(1700000000.{k:06d}) can0 09F10D{k % 16:X}0#FFFC7FFFFF7FFFFF\n" for k in range(40)),
}


@pytest.mark.parametrize("kind", TEXTS)
def test_text_that_is_no_table_is_said_by_name_and_not_to_be_mended(tmp_path, kind):
    log = tmp_path / "log.txt"
    log.write_text(TEXTS[kind])
    with pytest.raises(LogError) as error:
        load_run(log, mapping_of({"time": {"column": 0, "unit": "s"}, "signals": {"yaw_rad": 1}}))
    assert kind in error.value.what
    assert "mend" not in error.value.hint
