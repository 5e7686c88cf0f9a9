"""The pages of help: what they promise is there, and every leaf of them takes what the front page says all take."""

from __future__ import annotations

import re
import shlex

import pytest

from fieldsid.cli.help.catalogue import entries
from fieldsid.cli.help.command_order import COMMAND_ORDER
from fieldsid.cli.options import ANSWER, GROUPS
from fieldsid.cli.trial.parsed import parse
from fieldsid.templates import template_names, template_path

LONGEST_GROUP = 10
"""Options of one group at most: more are no longer taken in at a glance."""
LEAVES = [
    *((name,) for name in entries() if name not in ("effects", "schedule")),
    *(("effects", sub) for sub in ("list", "show", "new")),
    *(("schedule", sub) for sub in ("design", "verify", "export")),
]


def test_no_group_of_the_front_page_waits_for_a_command_that_is_not_there():
    assert [name for _, names in COMMAND_ORDER for name in names if name not in entries()] == []


@pytest.mark.parametrize("group", ["effects", "schedule"])
def test_the_leaves_are_those_of_the_program(run_cli, group):
    page = run_cli(group, "--help").out
    subs = re.findall(r"^  ([a-z]+)  ", page[page.index("Commands:") :], re.MULTILINE)
    assert subs == [leaf[1] for leaf in LEAVES if leaf[0] == group]


@pytest.mark.parametrize("leaf", LEAVES, ids=" ".join)
def test_a_page_of_help_says_what_is_so(run_cli, leaf):
    page = run_cli(*leaf, "--help")
    assert page.code == 0
    words = " ".join(page.out.split())
    assert "--json Print one JSON object" in words
    assert "the paper" not in words
    assert set(re.findall(r"`?sysid ([a-z][a-z-]+)", words)) <= set(entries())


def test_what_is_asked_of_a_new_effect_is_not_what_is_asked_of_a_known_one(run_cli):
    pages = [" ".join(run_cli("effects", sub, "--help").out.split()) for sub in ("list", "show", "new")]
    of = dict(zip(("list", "show", "new"), pages, strict=True))
    assert "--axis <yaw|pitch> Only the effects of this plane." in of["list"]
    assert "Only the effects" not in of["new"]
    assert "as in `sysid effects list`" in of["show"]
    assert "as in `sysid effects list`" not in of["new"]


@pytest.mark.parametrize("name", template_names())
def test_a_template_promises_no_command_that_is_not_there(name):
    comments = re.findall(r"#(.*)", template_path(name).read_text())
    named = {word for line in comments for word in re.findall(r"sysid ([a-z][a-z-]+)", line)}
    promised = {word for line in comments for word in ("report", "online", "live", "status") if re.search(rf"\b{word}\b", line)}
    assert (named | promised) - set(entries()) == set()


@pytest.mark.parametrize("name", ["sway_coupling", "heave_coupling", "speed_varying"])
def test_a_source_is_one_that_a_reader_can_find(run_cli, name):
    assert "the paper" not in run_cli("effects", "show", name, "--json").json["source"]


@pytest.mark.parametrize("leaf", [*LEAVES, ("effects",), ("schedule",)], ids=" ".join)
def test_every_page_has_an_example_on_one_line_that_is_understood(run_cli, leaf):
    examples = re.findall(r"^ *Example: sysid (.*)$", run_cli(*leaf, "--help").out, re.MULTILINE)
    assert examples
    for line in examples:
        assert line.startswith(" ".join(leaf))
        parsed = parse(shlex.split(line))
        assert parsed is not None
        assert parsed.name.split() in ([*leaf], *([*l] for l in LEAVES if l[:1] == leaf))


def test_no_group_of_options_is_long(run_cli):
    for leaf in LEAVES:
        groups = re.split(r"^(?=\S[^\n]*:$)", run_cli(*leaf, "--help").out, flags=re.MULTILINE)[1:]
        assert max(len(re.findall(r"^  -", group, re.MULTILINE)) for group in groups) <= LONGEST_GROUP, leaf


def test_the_groups_of_a_page_come_in_one_order_and_the_ways_to_answer_last(run_cli):
    for leaf in LEAVES:
        titles = re.findall(r"^(\S[^\n]*):$", run_cli(*leaf, "--help").out, re.MULTILINE)
        shared = [t for t in titles if t in GROUPS]
        assert shared == sorted(shared, key=GROUPS.index)
        assert titles[-1] == ANSWER
