"""Long names of runs: what all have in common is left out of a table, and said once; a name alone is never parted."""

from __future__ import annotations

import io

import pytest

from fieldsid.cli.console import Terminal, print_page
from fieldsid.logs.several.run_names import short_names
from fieldsid.page import Block, Page

DAY = "2026-07-14_lake_constance_"


def test_what_all_begin_and_end_with_is_left_out_up_to_the_ends_of_words():
    names = [f"{DAY}pulses_v1.00_run", f"{DAY}pulses_v1.50_run", f"{DAY}port_v1.90_run"]
    short = short_names(names)
    assert [short.of(n) for n in names] == ["...pulses_v1.00...", "...pulses_v1.50...", "...port_v1.90..."]
    assert short.says == f"the names of all runs begin with `{DAY}` and end with `_run`"


@pytest.mark.parametrize("names", [["learn_1.0", "learn_1.4"], [f"{DAY}pulses_v1.00"], ["a" * 30, "b" * 30]])
def test_short_names_one_alone_and_those_with_nothing_in_common_stay(names):
    short = short_names(names)
    assert ([short.of(n) for n in names], short.says) == (names, "")


def test_the_speed_in_a_name_stays_a_number():
    short = short_names([f"{DAY}v1.00", f"{DAY}v1.50"])
    assert short.of(f"{DAY}v1.00") == "...v1.00"


@pytest.mark.parametrize("length", [30, 70, 90])
def test_no_line_of_a_table_ends_within_a_name(length):
    name = "r" * length
    row = (name, "a22", "2.37 +/- 0.22", "1/s", "1.94 .. 2.80", "12.5", "0.0061")
    heads = ("run", "parameter", "value", "unit", "95 % interval", "fit %", "noise")
    to = Terminal(file=io.StringIO(), width=80)
    print_page(to, Page("", blocks=(Block(f"{name}: where it fails", (row,), heads, left=2),)))
    said = to.file.getvalue()
    assert said.count(name) == 2
    assert "2.37 +/- 0.22" in said
