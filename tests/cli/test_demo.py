"""`sysid demo`: every step runs, says what it means, and leaves its files; nothing of the user's is replaced."""

from __future__ import annotations

import pytest

from fieldsid.cli import demo
from fieldsid.demo import steps, vehicle
from fieldsid.demo.steps import STEPS


@pytest.fixture(scope="module")
def tour(tmp_path_factory):
    return tmp_path_factory.mktemp("tour") / "demo"


def test_every_step_runs_and_leaves_files_and_figures(run_cli, tour):
    body = run_cli("demo", "-o", tour, "--json").json
    assert body["schema"] == "fieldsid/demo/1"
    assert [s["command"].split()[1] for s in body["steps"]] == [s.line.split()[0] for s in STEPS]
    assert all(s["means"] for s in body["steps"])
    assert body["hidden"]["effect"] == demo.HIDDEN
    assert any(f.endswith(".png") for f in body["files"])
    assert any(f.endswith(".yaml") for f in body["files"])


def test_the_textbook_model_leaves_more_than_the_noise_on_the_tour(run_cli, tmp_path):
    assert vehicle.misfit(vehicle.hidden_vehicle(demo.HIDDEN)) > vehicle.VISIBLE


def test_a_folder_with_files_is_not_touched(run_cli, tmp_path):
    (tmp_path / "mine.txt").write_text("keep")
    answer = run_cli("demo", "-o", tmp_path)
    assert answer.code == 2
    assert "is not empty" in answer.err
    assert [p.name for p in tmp_path.iterdir()] == ["mine.txt"]


def test_a_second_tour_takes_a_folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert demo._folder(None, force=False).name == "sysid-demo"
    (tmp_path / "sysid-demo").mkdir()
    assert demo._folder(None, force=False).name == "sysid-demo-2"


def test_a_mistyped_effect_is_refused_with_the_near_match(run_cli, tmp_path):
    answer = run_cli("demo", "--effect", "servolag", "-o", tmp_path / "new")
    assert answer.code == 2
    assert "did you mean `servo_lag`" in answer.err
    assert not (tmp_path / "new").exists()


def test_patterns_stand_for_the_files_they_match_in_order(tmp_path):
    for name in ("b.csv", "a.csv", "c.txt"):
        (tmp_path / name).touch()
    words = steps.expanded(["import", f"{tmp_path}/*.csv", "-o", "runs"])
    assert words == ["import", f"{tmp_path}/a.csv", f"{tmp_path}/b.csv", "-o", "runs"]
