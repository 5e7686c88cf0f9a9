"""One voice: every result begins with its verdict, then what it rests on, then the next command, which can be pasted."""

from __future__ import annotations

import io
import json
import re
import shlex
from collections.abc import Iterator, Sequence
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path

import pytest
from batches import in_this_process
from cli import trial

from fieldsid.cli.app import main
from fieldsid.cli.console import emit
from fieldsid.cli.headlines.headline import LONGEST, Headline
from fieldsid.cli.headlines.typed import pasted, remember, typed_with
from fieldsid.cli.help.catalogue import entries
from fieldsid.cli.trial.parsed import parse
from fieldsid.cli.voice import angles, take
from fieldsid.logs.run import Note
from fieldsid.records.keys import body_of

NO_RESULT = {"guide"}
"""Commands that show a page, which is no result."""
NUMBERLESS = {"init", "effects", "history"}
"""Commands that may come to something without a number."""
TOLD_AS_IT_GOES = {"demo"}
"""Commands whose headline comes at the end of what they tell meanwhile: the tour's own test reads it."""
SPEEDS = (1.0, 1.4)
RUNS = " ".join(f"runs/pulses_{s}.parquet" for s in SPEEDS)
SINGLE = " ".join(f"single/pulses_{s}_yaw.yaml" for s in SPEEDS)
LAGGED = "models/joint_yaw+servo_lag.yaml"
LINES = (
    "init pandan",
    "plan --axis yaw --speeds 1.4 --window 22 --prior torpedo --no-figures -o plan",
    "inspect runs/pulses_1.4.parquet",
    f"import {RUNS} -o again",
    "identify runs/pulses_1.4.parquet --axis yaw",
    f"identify {RUNS} --axis yaw -o single --no-figures",
    f"identify {RUNS} --axis yaw --joint -o models --no-figures",
    f"diagnose {RUNS} --axis yaw --validate runs/zigzag.parquet",
    f"extend models/joint_yaw.yaml {RUNS} --add servo_lag --validate runs/zigzag.parquet",
    f"compare {LAGGED} runs/zigzag.parquet",
    f"compare models/joint_yaw.yaml {LAGGED} runs/zigzag.parquet",
    f"compare models/joint_yaw.yaml {LAGGED}",
    f"history {LAGGED}",
    "history models/joint_yaw.yaml",
    f"extend {LAGGED} --undo",
    f"fit {SINGLE} -o law_yaw.yaml --no-figures",
    f"turn-radius {SINGLE}",
    f"schedule design {LAGGED} -o gains.yaml",
    "schedule verify gains.yaml",
    "schedule export gains.yaml --to ros2 -o gains_ros2.yaml",
    f"simulate {LAGGED} --maneuver zigzag -o zigzag.csv",
    "effects list",
    "effects show servo_lag",
    "effects new mine",
    "live runs/pulses_1.4.parquet --axis yaw --speed 0",
    "batch runs --axis yaw --no-diagnose --workers 1",
    "status",
    "report",
)
READ_ONLY = ("inspect", "identify runs/pulses_1.4.parquet --axis yaw", "diagnose", "compare", "history", "turn-radius",
             "schedule verify", "effects show", "live")  # fmt: skip
QUIET_LINES = tuple(line for line in LINES if line.startswith(READ_ONLY))
"""Command lines that say the same a second time in one folder."""
DAY = ("inspect", "import", "identify", "diagnose", "extend", "turn-radius", "schedule", "schedule", "schedule", "report")


def run(line: str) -> tuple[int, str, str]:
    """Run a command line after `sysid` in the working folder; a pattern stands for its files, as in a shell."""
    words = [w for word in shlex.split(line) for w in (sorted(map(str, Path().glob(word))) if "*" in word else [word])]
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = main(words)
    return code, out.getvalue(), err.getvalue()


def timeless(text: str) -> str:
    """Return a text without how long something took."""
    return re.sub(r"[\d.]+ (s|min)\b", "", text)


def fly(folder: Path, speeds: Sequence[float]) -> None:
    hidden = ("servo_lag", {"lag": 0.35})
    for i, speed in enumerate(speeds):
        trial.flown(folder, speed=speed, seed=i, name=f"pulses_{speed}", hidden=hidden)
    trial.flown(folder, spec="zigzag", speed=1.2, seed=9, name="zigzag", hidden=hidden)


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, tuple[int, str, str]]]:
    """What every command said, one after the other in one folder."""
    folder = tmp_path_factory.mktemp("voice") / "trial"
    fly(folder / "runs", SPEEDS)
    with chdir(folder), in_this_process():
        yield {line: run(line) for line in LINES}


def test_every_command_is_asked() -> None:
    assert {line.split()[0] for line in LINES} | NO_RESULT | TOLD_AS_IT_GOES == set(entries())


@pytest.mark.parametrize("line", LINES)
def test_a_result_says_its_verdict_then_what_it_rests_on_then_what_comes_next(said, line):
    code, out, err = said[line]
    assert code == 0, err
    lines = out.splitlines()
    if line.startswith("live"):  # its looks come first, one a line, while it goes on
        lines = lines[next(i for i, text in enumerate(lines) if text.startswith("rests on ")) - 1 :]
    verdict, rests_on, then = lines[:3]
    assert max(len(verdict), len(rests_on)) <= LONGEST
    assert line.split()[0] in NUMBERLESS or "--undo" in line or re.search(r"\d", verdict)
    assert not verdict.startswith(("warning", "rests on", "next"))
    assert rests_on.startswith("rests on ")
    assert then.startswith("next: ")
    assert lines[3] == ""


