"""A user's own effect: started by `sysid effects new`, then known to every command that is run in that folder."""

from __future__ import annotations

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


def test_an_effect_file_that_is_wrong_names_itself(run_cli, folder):
    (folder / "effects").mkdir()
    (folder / "effects" / "bad.yaml").write_text("name: bad\nmoment: k * banana\ncoefficients: {}\n")
    answer = run_cli("effects", "list")
    assert answer.code == 2
    assert "bad.yaml" in answer.err
