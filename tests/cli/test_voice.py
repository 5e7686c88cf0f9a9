"""`--quiet` and `-v` on every command: what is said besides the result."""

from __future__ import annotations

import io
from itertools import pairwise
from logging import getLogger

import pytest
from cli import trial
from rich.console import Console

from fieldsid.cli.console import heard, one_of_each_kind, print_page, shortened, shows_progress, table
from fieldsid.cli.voice import Voice, take, voice
from fieldsid.logs.run import Note
from fieldsid.page import Block, Page, dense, folded, html_of, text_of

LONG = "run7: " + "the fin was at its limit for a long time, which says less of the authority; " * 3 + "[saturated]"


@pytest.fixture(autouse=True)
def afterwards():
    yield
    take([])


def test_the_voice_of_a_command_ends_with_it(run_cli):
    run_cli("effects", "list", "--quiet", "--deg")
    assert voice() == Voice()


def test_what_a_function_tells_is_printed_once_also_by_a_command_of_a_tour(capsys):
    tell = getLogger("fieldsid").info
    with heard(), heard():
        tell("the largest fin of the runs is taken")
    tell("and no command hears this")
    assert capsys.readouterr().err == "the largest fin of the runs is taken\n"


def test_a_quiet_command_does_not_say_where_it_goes_on_from(run_cli, tmp_path):
    line = ("live", trial.flown(tmp_path), "--axis", "yaw", "--speed", "0", "--state", tmp_path / "s")
    run_cli(*line)
    assert "going on from" in run_cli(*line).err
    assert run_cli(*line, "--quiet").err == ""


def test_what_is_to_be_redirected_stays_whole_however_quiet_it_is(run_cli, tmp_path):
    run_cli("identify", trial.flown(tmp_path), "--axis", "yaw", "-o", tmp_path, "--no-figures")
    run_cli("schedule", "design", tmp_path / "run7_yaw.yaml", "-o", tmp_path / "gains.yaml")
    answer, loud = (run_cli("schedule", "export", tmp_path / "gains.yaml", "--to", "ros2", *q) for q in (["--quiet"], []))
    assert (answer.err, answer.out) == ("", loud.out)
    assert "ros__parameters" in answer.out


def test_a_page_of_the_guide_and_json_stay_whole(run_cli):
    assert run_cli("guide", "theory", "--quiet").out == run_cli("guide", "theory").out
    assert run_cli("effects", "list", "--json", "--quiet").out == run_cli("effects", "list", "--json").out


def test_why_the_exit_code_is_not_0_is_said_however_quiet_it_is(run_cli, tmp_path):
    broken = tmp_path / "broken.csv"
    broken.write_text("no,log\n")
    answer = run_cli("identify", trial.flown(tmp_path), broken, "--axis", "yaw", "-o", tmp_path, "--quiet")
    assert answer.code == 1
    assert len(answer.out.splitlines()) == 3
    assert "skipped `" in answer.err


def test_a_bar_is_drawn_on_a_terminal_unless_it_is_to_be_quiet():
    on_terminal = Console(force_terminal=True)
    take(["identify"])
    assert shows_progress(on_terminal)
    assert not shows_progress(Console(force_terminal=False))
    take(["identify", "--quiet"])
    assert not shows_progress(on_terminal)


def test_errors_are_said_however_quiet_it_is(run_cli, tmp_path):
    answer = run_cli("identify", tmp_path / "nowhere.csv", "--axis", "yaw", "--quiet")
    assert answer.code == 2
    assert "there is no log" in answer.err


def test_a_warning_has_one_line_and_keeps_its_code():
    take(["identify"])
    assert len(shortened(LONG, 80)) <= 80 - len("warning: ")
    assert shortened(LONG, 80).endswith("[saturated] -v")
    assert shortened("short [code]", 80) == "short [code]"


def test_with_v_it_is_whole():
    assert take(["demo", "-v"]) == ["demo", "-v"]
    assert take(["identify", "-v", "run.csv"]) == ["identify", "run.csv"]
    assert voice().is_verbose
    assert shortened(LONG, 80) == LONG


def test_what_follows_two_dashes_is_no_option():
    assert take(["inspect", "--quiet", "--", "-v"]) == ["inspect", "--", "-v"]
    assert voice().is_quiet
    assert not voice().is_verbose


NUMBERS = ("0.014 +/- 0.020", "-0.025 .. 0.053", "1.40")


def on_a_terminal_of(width, made):
    to = Console(file=io.StringIO(), width=width, force_terminal=False)
    to.print(made)
    return to.file.getvalue()