@pytest.mark.parametrize(
    "line", [pytest.param(q, marks=pytest.mark.slow) if q.startswith("diagnose") else q for q in QUIET_LINES]
)
def test_a_quiet_command_says_the_first_lines_of_its_result_and_nothing_else(said, line):
    code, out, err = run(f"{line} --quiet")
    assert (code, err) == (0, "")
    whole = said[line][1].split("\n\n")[0].splitlines()
    assert timeless(out).splitlines() == timeless("\n".join(whole[-3:])).splitlines()


@pytest.mark.parametrize("line", LINES)
def test_what_comes_next_is_a_command_line_that_is_understood(said, line):
    (then,) = (text.removeprefix("next: ") for text in said[line][1].splitlines() if text.startswith("next: "))
    assert not re.search(r"\b(RUN|MODEL|LOG|FILE|DIR)\b", then)
    for part in then.split(" && "):
        program, *words = shlex.split(part)
        assert program in ("sysid", "cd", "python")
        assert program != "sysid" or parse(words) is not None, part


def test_a_warning_comes_after_the_headline_and_not_among_the_data(said):
    line = next(text for text in LINES if text.startswith("identify") and "--joint" in text)
    _, out, err = said[line]
    assert "warning: " in err
    assert "warning: " not in out


@pytest.mark.slow
def test_a_day_is_pasted_from_one_next_line_to_the_other(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    fly(tmp_path / "logs", (*SPEEDS, 1.8))
    (tmp_path / "logs" / "zigzag.parquet").unlink()
    line, taken = "inspect logs/pulses_1.4.parquet", []
    while not line.startswith("python"):
        assert len(taken) < len(DAY), taken
        code, out, err = run(line)
        assert code == 0, (line, err)
        taken.append(line.split(maxsplit=1)[0])
        line = out.splitlines()[2].removeprefix("next: ").removeprefix("sysid ")
        if line.startswith("import"):
            line = line.replace("pulses_1.4", "pulses_*")
    assert tuple(taken) == DAY
    assert Path(shlex.split(line)[-1]).is_file()


def test_json_has_the_same_headline(capsys):
    headline = Headline("one is 1.5", "two runs", "sysid status")
    for said in (["--json"], []):
        take(said)
        body = emit({"schema": "x"}, render=lambda to: to.print("table"), headline=headline)
        shown = capsys.readouterr().out
        assert body["headline"] == body_of(headline)
        if said:
            assert json.loads(shown)["headline"] == {"says": "one is 1.5", "rests_on": "two runs", "next": "sysid status"}
        else:
            assert shown == "one is 1.5\nrests on two runs\nnext: sysid status\n\ntable\n"


def test_warnings_are_not_said_under_json(capsys):
    take(["--json"])
    emit({}, render=lambda _to: None, headline=Headline("a", "b"), notes=[Note("code", "said", {})])
    take([])
    assert capsys.readouterr().err == ""


def test_many_files_are_pasted_as_the_pattern_that_stands_for_just_them(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = [Path(f"runs/learn_{i}.parquet") for i in range(5)]
    Path("runs").mkdir()
    for name in [*names, Path("runs/check.parquet")]:
        name.touch()
    assert pasted("identify", names) == "sysid identify runs/learn_*.parquet"
    assert pasted("identify", names[:4]).count("learn_") == 4
    assert pasted("identify", names[:2]) == "sysid identify runs/learn_0.parquet runs/learn_1.parquet"
    assert pasted("identify", tmp_path / "runs" / "a b.csv") == "sysid identify 'runs/a b.csv'"


def test_the_line_under_way_goes_on_with_more_words(tmp_path, monkeypatch):
    remember(["batch", *(f"runs/{i}.csv" for i in range(9)), "--axis", "yaw"])
    monkeypatch.chdir(tmp_path)
    Path("runs").mkdir()
    for i in range(9):
        Path(f"runs/{i}.csv").touch()
    assert typed_with("--trend") == "sysid batch runs/*.csv --axis yaw --trend"
    remember(["identify", "my log.csv", "--axis", "yaw", "--json"])
    assert typed_with("-o", "models/") == "sysid identify 'my log.csv' --axis yaw -o models/"


def test_angles_are_shown_in_degrees_on_demand():
    assert take(["identify", "--deg", "run.csv"]) == ["identify", "run.csv"]
    assert angles().of("rad/s^2") == (pytest.approx(57.29578), "deg/s^2")
    assert angles().of("1/rad") == (pytest.approx(0.0174533), "1/deg")
    assert angles().of("1/s") == (1.0, "1/s")
    assert angles().words("rate: 0.1 .. 0.2 rad/s") == "rate: 5.73 .. 11.5 deg/s"
    take(["identify"])
    assert angles().of("rad") == (1.0, "rad")
    assert angles().of("1") == (1.0, "")
    assert angles().words("fin: above 0.12 rad") == "fin: above 0.12 rad"
