"""The guide's comparisons: rounding is no change, a change is one."""

from __future__ import annotations

import numpy as np
import pytest
from guide.blocks import broken, commands_of, filled
from guide.pictures import alike, small_png
from guide.sameness import near, same, shortened

from fieldsid.figures import canvas


@pytest.mark.parametrize(
    ("was", "now"),
    [
        ("a22 1.104 +/- 0.005", "a22 1.105 +/- 0.005"),
        ("evidence +1063", "evidence +1058"),
        ("0.0053 rad", "0.0054 rad"),
        ("The tour took 47.6 s.", "The tour took 13.2 s."),
        ("models: a.yaml (sha256 cbcd1fd21e01)", "models: a.yaml (sha256 0123456789ab)"),
        ("two  blanks\nand a line", "two blanks and a line"),
    ],
)
def test_what_another_processor_or_another_day_changes_is_the_same(was, now):
    assert same(was, now)


@pytest.mark.parametrize(
    ("was", "now"),
    [
        ("a22 1.104", "a22 1.204"),
        ("effect: servo_lag", "effect: delay"),
        ("5 of 5 runs", "4 of 5 runs"),
        ("b2 -0.8", "b2 0.8"),
        ("one line", "one line and more"),
        ("u^2", "u^3"),
        ("1.02 x", "1.02"),
    ],
)
def test_a_change_is_seen(was, now):
    assert not same(was, now)


def test_a_unit_and_a_half_of_the_last_decimal_is_rounding():
    assert near("0.01", "0.02")
    assert not near("0.01", "0.03")


def test_as_many_lines_are_kept_as_stood_there():
    assert shortened("a\nb\n[...]\nz", "1\n2\n3\n4\n5") == "1\n2\n[...]\n5"
    assert shortened("a\n[...]", "1\n2\n3") == "1\n[...]"
    assert shortened("anything", "1\n2") == "1\n2"


def test_commands_are_found_run_and_filled_in():
    page = "# T\n\n```console\n$ one \\\n    --two\nold\n$ three\n```\n\n```text\n$ not run\n```\n"
    assert commands_of(page) == [("one --two", "old"), ("three", "")]
    assert filled(page, lambda line: f"<{line}>").splitlines()[3:8] == ["$ one --two", "<one --two>", "$ three", "<three>", "```"]


def test_a_long_line_is_broken_before_an_option_and_found_again():
    line = "sysid diagnose demo/runs/learn_*.parquet --axis yaw --validate demo/runs/check_1.2.parquet --figure demo/models/d.png"
    shown = broken(line)
    assert max(map(len, shown.splitlines())) <= 78
    assert "\\\n    --validate demo/runs/check_1.2.parquet" in shown
    assert commands_of(f"```console\n$ {shown}\n```\n") == [(line, "")]


def drawn(values, width=1.5):
    sheet = canvas.sheet(6.0, 3.0)
    canvas.dress(sheet.subplots(), x="time [s]").plot(values, linewidth=width)
    return small_png(sheet)


def test_a_figure_is_the_same_again_and_another_curve_is_seen():
    time = np.linspace(0.0, 10.0, 300)
    figure = drawn(np.sin(time))
    assert figure == drawn(np.sin(time))
    assert alike(figure, drawn(np.sin(time) + 1e-4 * np.cos(9.0 * time)))
    assert not alike(figure, drawn(np.sin(1.05 * time)))
    assert not alike(figure, drawn(-np.sin(time)))


def test_another_version_of_the_library_may_move_letters_but_no_curve(monkeypatch):
    time = np.linspace(0.0, 10.0, 300)
    figure = drawn(np.sin(time))
    monkeypatch.setattr("matplotlib.__version__", "99.0")
    assert alike(figure, drawn(np.sin(time), width=1.8))
    assert not alike(figure, drawn(-np.sin(time)))
