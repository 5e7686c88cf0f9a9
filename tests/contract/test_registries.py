"""Registries are folders: each file holds one object of the right kind, named like the file."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import pytest

from fieldsid.errors import FieldsidError
from fieldsid.registry import members, near, pick

PACKAGE = Path(__file__).resolve().parents[2] / "fieldsid"

REGISTRIES = {
    "fieldsid.effects": "EFFECT",
    "fieldsid.maneuvers": "MANEUVER",
    "fieldsid.estimators": "ESTIMATOR",
    "fieldsid.logs.readers": "READER",
    "fieldsid.exports": "EXPORT",
}
FILES = [
    (package, attribute, file)
    for package, attribute in REGISTRIES.items()
    for file in sorted(PACKAGE.joinpath(*package.split(".")[1:]).glob("[!_]*.py"))
]


@pytest.mark.parametrize(("package", "attribute", "file"), FILES, ids=lambda v: v.stem if isinstance(v, Path) else v)
def test_a_file_holds_one_object_named_like_the_file(package, attribute, file):
    module = import_module(f"{package}.{file.stem}")
    assert getattr(module, attribute).name == file.stem
    assert pick(package, attribute, file.stem) is getattr(module, attribute)


@pytest.mark.parametrize("package", REGISTRIES)
def test_a_mistyped_name_is_refused_and_the_known_ones_named(package):
    with pytest.raises(FieldsidError) as caught:
        pick(package, REGISTRIES[package], "no_such_thing")
    assert all(name in caught.value.found for name in members(package, REGISTRIES[package]))
    assert caught.value.hint


def test_a_file_whose_object_has_another_name_is_refused(tmp_path, monkeypatch):
    folder = tmp_path / "misnamed"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    (folder / "one.py").write_text("from types import SimpleNamespace\nTHING = SimpleNamespace(name='two')\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(FieldsidError, match="'one'"):
        members("misnamed", "THING")


def test_a_folder_of_helpers_beside_the_members_is_none_itself(tmp_path, monkeypatch):
    folder = tmp_path / "with_helpers"
    (folder / "helpers").mkdir(parents=True)
    for place in (folder, folder / "helpers"):
        (place / "__init__.py").write_text("")
    (folder / "one.py").write_text("from types import SimpleNamespace\nTHING = SimpleNamespace(name='one')\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert set(members("with_helpers", "THING")) == {"one"}


@pytest.mark.parametrize(
    ("word", "known", "hint"),
    [
        ("roll_deg", ("t", "hdg_deg", "fin_deg"), "choose one of: fin_deg, hdg_deg, t"),
        ("roll rate [deg/s]", ("t", "yaw rate [deg/s]"), "choose one of: t, yaw rate [deg/s]"),
        ("yw_rate_deg_s", ("roll_rate_deg_s", "yaw_rate_deg_s"), "did you mean `yaw_rate_deg_s`?"),
        ("aa", ("t", "a"), "did you mean `a`?"),
        ("rate", ("t", "yaw_rate"), "did you mean `yaw_rate`?"),
    ],
)
def test_names_that_share_no_more_than_their_unit_are_not_offered_for_each_other(word, known, hint):
    assert near(word, known) == hint
