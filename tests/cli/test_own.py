"""A user's own effect: started by `sysid effects new`, then known to every command that is run in that folder."""

from __future__ import annotations

import re

import pytest
from cli import trial

from fieldsid.effects import forget_effects
from fieldsid.models.axis import Axis


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    forget_effects()


@pytest.mark.parametrize("axis", list(Axis))
def test_a_new_effect_is_read_back_as_it_was_written(run_cli, folder, axis):
    assert run_cli("effects", "new", "tether_drag", "--axis", axis).code == 0
    assert (folder / "effects" / "tether_drag.yaml").is_file()
    body = run_cli("effects", "show", "tether_drag", "--json").json
    assert body["axes"] == [axis]
    assert [c["name"] for c in body["coefficients"]] == ["tether_drag_k"]
    assert body["origin"].endswith("tether_drag.yaml")


def test_two_new_effects_live_side_by_side(run_cli, folder):
    for name in ("one_drag", "other_drag"):
        assert run_cli("effects", "new", name).code == 0
    names = {e["name"] for e in run_cli("effects", "list", "--json").json["effects"]}
    assert {"one_drag", "other_drag", "servo_lag"} <= names


def test_an_own_effect_can_be_identified(run_cli, folder):
    (folder / "effects").mkdir()
    (folder / "effects" / "pull.yaml").write_text(
        'name: pull\nsays: a steady pull\naxes: [yaw]\nmoment: "-pull_k * rate * abs(rate)"\n'
        "coefficients:\n  pull_k: {unit: 1/rad, low: -20, high: 20, start: 0.1}\n"
    )
    (fit,) = run_cli("identify", trial.flown(folder), "--axis", "yaw", "--effects", "pull", "--json").json["fits"]
    found = fit["parameters"]["pull_k"]
    assert abs(found["value"]) < 3.5 * found["std_error"]


def test_an_existing_effect_file_is_kept(run_cli, folder):
    assert run_cli("effects", "new", "mine").code == 0
    answer = run_cli("effects", "new", "mine")
    assert answer.code == 2
    assert "--force" in answer.err


@pytest.mark.parametrize(
    "name",
    ["Bad-Name", "bad name", "9lives", "", "none", "lambda", "servo_lag", "x" * 41, "../up"],
    ids=lambda n: n[:9] or "empty",
)
def test_a_name_that_no_new_effect_can_have_is_refused_and_nothing_is_written(run_cli, folder, name):
    answer = run_cli("effects", "new", name)
    assert (answer.code, answer.out) == (2, "")
    assert "\nhint: " in answer.err
    assert list(folder.rglob("*")) == []


def test_the_longest_name_there_may_be_makes_an_effect_that_can_be_shown(run_cli, folder):
    assert run_cli("effects", "new", "x" * 40).code == 0
    assert run_cli("effects", "show", "x" * 40).code == 0


def test_the_name_of_an_effect_in_another_file_is_taken(run_cli, folder):
    assert run_cli("effects", "new", "mine", "-o", "effects/other.yaml").code == 0
    answer = run_cli("effects", "new", "mine")
    assert answer.code == 2
    assert "there is an effect named 'mine' already\n  found: effects/other.yaml" in answer.err
    assert run_cli("effects", "new", "mine", "-o", folder / "effects" / "other.yaml", "--force").code == 0


def test_a_new_effect_outside_the_folder_is_not_said_to_be_known_here(run_cli, folder):
    assert "effects show mine" not in run_cli("effects", "new", "mine", "-o", "elsewhere/mine.yaml").err
    assert run_cli("effects", "show", "mine").code == 2
    answer = run_cli("effects", "new", "mine", "-o", "effects/mine.txt")
    assert (answer.code, "-o effects/mine.yaml" in answer.err) == (2, True)


