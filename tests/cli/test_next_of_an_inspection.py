"""What `inspect` names as the next command works when pasted, and so does what that names, until there are runs."""

from __future__ import annotations

import gzip
import shlex

import numpy as np
import pytest

HEAD = "time_s,yaw_rad,yaw_rate_rad_s,rudder_rad"


def rows(cell=lambda _: None, skipped=range(0)):
    """A heading that swings under a rudder; `cell` gives another rate for a sample, `skipped` samples are not there."""
    time = 0.1 * np.arange(900)
    swing = 0.4 * np.sin(0.6 * time)
    lines = []
    for i, t in enumerate(time):
        if i not in skipped:
            rate = cell(i) or f"{0.24 * np.cos(0.6 * t):.4f}"
            lines.append(f"{t:.1f},{swing[i]:.4f},{rate},{0.2 * np.sign(np.sin(0.9 * t)):.2f}")
    return lines


def text(head, lines):
    return "\n".join([head, *lines]) + "\n"


LOGS = {
    "whole": lambda: text(HEAD, rows()),
    "without names": lambda: text("x1,x2,x3,x4", [f"{i / 10},{i % 7},{i % 5},{i % 3}" for i in range(900)]),
    "a word among the numbers": lambda: text(HEAD, rows(lambda i: "lost" if i == 300 else None)),
    "words for forty seconds": lambda: text(HEAD, rows(lambda i: "lost" if 200 < i < 600 else None)),
    "rows too long": lambda: text(HEAD, [*rows(), *["1,2,3,4,5,6"] * 3]),
    "a row twice": lambda: text(HEAD, [*rows()[:400], *rows()[399:]]),
    "a hole of 14 s": lambda: text(HEAD, rows(skipped=range(300, 440))),
    "a rate lost for 9 s": lambda: text(HEAD, rows(lambda i: "nan" if 200 < i < 290 else None)),
}


def cut_short(body):
    whole = gzip.compress(body.encode())
    return whole[: 3 * len(whole) // 4]


@pytest.mark.parametrize("log", [*LOGS, "a gzip file cut short"])
def test_the_next_command_of_an_inspection_is_never_refused(run_cli, tmp_path, monkeypatch, log):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / ("log.csv" if log in LOGS else "log.csv.gz")
    path.write_bytes(LOGS[log]().encode() if log in LOGS else cut_short(LOGS["whole"]()))
    line, said = ["inspect", path.name, "--json"], []
    while line[0] in ("inspect", "import"):
        answer = run_cli(*line)
        assert answer.code == 0, (said, answer.err)
        said.append(answer.json["headline"]["next"])
        line = shlex.split(said[-1])[1:]
        line = [*line, "--json"] if line[0] in ("inspect", "import") else line
    if log == "without names":
        assert said == ["sysid inspect log.csv --write-mapping mapping.yaml", "sysid guide trial"]
        assert "under signals" in " ".join(run_cli(*line).out.split())
    else:
        assert line[0] == "identify"
        assert list((tmp_path / "runs").iterdir())


def test_a_log_that_is_refused_as_it_is_is_said_to_be(run_cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "log.csv").write_text(LOGS["words for forty seconds"]())
    body = run_cli("inspect", "log.csv", "--json").json
    assert body["import_options"] == ["--salvage", "--max-gap", "40"]
    (note,) = (f for f in body["findings"] if f["code"] == "refused")
    assert "399 of 900" in note["message"]
    assert "import it with `--salvage --max-gap 40`" in note["message"]


def test_a_second_refusal_keeps_what_the_first_one_asked_for(run_cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "log.csv").write_text(LOGS["words for forty seconds"]())
    refused = run_cli("import", "log.csv", "--salvage", "-o", "runs")
    assert refused.code == 2
    pasted = refused.err.split("accept it: `sysid ")[1].partition("`")[0]
    assert run_cli(*shlex.split(pasted)).code == 0
