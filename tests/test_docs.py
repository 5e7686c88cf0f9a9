"""The documents keep up with the program: what they mention is there, and nothing is left out."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from cli import trial

import fieldsid
from fieldsid.cli.help.catalogue import entries
from fieldsid.cli.help.help_page import command_list
from fieldsid.fitting.fit import estimators
from fieldsid.logs.run import SIGNALS

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text()
PAGES = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")


@pytest.mark.parametrize("page", PAGES)
def test_every_command_a_page_mentions_is_there(page):
    mentioned = set(re.findall(r"(?:^|[`\s])sysid ([a-z][a-z-]+)", (ROOT / page).read_text()))
    assert mentioned - set(entries()) == set()


def test_the_readme_lists_every_command_as_the_program_does():
    assert f"```\n{command_list(entries())}\n```" in README, "run .ci/docs"


def test_the_readme_names_every_column_a_table_may_have():
    assert [name for name in SIGNALS if name not in README] == []


def test_the_readme_names_every_method():
    assert [name for name in estimators() if f"`{name}`" not in README] == []


def test_the_readme_holds_the_two_commands_that_ci_runs():
    assert re.findall(r"^pip install .+ && (?:sysid demo|pytest)$", README, re.MULTILINE) == [
        "pip install . && sysid demo",
        'pip install ".[test]" && pytest',
    ]


@pytest.mark.parametrize("page", ["CONTRIBUTING.md"])
def test_every_folder_a_page_names_is_there(page):
    named = re.findall(r"`((?:fieldsid|tests|templates)/[a-z_/]*)", (ROOT / page).read_text())
    assert [n for n in named if not (ROOT / n.rsplit("/", 1)[0]).is_dir()] == []


def test_the_rooms_are_named_as_they_are():
    page = (ROOT / "CONTRIBUTING.md").read_text()
    rooms = {p.parent.name for p in (ROOT / "fieldsid").glob("*/*.py")}
    assert {room for room in rooms if f"`{room}/`" not in page} == set()


def test_the_python_example_of_the_readme_runs_as_written(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs").mkdir()
    for speed in (1.0, 1.4):
        trial.flown(tmp_path / "runs", speed=speed, name=f"pulses_{speed}")
    trial.flown(tmp_path / "runs", spec="zigzag", name="zigzag")
    (example,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    exec(compile(example, "README.md", "exec"), {})  # noqa: S102 - the example is ours
    said = capsys.readouterr().out
    assert said.startswith("zigzag: rate fit 9")
    assert "\nParameters at 1.40 m/s\n" in said
    assert (tmp_path / "parameters.csv").read_text().startswith("parameter,value,std_error,low95,high95,unit\na22,")
    assert (tmp_path / "pulses.png").read_bytes().startswith(b"\x89PNG")


def test_the_functions_the_readme_names_are_there():
    named = set(re.findall(r"\bfs\.([a-z_]+)", README)) | set(re.findall(r"There are (.+?) as well", README)[0].split("`")[1::2])
    assert {"load", "identify", "compare", "diagnose", "turn_radius", "save"} <= named
    assert [name for name in named if not hasattr(fieldsid, name)] == []