def test_a_table_that_does_not_fit_a_narrow_terminal_is_shown_row_by_row_with_its_numbers_whole():
    columns = ("run", "parameter", "value", "95 % interval", "m/s")
    shown = on_a_terminal_of(
        40, table(Block("numbers", (("pulses_1.4", "C0", *NUMBERS), ("", "a22", "1", "", "2")), columns, left=2))
    )
    lines = shown.splitlines()
    assert all(len(line) <= 40 for line in lines)
    assert all(any(line.rstrip().endswith(f"  {n}") for line in lines) for n in NUMBERS)
    assert lines[0] == "numbers"
    assert sum(line.startswith("run") for line in lines) == 1
    assert sum(line.startswith("95 % interval") for line in lines) == 1


@pytest.mark.parametrize("width", [40, 80])
def test_a_column_whose_name_is_longer_than_the_page_is_shown_in_one_piece(width):
    name = "joint_yaw" + "+quadratic_damping" * 5
    to = Console(file=io.StringIO(), width=width, force_terminal=False)
    print_page(to, Page("", blocks=(Block("", (("run7", "14.01", "1.30"),), ("run", "joint_yaw", name)),)))
    lines = to.file.getvalue().splitlines()
    assert f"{name}  1.30" in lines
    assert any(line.split() == ["joint_yaw", "14.01"] for line in lines)


def test_a_table_that_fits_or_a_page_that_is_wide_keeps_its_columns():
    small = table(Block("", (("a", "1.4"),), ("run", "m/s")))
    assert on_a_terminal_of(40, small).splitlines()[0].split() == ["run", "m/s"]
    wide = table(Block("", (("it is said " * 9, "1.4"),), ("why", "value")))
    assert on_a_terminal_of(80, wide).splitlines()[0].split() == ["why", "value"]


@pytest.mark.parametrize("width", [45, 60, 80, 120])
@pytest.mark.parametrize("many", [1, 3, 9, 14])
@pytest.mark.parametrize(
    "name", ["a", "speed_varying +servo_lag +sway_coupling", "joint_yaw_of_a_day_in_july_with_no_blank_in_it"]
)
def test_no_number_is_ever_broken_inside_its_cell(width, many, name):
    columns = ("what it is of", *(f"value {i}" for i in range(many)))
    cells = [f"-0.{i:02d}874" if i % 2 else f"-{i}.5 .. {i}.5" for i in range(many)]
    shown = on_a_terminal_of(width, table(Block("", ((name, *cells),), columns)))
    assert all(len(line.rstrip()) <= width for line in shown.splitlines())
    for cell in cells:
        assert any(cell in line for line in shown.splitlines()), shown


def test_a_column_of_words_behind_the_first_is_folded_and_the_numbers_beside_it_are_not():
    rows = [("run7", "2400", "yaw_rad, yaw_rate_rad_s, rudder_rad, surge_m_s, depth_m, pitch_rad, roll_rad, x_m, y_m")]
    lines = on_a_terminal_of(60, table(Block("", tuple(rows), ("run", "samples", "signals")))).splitlines()
    assert lines[0].split() == ["run", "samples", "signals"]
    assert any(line.startswith("run7") and "2400" in line for line in lines)


@pytest.mark.parametrize("width", range(12, 60))
def test_a_sentence_is_folded_but_never_between_a_number_and_its_unit_or_its_error(width):
    said = "limits: heading 60 deg (1.05 rad); C0 to +/- 0.0024 rad/s^2 of 5 .. 9 deg, 1.2 +/- 0.3 1/s and 8 % at 1.8 m/s"
    lines = folded(said, width, rest="").split("\n")
    assert " ".join(lines) == said
    for end, begin in pairwise(lines):
        assert not begin.startswith(("..", "+/-", "%", "deg", "m/s", "rad", "1/s"))
        assert not end.endswith(("..", "+/-"))


def test_a_page_on_a_terminal_is_folded_like_any_other_text():
    to = Console(file=io.StringIO(), width=40)
    print_page(to, Page("", blocks=("the longest of all these sentences: 60 deg",)))
    assert to.file.getvalue() == "the longest of all these sentences:\n60 deg\n"


def test_a_column_that_nothing_stands_in_is_left_out_wherever_a_table_is_shown():
    block = Block("", (("a", "", "1"), ("b", "", "2")), ("run", "unseen", "fitted"), left=2)
    assert dense(block) == Block("", (("a", "1"), ("b", "2")), ("run", "fitted"))
    page = Page("", blocks=(block,))
    to = Console(file=io.StringIO(), width=80)
    print_page(to, page)
    assert all("unseen" not in shown for shown in (to.file.getvalue(), text_of(page), html_of(page)))


def test_a_warning_that_names_its_run_is_not_told_whose_it_is():
    notes = [("a", "run7", Note("speed_changing", "run 'run7': the speed changes")), ("b", "run7", Note("short", "too short"))]
    assert [n.message for n in one_of_each_kind(notes)] == ["run 'run7': the speed changes", "run7: too short"]
