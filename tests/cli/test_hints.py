"""Hints are pasted: a command in one is run, an option in one is added, a path in one is given, and then it works."""

from __future__ import annotations

import gzip
import re
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cli import trial

from fieldsid.logs import load_run, save_run
from fieldsid.models.axis import Axis
from fieldsid.models.model import save_model

NOT_TO_PASTE = re.compile(r"\b(RUN|MODEL|LOG|NAME|COLUMN|DIR|LC_ALL)\b")
SNIPPET = re.compile(r"`([^`]+)`")
LOG = "my log.csv"


def table(change=lambda rows: rows):
    """Write a run as a table of text whose rows were changed, under a name with a blank in it."""
    run = load_run(trial.flown(Path()))
    rows = [line.split(",") for line in save_run(run, Path("clean.csv")).read_text().splitlines()]
    Path(LOG).write_text("\n".join(",".join(row) for row in change(rows)) + "\n")


def gap(rows):
    place = rows[0].index("yaw_rad")
    return [r if i < 200 or i > 270 else [*r[:place], "", *r[place + 1 :]] for i, r in enumerate(rows)]


def cell(column, text, row=7):
    def change(rows):
        place = rows[0].index(column)
        return [r if i != row else [*r[:place], text, *r[place + 1 :]] for i, r in enumerate(rows)]

    return change


def foreign(change=lambda rows: rows):
    table(lambda rows: change([["Time", "Heading", "r", "Rudder", "speed"], *rows[1:]]))


def mapped(change):
    foreign(change)
    Path("my map.yaml").write_text("time: {column: Time}\nsignals: {yaw_rad: Heading, rudder_rad: Rudder}\n")


def zipped():
    table()
    packed = gzip.compress(Path(LOG).read_bytes())
    Path("run.csv.gz").write_bytes(packed[: len(packed) // 2])


def model(axis=Axis.YAW, fin_max=0.35, **values):
    """Write a model of a run that it names, with a fin offset of 0.1 rad where nothing else is said."""
    log = trial.flown(Path(), axis)
    made = replace(trial.vehicle(axis, **({"C0": -0.12} if axis is Axis.YAW else {}) | values), trained={"fin_max": fin_max})
    save_model(made, Path("model.yaml"), inputs=[log])


def still():
    run = load_run(trial.flown(Path()))
    save_run(replace(run, signals={**run.signals, "rudder_rad": np.full(len(run), 0.01)}), Path("still.parquet"))


IDENTIFY = f"identify '{LOG}' --axis yaw"
CASES = {
    "a gap": (lambda: table(gap), IDENTIFY),
    "time backwards": (lambda: table(lambda rows: [*rows[:50], *rows[20:]]), IDENTIFY),
    "a word among numbers": (lambda: table(cell("yaw_rad", "ERR")), IDENTIFY),
    "a word among times": (lambda: table(cell("time_s", "ERR")), IDENTIFY),
    "a row without a time": (lambda: table(cell("time_s", "")), IDENTIFY),
    "a row too long": (lambda: table(lambda rows: [*rows[:9], [*rows[9], "1"], *rows[10:]]), IDENTIFY),
    "half a gzip": (zipped, "identify run.csv.gz --axis yaw"),
    "foreign names": (foreign, IDENTIFY),
    "a mapping and a word": (lambda: mapped(cell("Heading", "ERR")), f"{IDENTIFY} --mapping 'my map.yaml'"),
    "channels and a word": (
        lambda: foreign(cell("Heading", "ERR")),
        f"import '{LOG}' --channel time=Time:s --channel yaw_rad=Heading --channel rudder_rad=Rudder:rad -o x",
    ),
    "channels without a time": (foreign, f"import '{LOG}' --channel yaw_rad=1 --channel rudder_rad=Rudder -o x"),
    "a misspelt file": (table, "identify 'my lgo.csv' --axis yaw"),
    "a folder": (lambda: trial.flown(Path("the runs")), "identify 'the runs' --axis yaw"),
    "a model for a log": (model, "identify model.yaml --axis yaw"),
    "a log for a model": (table, f"compare '{LOG}' '{LOG}'"),
    "a fin that never moves": (still, "identify still.parquet --axis yaw"),
    "the other axis": (lambda: trial.flown(Path(), Axis.PITCH), "identify run7.parquet --axis yaw"),
    "effects of a method without": (table, f"identify '{LOG}' --axis yaw --method svf_ls --effects servo_lag"),
    "an output that exists": (table, f"import '{LOG}' -o clean.csv"),
    "a rudder below the offset": (model, "turn-radius model.yaml --rudder-max 0.05"),
    "a rudder in degrees": (model, "turn-radius model.yaml --rudder-max 15"),
    "a fin below the offset": (model, "schedule design model.yaml --fin-limit 0.05"),
    "a fin in degrees": (model, "schedule design model.yaml --fin-limit 15"),
    "an unstable vehicle under P": (lambda: model(a22=-0.2), "schedule design model.yaml --fin-limit 0.3"),
    "a pitch that P cannot damp": (lambda: model(Axis.PITCH, c22=0.1, c23=2.0), "schedule design model.yaml --fin-limit 0.3"),
    "a yaw rate that nothing holds": (lambda: model(a22=-0.2), "turn-radius model.yaml --rudder-max 0.3"),
    "a schedule whose models are gone": (model, "schedule design model.yaml --fin-limit 0.3 --damping 9"),
    "another margin than there is": (model, "schedule design model.yaml --fin-limit 0.3 --phase-margin 90"),
}


def pasted(arguments, snippet):
    """Return the command line that a snippet of a hint makes of another; None where it is not to be pasted."""
    if NOT_TO_PASTE.search(snippet):
        return None
    words = shlex.split(snippet)
    if words[0] == "sysid":
        return words[1:]
    if words[0].startswith("-"):
        kept = list(arguments)
        if words[0] in kept and len(words) > 1:
            place = kept.index(words[0])
            del kept[place : place + 2]
        return [*kept, *words]
    folder, _, name = snippet.rpartition("/")
    paths = sorted(str(p) for p in Path(*shlex.split(folder)).glob(name)) if "*" in name else words
    return [arguments[0], *paths, *arguments[2:]] if all(Path(p).exists() for p in paths) else None


@pytest.mark.parametrize("case", CASES)
def test_what_a_hint_says_can_be_pasted_and_works(run_cli, tmp_path, monkeypatch, case):
    prepare, line = CASES[case]
    arguments = shlex.split(line)

    def refused(folder):
        (tmp_path / folder).mkdir()
        monkeypatch.chdir(tmp_path / folder)
        prepare()
        answer = run_cli(*arguments)
        assert (answer.code, answer.out) == (2, "")
        return answer.err.split("\nhint: ")[1]

    snippets = SNIPPET.findall(refused("first"))
    lines = [made for snippet in snippets if (made := pasted(arguments, snippet)) is not None]
    assert lines, snippets
    for i, made in enumerate(lines):
        refused(str(i))
        answer = run_cli(*made)
        assert answer.code == 0, answer.err
        if made[0] == "inspect" and "--write-mapping" in made:
            assert run_cli(*arguments).code == 0
