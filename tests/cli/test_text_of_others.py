"""Names, units and notes of others on a terminal and in tables: text as it is, no markup, no control codes, no formula."""

from __future__ import annotations

from io import StringIO

import pandas as pd
import pytest
from cli import trial
from hypothesis import given
from hypothesis import strategies as st
from rich.text import Text

from fieldsid.batch.archive import write_table
from fieldsid.cli.console import Terminal, print_file, table, words
from fieldsid.logs import load_run, save_run
from fieldsid.models.axis import Axis
from fieldsid.page import Block

NAMES = ("a[/b]x", "c [bold]d", "[link=http:x]y", "\x1b[31mred", "\x1b]0;t\x07", "one\ntwo", "back\x08", "\u202eabc", ":smile:")
"""What a name may hold that a terminal, or what writes to it, would take for something else."""


def printed(*shown, width=500, **given):
    stream = StringIO()
    Terminal(file=stream, width=width, markup=False, highlight=False, emoji=False, **given).print(*shown, soft_wrap=True)
    return stream.getvalue()


@pytest.mark.parametrize("name", NAMES)
def test_a_cell_a_head_and_a_title_are_text(name):
    out = printed(table(Block(name, ((name, "1.0"),), (name, "number"))))
    shown = name.encode("unicode_escape").decode()
    assert [line.split("  ")[0].rstrip() for line in out.splitlines()] == [shown] * 3


@given(st.text(st.characters(codec=None), max_size=30))
def test_nothing_that_is_printed_steers_a_terminal(text):
    for shown in (text, words(text), Text(text), table(Block(text, ((text,),), (text,)))):
        assert all(line.isprintable() for line in printed(shown).split("\n"))
    assert len(printed(text).splitlines()) <= 1


def test_the_styles_of_a_terminal_are_its_own():
    out = printed(words("a\x1b[0mb", "bold"), force_terminal=True, color_system="standard")
    assert out == "\x1b[1ma\\x1b[0mb\x1b[0m\n"


def test_a_file_is_shown_on_a_terminal_and_written_as_it_is_elsewhere():
    text, streams = "kp: 1\n# \x1b[2J\ttab\n", (StringIO(), StringIO())
    for stream, is_terminal in zip(streams, (False, True), strict=True):
        print_file(Terminal(file=stream, width=80, force_terminal=is_terminal, color_system=None, markup=False), text)
    assert streams[0].getvalue() == text
    assert streams[1].getvalue() == "kp: 1\n# \\x1b[2J\\ttab\n"


@pytest.mark.parametrize("unit", ["[/s]", "[bold]", "[[x", "\\[/]"])
def test_the_unit_of_a_column_is_no_markup(run_cli, tmp_path, unit):
    log = tmp_path / "units.csv"
    log.write_text(f"time [s],heading [deg],count {unit}\n" + "".join(f"{i},{i},1\n" for i in range(50)))
    answer = run_cli("inspect", log)
    assert answer.code == 0, answer.err
    assert f"\ncount {unit} " in answer.out


@pytest.mark.parametrize("name", ["\x1b[31mESC\x1b]0;t\x07", "line\nhint: none", "[x] [bold]y"])
def test_the_name_of_a_file_is_shown_whatever_is_said_of_it(run_cli, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    log = save_run(load_run(trial.flown(tmp_path)), tmp_path / f"{name}.csv")
    shown = name.encode("unicode_escape").decode()
    for line in (
        ["inspect", log],
        ["identify", log, "--axis", "yaw", "-o", "m", "--no-figures"],
        ["import", f"gone{name}", "-o", "o"],
        [name],
    ):
        answer = run_cli(*line)
        assert answer.code in {0, 1, 2}
        said = answer.out + answer.err
        assert all(part.isprintable() for part in said.split("\n")), said
        assert shown in said
        assert "\nhint: none" not in said


def test_a_mapping_is_proposed_on_one_line_for_whatever_file_and_column(run_cli, tmp_path):
    log = tmp_path / "x\nsignals: {}\n#.csv"
    rows = "".join(f"{i},{i},1\n" for i in range(50))
    log.write_text(f'time [s],heading [deg],"rudder\u2028 [deg]"\n{rows}', encoding="utf-8")
    written = tmp_path / "mapping.yaml"
    assert run_cli("inspect", log, "--write-mapping", written).code == 0
    assert sum(line.startswith("signals:") for line in written.read_text(encoding="utf-8").splitlines()) == 1
    assert run_cli("import", log, "-m", written, "-o", tmp_path / "runs").code == 0


@pytest.mark.parametrize("first", "=+-@\t\r")
def test_no_text_in_a_table_of_an_archive_is_a_formula(tmp_path, first):
    name = f"{first}cmd|calc!A1"
    row = {"log": name, "run": name, "status": "done", "says": f"about {name}", "a22": -1.5}
    parquet, csv = write_table(tmp_path, Axis.YAW, [row])
    found = pd.read_csv(csv, keep_default_na=False, lineterminator="\n")
    assert (found.log[0], found.run[0], found.says[0], float(found.a22[0])) == (f"'{name}", f"'{name}", f"about {name}", -1.5)
    assert pd.read_parquet(parquet).log[0] == name


def test_the_name_of_a_run_reaches_no_table_as_markup(run_cli, tmp_path):
    log = trial.flown(tmp_path).rename(tmp_path / "[b]x\x1b[0m.parquet")
    answer = run_cli("identify", log, "--axis", "yaw")
    assert answer.code == 0, answer.err
    assert "\n[b]x\\x1b[0m  a22 " in answer.out
