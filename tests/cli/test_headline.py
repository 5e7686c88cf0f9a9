"""The first lines are read at a glance: none is longer than a line has room for, and what it had more is told below."""

from __future__ import annotations

import pytest

from fieldsid.cli.console import emit
from fieldsid.cli.headlines.headline import LONGEST, Headline, split_line
from fieldsid.cli.voice import QUIET, take

CLAUSES = "; ".join(f"clause {i} says that the error is {i}.5 x the noise" for i in range(9))


@pytest.mark.parametrize("text", [CLAUSES, "word " * 90, "x" * 450, CLAUSES.replace("; ", ", "), CLAUSES[:LONGEST]])
def test_a_long_line_is_begun_with_whole_clauses_and_loses_nothing(text):
    first, rest = split_line(text)
    assert len(first) <= LONGEST
    assert (text == first) is not bool(rest)
    kept = [t.replace(";", "").replace(",", "").replace(" ", "") for t in (first.removesuffix(" ...") + rest, text)]
    assert kept[0] == kept[1]
    if rest and "clause" in text:
        assert rest.startswith("clause ")


def test_of_a_short_line_nothing_is_left(capsys):
    assert Headline("a", "b").rest == ()
    assert Headline("a", "b", "sysid status").lines == ("a", "rests on b", "next: sysid status")


@pytest.mark.parametrize("quiet", [False, True])
def test_the_rest_is_told_below_the_first_lines_unless_the_command_is_to_be_quiet(capsys, quiet):
    take([QUIET] if quiet else [])
    emit({}, render=lambda to: to.print("table"), headline=Headline(CLAUSES, CLAUSES, "sysid status"))
    take([])
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines[:3])) <= LONGEST
    assert lines[3:] == ([] if quiet else ["", *(f"... {split_line(t)[1]}" for t in (CLAUSES, f"rests on {CLAUSES}")), "table"])
