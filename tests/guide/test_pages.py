"""The guide: every page is there and linked, nothing generated is stale, and what it says of commands is what they say."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path

import pytest
from guide import command_pages, effect_pages, make, reference_pages, schema_pages
from guide.blocks import commands_of, filled
from guide.make import GUIDE, WRITTEN
from guide.pictures import LARGEST, alike
from guide.sameness import difference, same
from guide.schema_pages import RESULTS
from guide.session import TOUR
from ruamel.yaml import YAML

from fieldsid.cli.help.catalogue import entries
from fieldsid.effects import all_effects
from fieldsid.guide import all_pages
from fieldsid.logs.mapping.mapping_file import KEYS, mapping_of
from fieldsid.logs.run import SIGNALS

LINK = re.compile(r"!?\[[^\]\n]+\]\(([^)\s]+)\)")
FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
MARKDOWN = sorted(GUIDE.rglob("*.md"))
STALE = difference("", "")

each_page = pytest.mark.parametrize("path", MARKDOWN, ids=lambda p: p.relative_to(GUIDE).as_posix())


@cache
def prose(path):
    """A page without its blocks of code."""
    return FENCE.sub("", path.read_text())


@cache
def anchors(path):
    """The anchors that the repository's page gives a page's headings."""
    words = re.findall(r"^#+ (.*)$", prose(path), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", w.lower()).replace(" ", "-") for w in words}


def test_every_effect_and_every_command_has_its_page():
    topics = set(all_pages())
    assert {f"effects/{n}" for n in all_effects()} | {f"commands/{n}" for n in entries()} <= topics
    assert {f"schemas/{schema_pages.file_of(c).removesuffix('.json')}" for c in RESULTS} <= topics


def test_every_command_that_prints_json_has_its_schema():
    words = [[n, s] if s else [n] for n in entries() for s in command_pages.subcommands(n) or [""]]
    printing = {" ".join(w) for w in words if "--json" in command_pages.help_of(*w)}
    assert printing == set(RESULTS)


@each_page
def test_links_lead_somewhere_inside_the_guide(path):
    for target in LINK.findall(prose(path)):
        file, _, anchor = target.partition("#")
        there = (path.parent / file).resolve() if file else path
        assert there.is_file(), target
        assert there.is_relative_to(GUIDE), target
        assert not anchor or anchor in anchors(there), target


def test_every_page_can_be_reached_from_the_first_one():
    seen, waiting = set(), [GUIDE / "index.md"]
    while waiting:
        page = waiting.pop()
        if page in seen or page.suffix != ".md":
            continue
        seen.add(page)
        waiting += [(page.parent / t.partition("#")[0]).resolve() for t in LINK.findall(prose(page)) if not t.startswith("#")]
    assert set(MARKDOWN) - seen == set()


def test_commands_that_a_page_mentions_are_there():
    mentioned = {(c, p.name) for p in MARKDOWN for c in re.findall(r"(?:^|[`\s])sysid ([a-z][a-z-]+)", p.read_text())}
    assert {(command, page) for command, page in mentioned if command not in entries()} == set()


def test_a_page_begins_with_its_title():
    assert [p.name for p in MARKDOWN if not re.match(r"# \S", p.read_text())] == []


def test_figures_are_small_and_all_are_shown():
    shown = {(p.parent / t).resolve() for p in MARKDOWN for t in LINK.findall(prose(p)) if t.endswith(".png")}
    there = {p.resolve(): p.stat().st_size for p in GUIDE.rglob("*.png")}
    assert set(there) == shown
    assert {p.name: size for p, size in there.items() if size > LARGEST} == {}


def test_the_page_on_the_trial_names_every_column_a_table_may_have():
    text = (GUIDE / "trial.md").read_text()
    assert [name for name in SIGNALS if name not in text] == []


@pytest.mark.parametrize("name", sorted(all_effects()))
def test_an_effects_page_is_what_the_registry_says(name, run_cli):
    effects = run_cli("effects", "list", "--json").json["effects"]
    (effect,) = (e for e in effects if e["name"] == name)
    says = {e["name"]: e["says"] for e in effects}
    was, now = (GUIDE / "effects" / f"{name}.md").read_text(), effect_pages.page(effect, effect_pages.telltale_of(name), says)
    assert was == now, difference(was, now)


DRAWN = ("clock_offset", "quadratic_damping", "servo_lag")
"""Effects whose figure the normal suite draws: one of each stage."""


@pytest.mark.parametrize(
    "name", [*DRAWN, *(pytest.param(n, marks=pytest.mark.slow) for n in sorted({*all_effects()} - {*DRAWN}))]
)
def test_an_effects_figure_is_what_the_code_draws(name):
    drawn = effect_pages.small_png(effect_pages.figure(effect_pages.telltale_of(name)))
    assert alike((GUIDE / "effects" / f"{name}.png").read_bytes(), drawn), STALE


def test_the_list_of_effects_is_what_the_registry_says(run_cli):
    effects = run_cli("effects", "list", "--json").json["effects"]
    assert (GUIDE / "effects" / "index.md").read_text() == effect_pages.index(effects)


@pytest.mark.parametrize("name", sorted(schema_pages.pages()))
def test_a_schema_is_what_the_records_declare(name):
    was, now = (GUIDE / "schemas" / name).read_text(), schema_pages.pages()[name]
    assert (json.loads(was) == json.loads(now)) if name.endswith(".json") else (was == now), STALE


def test_nothing_lies_in_the_generated_folders_that_is_not_generated(guide_session):
    wanted = {f"effects/{n}" for e in all_effects() for n in (f"{e}.md", f"{e}.png")} | {"effects/index.md"}
    wanted |= {f"schemas/{n}" for n in schema_pages.pages()} | {f"commands/{n}" for n in command_pages.pages(guide_session)}
    wanted |= {f"figures/{n}.png" for n in make.FIGURES}
    folders = ("effects", "commands", "schemas", "figures")
    assert {p.relative_to(GUIDE).as_posix() for f in folders for p in (GUIDE / f).iterdir()} == wanted


@pytest.mark.parametrize("name", sorted(entries()))
def test_a_commands_page_is_what_the_command_says(name, guide_session):
    was, now = (GUIDE / "commands" / f"{name}.md").read_text(), command_pages.page(name, guide_session)
    assert same(was, now), difference(was, now)


@pytest.fixture(scope="module")
def reference():
    return reference_pages.pages()


@pytest.mark.parametrize("name", ["mapping.md", "codes.md", "parameters.md"])
def test_a_page_of_reference_is_what_the_code_says(name, reference):
    was, now = (GUIDE / name).read_text(), reference[name]
    assert was == now, difference(was, now)


@pytest.mark.parametrize("name", ["coarse", "ignored_delay", "unit_assumed", "a22", "d2", "delta_r0"])
def test_a_code_and_a_parameter_have_a_section_of_their_own(run_cli, name):
    answer = run_cli("guide", name)
    assert (answer.code, answer.err) == (0, "")
    assert answer.out.startswith(f"{name}\n")


def test_every_example_of_a_mapping_is_taken():
    for where, model in KEYS.items():
        for field in model.model_fields.values():
            body = YAML(typ="safe").load(field.examples[0])
            is_line = where.startswith("a line") or set(body) <= SIGNALS.keys()
            assert mapping_of({"signals": {"yaw_rad": "a"}} | ({"signals": body} if is_line else body)).sources


def test_the_list_of_commands_is_that_of_the_program():
    assert (GUIDE / "commands" / "index.md").read_text() == command_pages.index()


@pytest.mark.parametrize("name", WRITTEN)
def test_what_a_written_page_says_of_commands_is_what_they_say(name, guide_session):
    was = (GUIDE / name).read_text()
    now = filled(was, guide_session.run)
    assert same(was, now), difference(was, now)


def test_the_tour_says_what_each_step_means(guide_session):
    told = " ".join(guide_session.run(TOUR).split())
    assert [step["command"] for step in guide_session.body(TOUR)["steps"] if " ".join(step["means"].split()) not in told] == []


def test_the_page_on_the_trial_takes_every_step_of_the_tour(guide_session):
    ran = {line for line, _ in commands_of((GUIDE / "trial.md").read_text())}
    steps = {step["command"] for step in guide_session.body(TOUR)["steps"]}
    assert {line.split()[1] for line in ran} == {line.split()[1] for line in steps}
    assert ran <= steps


@pytest.mark.parametrize("name", sorted(make.FIGURES))
def test_a_figure_shows_what_the_command_draws(name, guide_session):
    assert alike((GUIDE / "figures" / f"{name}.png").read_bytes(), make.picture(name, guide_session)), STALE


def test_pages_name_no_path_of_a_machine():
    for path in GUIDE.rglob("*"):
        if path.suffix in {".md", ".json"}:
            assert not re.search(r"/(?:tmp|home|root|work|Users|private)/", path.read_text()), path


def test_the_pages_are_inside_the_package():
    assert Path("fieldsid/guide") == GUIDE.relative_to(GUIDE.parents[1])