GOOD = "name: good\nmoment: '-good_k * rate'\ncoefficients: {good_k: {unit: 1/s, low: 0, high: 9, start: 0.1}}\n"
BROKEN = {
    "expression": GOOD.replace("good", "broken").replace("* rate", "* banana"),
    "yaml": "name: broken\nmoment: [\n",
    "keys": "name: broken\n",
    "coefficient of another": GOOD.replace("name: good", "name: broken"),
}


@pytest.mark.parametrize("text", BROKEN.values(), ids=BROKEN)
def test_a_broken_file_is_told_once_and_does_no_harm_but_to_who_asks_for_it(run_cli, folder, text):
    (folder / "effects").mkdir()
    (folder / "effects" / "a_good.yaml").write_text(GOOD)
    (folder / "effects" / "broken.yaml").write_text(text)
    listed = run_cli("effects", "list", "--json")
    assert "good" in {e["name"] for e in listed.json["effects"]}
    assert listed.err.count("broken.yaml") == listed.err.count("; it takes no part\n  found: ") == 1
    assert "\n  hint: " in listed.err
    run = trial.flown(folder)
    assert run_cli("identify", run, "--axis", "yaw", "--effects", "good", "--json").code == 0
    for asked in (
        ("identify", run, "--axis", "yaw", "--effects", "broken"),
        ("extend", trial.model_file(folder, force=True), run, "--add", "broken"),
        ("effects", "show", "broken"),
    ):
        answer = run_cli(*asked)
        assert (answer.code, answer.out) == (2, "")
        assert answer.err.startswith("error: ")
        assert answer.err.count("broken.yaml") == 1


def test_a_file_with_the_name_of_a_built_in_effect_leaves_that_as_it_is(run_cli, folder):
    (folder / "effects").mkdir()
    (folder / "effects" / "mine.yaml").write_text(GOOD.replace("name: good", "name: stall"))
    shown = run_cli("effects", "show", "stall", "--json")
    assert shown.json["origin"] == "built in"
    assert shown.err.startswith("warning: `effects/mine.yaml`: the name 'stall' is taken; it takes no part")


def test_the_list_says_which_effects_are_not_built_in(run_cli, folder):
    (folder / "effects").mkdir()
    (folder / "effects" / "a_good.yaml").write_text(GOOD)
    out = run_cli("effects", "list").out
    assert out.count("is not built in") == 1
    assert "good is not built in: effects/a_good.yaml\n" in out


def test_python_in_the_folder_is_not_run_and_that_is_said(run_cli, folder):
    (folder / "effects").mkdir()
    (folder / "effects" / "mine.py").write_text("raise SystemExit('this was run')\n")
    listed = run_cli("effects", "list")
    assert listed.code == 0
    assert "warning: `effects/mine.py` is Python: only YAML is read from a folder, and no code is run" in listed.err
    asked = run_cli("effects", "show", "mine")
    assert (asked.code, "`fieldsid.effects`" in asked.err) == (2, True)
    (folder / "effects" / "__init__.py").touch()
    assert run_cli("effects", "list").err == ""


def test_an_effect_named_twice_is_taken_once(run_cli, folder):
    run = trial.flown(folder)
    twice, once = (run_cli("identify", run, "--axis", "yaw", "--effects", e, "--json").json for e in ("stall,stall", "stall"))
    assert twice | {"headline": {}} == once | {"headline": {}}  # which repeats what was typed


@pytest.mark.parametrize("name", ["Servo_Lag", "servo_lag", "None", "9x"])
def test_the_name_that_is_proposed_can_be_taken(run_cli, folder, name):
    answer = run_cli("effects", "new", name)
    assert answer.code == 2
    (better,) = re.findall(r"hint: call it `(\w+)`", answer.err)
    assert run_cli("effects", "new", better).code == 0


def test_help_is_given_whatever_lies_in_the_folder(run_cli, folder):
    (folder / "effects").mkdir()
    (folder / "effects" / "broken.yaml").write_text("name: [\n")
    answer = run_cli("identify", "--help")
    assert (answer.code, answer.err) == (0, "")
