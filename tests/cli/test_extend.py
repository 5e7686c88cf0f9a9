"""`sysid extend`: what pays is kept with its lineage, what does not is refused unless the user insists, and undo goes back."""

from __future__ import annotations

import shlex

import hidden_lag
import pytest
from cli import trial

from fieldsid.models.model import load_model
from fieldsid.records.named_inputs import sha256_of
from fieldsid.records.reading import load_record


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    return hidden_lag.files(tmp_path_factory.mktemp("lag"))


@pytest.fixture(scope="module")
def straight(tmp_path_factory):
    return hidden_lag.files(tmp_path_factory.mktemp("none"), lag=0.0)


@pytest.fixture
def parent(tmp_path):
    return trial.model_file(tmp_path)


@pytest.fixture(scope="module")
def extended(run_shared, logs, tmp_path_factory):
    """A model to which the hidden effect was added, and what was said of it."""
    model = trial.model_file(tmp_path_factory.mktemp("extended"))
    asked = ("extend", model, *logs.train, "--add", "servo_lag", "--validate", logs.unseen, "--json")
    return model, run_shared(*asked).json


def test_an_effect_that_pays_is_kept_beside_its_parent_with_its_lineage(logs, extended):
    parent, body = extended
    assert body["schema"] == "fieldsid/extend/1"
    assert body["kept"] is True
    assert body["model"] == str(parent.with_name("truth+servo_lag.yaml"))
    assert body["effects"] == ["servo_lag"]
    assert body["after"]["validation"]["rate_rms_rad_s"] < 0.5 * body["before"]["validation"]["rate_rms_rad_s"]
    assert body["over_floor"]["after"] < 1.1 < body["over_floor"]["before"]
    assert body["coefficients"]["lag"]["value"] == pytest.approx(hidden_lag.LAG, rel=0.1)
    record = load_record(parent.with_name("truth+servo_lag.yaml"), "fieldsid/model")
    assert record["parent"] == {"path": str(parent), "sha256": sha256_of(parent)}
    said = record["info"]["extension"]
    assert said["added"] == ["servo_lag"]
    assert said["after"]["validation"] == pytest.approx(body["after"]["validation"])
    assert [(d["run"], d["role"]) for d in said["data"]][-1] == ("zigzag", "validation")
    assert said["data"][0]["sha256"] == sha256_of(logs.train[0])


@pytest.fixture(scope="module")
def two_missing(tmp_path_factory):
    """A trial whose vehicle lacks two effects: a slow servo and drag that grows with the rate."""
    return hidden_lag.files(tmp_path_factory.mktemp("two missing"), quadratic=4.0)


def test_what_is_left_is_said_and_the_next_command_can_be_pasted(run_cli, two_missing, parent):
    asked = ("extend", parent, *two_missing.train, "--add", "servo_lag", "--validate", two_missing.unseen)
    body = run_cli(*asked, "--json").json
    assert body["kept"]
    assert body["left"]["unseen"] == body["over_floor"]["after"] > 1.15
    assert body["left"]["more_than_noise"]
    answer = run_cli(*asked, "--force")
    said = f"left: {body['left']['unseen']:.2f} x the noise floor on unseen data"
    assert said in answer.out
    (pasted,) = (line.removeprefix("next: sysid ") for line in answer.out.splitlines() if line.startswith("next: "))
    assert pasted == body["next"].removeprefix("sysid ")
    found = run_cli(*shlex.split(pasted), "--json").json
    assert (found["known"], found["effects"]) == (["servo_lag"], ["quadratic_damping"])


def test_where_an_addition_is_not_kept_the_next_command_is_about_the_parent(run_cli, two_missing, parent):
    body = run_cli("extend", parent, *two_missing.train, "--add", "gyro_scale", "--json").json
    assert not body["kept"]
    assert body["left"]["fitted"] > 1.15
    assert shlex.split(body["next"])[-3:] == ["--model", str(parent), "--thorough"]


def test_at_the_noise_the_next_command_uses_the_model(run_cli, extended):
    _, body = extended
    assert not body["left"]["more_than_noise"]
    assert body["next"] == f"sysid turn-radius {body['model']}"
    assert run_cli(*shlex.split(body["next"])[1:]).code == 0


def test_an_effect_that_does_not_pay_is_not_kept_and_nothing_is_written(run_cli, straight, parent):
    asked = ("extend", parent, *straight.train, "--add", "deadband", "--validate", straight.unseen)
    body = run_cli(*asked, "--json").json
    assert (body["kept"], body["model"], body["effects"]) == (False, str(parent), [])
    assert [p.name for p in parent.parent.iterdir()] == ["truth.yaml"]


def test_keep_overrules_and_is_remembered(run_cli, straight, parent, tmp_path):
    out = tmp_path / "kept.yaml"
    answer = run_cli("extend", parent, *straight.train, "--add", "deadband", "--validate", straight.unseen, "--keep", "-o", out)
    assert answer.code == 0
    assert "kept because of --keep: the error on unseen data goes from" in answer.out
    assert max(map(len, trial.below(answer.out))) <= 80
    assert load_model(out).info["extension"]["kept_by"] == "--keep"


def test_undo_gives_the_parent_back(run_cli, logs, parent, tmp_path):
    run_cli("extend", parent, *logs.train, "--add", "servo_lag", "--validate", logs.unseen)
    child = parent.with_name("truth+servo_lag.yaml")
    answer = run_cli("extend", child, "--undo")
    assert answer.code == 0
    assert answer.out.startswith(f"undone: {parent} counts again, with no effects\n")
    body = run_cli("extend", child, "--undo", "-o", tmp_path / "back.yaml", "--json").json
    assert (body["kept"], body["model"], body["effects"]) == (False, str(tmp_path / "back.yaml"), [])
    assert (tmp_path / "back.yaml").read_bytes() == parent.read_bytes()
    parent.write_text(parent.read_text() + "\n")
    changed = run_cli("extend", child, "--undo")
    assert changed.code == 2
    assert "has changed since" in changed.err
    assert run_cli("extend", child, "--undo", "--force").code == 0
    parent.unlink()
    assert "is gone" in run_cli("extend", child, "--undo").err


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--add", "servolag"], "did you mean `servo_lag`"),
        (["--add", "roll_coupling"], "needs roll, which the log lacks"),
        ([], "there is no effect to add"),
        (["--undo"], "`--undo` takes the model alone"),
    ],
)
def test_what_cannot_be_meant_is_refused_with_a_hint(run_cli, logs, parent, arguments, says):
    answer = run_cli("extend", parent, *logs.train, *arguments)
    assert (answer.code, answer.out) == (2, "")
    assert says in answer.err
    assert "\nhint: " in answer.err


def test_without_runs_or_a_parent_there_is_nothing_to_do(run_cli, parent):
    assert "there is no run to fit to" in run_cli("extend", parent, "--add", "delay").err
    answer = run_cli("extend", parent, "--undo")
    assert answer.code == 2
    assert "was not extended from another model" in answer.err
