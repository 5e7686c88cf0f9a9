"""`sysid guide`: the pages as a reader at a terminal, in a pipe, or in a program gets them."""

from __future__ import annotations

import io
import json
import os
import pty
import re
import subprocess
import sys

import pytest
from rich.console import Console

from fieldsid.cli.help.markdown import rendered
from fieldsid.effects import all_effects
from fieldsid.guide import all_pages, pick_page
from fieldsid.guide.pages import GUIDE


def test_without_a_topic_it_shows_the_contents(run_cli):
    answer = run_cli("guide")
    assert (answer.code, answer.err) == (0, "")
    assert answer.out.startswith("The guide\n")
    top = [topic for topic in all_pages() if "/" not in topic and topic != "index"]
    assert [topic for topic in top if topic not in answer.out] == []


def of_a_kind(topic):
    """Whether a page is another of a folder, of which the normal suite shows the first."""
    folder = topic.partition("/")[0]
    return "/" in topic and topic != min(t for t in all_pages() if t.startswith(f"{folder}/"))


@pytest.mark.parametrize("topic", [pytest.param(t, marks=pytest.mark.slow if of_a_kind(t) else ()) for t in sorted(all_pages())])
def test_every_page_is_shown(run_cli, topic):
    answer = run_cli("guide", topic)
    assert (answer.code, answer.err) == (0, "")
    assert answer.out.startswith(f"{all_pages()[topic].title.replace('`', '')}\n")


def test_an_effect_is_shown_by_its_own_name_as_by_its_folders(run_cli):
    assert run_cli("guide", "servo_lag").out == run_cli("guide", "effects/servo_lag").out
    assert "lag * d(delta)/dt = command - delta\n" in run_cli("guide", "servo_lag").out
    assert pick_page("identify").topic == "commands/identify"
    assert pick_page("effects").topic == "effects"


@pytest.mark.parametrize(
    ("mistyped", "meant"),
    [("theorry", "theory"), ("servo_lagg", "servo_lag"), ("effects/servolag", "effects/servo_lag"), ("identfy", "identify")],
)
def test_a_mistyped_topic_is_refused_with_the_near_ones(run_cli, mistyped, meant):
    answer = run_cli("guide", mistyped)
    assert (answer.code, answer.out) == (2, "")
    assert f"the guide has no topic {mistyped!r}" in answer.err
    assert f"`{meant}`" in answer.err.partition("hint: did you mean ")[2]
    assert pick_page(meant)


def test_as_json_it_lists_the_topics_or_gives_the_text_of_one(run_cli):
    listed = run_cli("guide", "--json").json
    assert listed["schema"] == "fieldsid/guide/1"
    assert [t["topic"] for t in listed["topics"]] == list(all_pages())
    assert listed["topics"][0] == {"topic": "index", "title": "The guide"}
    page = run_cli("guide", "limits", "--json").json
    assert page["text"] == (GUIDE / "limits.md").read_text()
    assert json.loads(run_cli("guide", "schemas/fit", "--json").json["text"])["title"] == "sysid fit --json"


def test_links_become_topics_and_figures_the_files_that_hold_them(run_cli):
    out = " ".join(run_cli("guide", "stall").out.split())
    assert "](" not in out
    assert f"figure: telltale of stall: {GUIDE / 'effects' / 'stall.png'}" in out
    assert "• deadband: small fin angles do nothing" in out
    assert "theory (sysid guide theory)" not in run_cli("guide").out
    assert "turn-radius.json (sysid guide schemas/turn-radius)" in run_cli("guide", "turn-radius").out


@pytest.mark.parametrize("topic", ["trial", "commands/turn-radius"])
def test_what_commands_print_keeps_its_columns(run_cli, topic):
    blocks = re.findall(r"^```(?:console|text)\n(.*?)^```$", (GUIDE / f"{topic}.md").read_text(), re.MULTILINE | re.DOTALL)
    out = run_cli("guide", topic).out
    lines = [line for block in blocks for line in block.splitlines() if line]
    assert [line for line in lines if len(line) <= 80 and line not in out.splitlines()] == []
    assert [line for line in lines if " ".join(line.split()) not in " ".join(out.split())] == []


def test_the_pages_are_in_the_order_of_reading_and_every_effect_is_among_them():
    topics = list(all_pages())
    assert topics[:5] == ["index", "trial", "mapping", "theory", "effects"]
    assert [t for t in topics if t.startswith("effects/")] == [f"effects/{n}" for n in sorted(all_effects())]


def on_a_terminal(*arguments, **variables):
    """What a command writes to a terminal of its own."""
    ours, theirs = pty.openpty()
    env = {k: v for k, v in os.environ.items() if k not in {"PAGER", "MANPAGER", "LESS"}} | {"TERM": "xterm", **variables}
    command = [sys.executable, "-m", "fieldsid", *arguments]
    program = subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, env=env)
    os.close(theirs)
    out = b""
    while True:
        try:
            part = os.read(ours, 65536)
        except OSError:  # the terminal is closed
            break
        if not part:
            break
        out += part
    os.close(ours)
    return program.wait(timeout=60), out.decode()


def test_on_a_terminal_it_goes_through_the_pager():
    code, out = on_a_terminal("guide", "servo_lag", PAGER="sed s/^/page:/")
    assert code == 0
    assert all(line.startswith("page:") for line in out.splitlines() if line)
    assert "\x1b[1" in out


def test_on_a_terminal_other_commands_and_json_do_without_the_pager():
    code, out = on_a_terminal("guide", "servo_lag", "--json", PAGER="sed s/^/page:/")
    assert (code, "page:" in out) == (0, False)


def test_in_a_pipe_there_is_no_pager_and_no_colour():
    done = subprocess.run(
        [sys.executable, "-m", "fieldsid", "guide", "servo_lag"], capture_output=True, text=True, check=True,
        env=os.environ | {"PAGER": "sed s/^/page:/"},
    )  # fmt: skip
    assert done.stdout.startswith("servo_lag\n")
    assert "\x1b" not in done.stdout


def test_the_file_of_a_figure_stays_in_one_piece_on_a_narrow_terminal():
    out = io.StringIO()
    Console(file=out, width=30).print(rendered(pick_page("stall")), crop=False)
    assert str(GUIDE / "effects" / "stall.png") in out.getvalue()
    assert max(len(line) for line in out.getvalue().splitlines() if "stall.png" not in line) <= 30
