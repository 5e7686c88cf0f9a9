"""A model with a user's own effect in another folder: its definition travels in the model, and is what is used there."""

from __future__ import annotations

import pytest
from cli import trial

from fieldsid.dynamics.free_run import effects_of
from fieldsid.effects import forget_effects
from fieldsid.models.axis import Axis
from fieldsid.models.model import load_model, save_model
from fieldsid.planning.discriminate.rivals import rivals_named
from fieldsid.records.reading import load_record

PULL = (
    "# drag of a towed line\nname: pull\naxes: [yaw]\nmoment: '-pull_k * rate * abs(rate)'\n"
    "coefficients: {pull_k: {unit: 1/rad, low: 0, high: 2, start: 0.1}}\n"
)


@pytest.fixture
def elsewhere(run_cli, tmp_path, monkeypatch):
    """A folder without the effect, with a model that was made where it is."""
    home, other = tmp_path / "home", tmp_path / "other"
    (home / "effects").mkdir(parents=True)
    other.mkdir()
    (home / "effects" / "pull.yaml").write_text(PULL)
    monkeypatch.chdir(home)
    assert run_cli("effects", "show", "pull").code == 0
    for speed in (1.0, 1.8):
        save_model(trial.vehicle(Axis.YAW, "pull", pull_k=0.8), other / f"m{speed}.yaml")
    monkeypatch.chdir(other)
    forget_effects()
    yield other
    forget_effects()


def test_the_model_holds_the_text_its_hash_and_where_it_lived(elsewhere):
    (entry,) = load_record(elsewhere / "m1.0.yaml", "fieldsid/model")["own_effects"]
    assert entry["text"] == PULL
    assert entry["file"] == str(elsewhere.parent / "home" / "effects" / "pull.yaml")
    assert len(entry["sha256"]) == 64
    assert "  text: |\n" in (elsewhere / "m1.0.yaml").read_text()
    again = save_model(load_model(elsewhere / "m1.0.yaml"), elsewhere / "again.yaml")
    assert again.read_text() == (elsewhere / "m1.0.yaml").read_text()


def test_compare_simulate_and_extend_work_where_the_effect_is_not(run_cli, elsewhere):
    assert run_cli("effects", "show", "pull").code == 2
    run = elsewhere / "zigzag.csv"
    assert run_cli("simulate", "m1.0.yaml", "--maneuver", "zigzag", "--noise", "1", "-o", run).code == 0
    (seen,) = run_cli("compare", "m1.0.yaml", run, "--json").json["runs"]
    assert seen["rate_rms_rad_s"] == pytest.approx(0.004, rel=0.2)
    body = run_cli("extend", "m1.0.yaml", run, "--add", "servo_lag", "--keep", "--json").json
    assert body["effects"] == ["pull", "servo_lag"]
    assert load_model(elsewhere / "m1.0+servo_lag.yaml").own == load_model(elsewhere / "m1.0.yaml").own
    history = run_cli("history", "m1.0+servo_lag.yaml", "--json").json
    assert [g["effects"] for g in history["generations"]] == [["pull"], ["pull", "servo_lag"]]


def test_turning_and_gains_work_where_the_effect_is_not(run_cli, elsewhere):
    rows = run_cli("turn-radius", "m1.0.yaml", "--rudder-max", "0.3", "--method", "steady", "--json").json["rows"]
    assert all(row["radius_m"] > 0 for row in rows)
    assert run_cli("schedule", "design", "m1.0.yaml", "--fin-limit", "0.26", "-o", "gains.yaml").code == 0
    assert run_cli("schedule", "verify", "gains.yaml").code == 0


def test_diagnose_and_plan_take_the_models_own_effect_for_known(run_cli, elsewhere):
    run = elsewhere / "pulses.csv"
    run_cli("simulate", "m1.0.yaml", "--maneuver", "square_pulses", "--noise", "1", "-o", run)
    body = run_cli("diagnose", run, "--axis", "yaw", "--model", "m1.0.yaml", "--json").json
    assert body["known"] == ["pull"]
    assert all("pull" not in c["effect"].split("+") for c in body["candidates"])
    plain, delayed = rivals_named(load_model(elsewhere / "m1.0.yaml"), ["none", "delay"])
    assert [e.name for e in effects_of(plain)] == ["pull"]
    assert [e.name for e in effects_of(delayed)] == ["pull", "delay"]


def test_another_definition_of_the_same_name_is_said_and_the_models_is_used(run_cli, elsewhere):
    run = elsewhere / "zigzag.csv"
    run_cli("simulate", "m1.0.yaml", "--maneuver", "zigzag", "--noise", "1", "-o", run)
    alone = run_cli("compare", "m1.0.yaml", run, "--json")
    assert alone.err == ""
    (elsewhere / "effects").mkdir()
    (elsewhere / "effects" / "pull.yaml").write_text("# the same in other words\n" + PULL.replace("# drag of a towed line\n", ""))
    assert run_cli("compare", "m1.0.yaml", run, "--json").err == ""
    (elsewhere / "effects" / "pull.yaml").write_text(PULL.replace("* abs(rate)", "* 9"))
    answer = run_cli("compare", "m1.0.yaml", run, "--json")
    assert answer.json["runs"] == alone.json["runs"]
    assert answer.err.startswith("warning: m1.0.yaml: effect `pull` here (effects/pull.yaml) is another one than the model's")
    assert "[effect_differs]" in run_cli("turn-radius", "m1.0.yaml", "--rudder-max", "0.3", "--method", "steady").err


def test_models_that_differ_in_an_effect_of_one_name_each_keep_their_own(run_cli, elsewhere):
    stronger = (elsewhere / "m1.8.yaml").read_text()
    home = elsewhere.parent / "home"
    (home / "effects" / "pull.yaml").write_text(PULL.replace("* rate *", "* 2 * rate *"))
    with pytest.MonkeyPatch.context() as there:
        there.chdir(home)
        run_cli("effects", "list")
        save_model(trial.vehicle(Axis.YAW, "pull", pull_k=0.8), elsewhere / "twice.yaml")
    forget_effects()
    ends = [
        run_cli("simulate", m, "--maneuver", "doublet", "--json").json["signals"]["yaw_rad"]["end"]
        for m in ("m1.8.yaml", "twice.yaml", "m1.8.yaml")
    ]
    assert ends[0] == ends[2] != ends[1]
    assert (elsewhere / "m1.8.yaml").read_text() == stronger


def test_an_effect_whose_coefficient_the_models_own_has_cannot_be_added(run_cli, elsewhere):
    run = trial.flown(elsewhere)
    (elsewhere / "effects").mkdir()
    (elsewhere / "effects" / "push.yaml").write_text(PULL.replace("name: pull", "name: push"))
    answer = run_cli("extend", "m1.0.yaml", run, "--add", "push")
    assert answer.code == 2
    assert "coefficient 'pull_k' of effect 'push' is a name of effect 'pull'" in answer.err
    answer = run_cli("diagnose", run, "--axis", "yaw", "--model", "m1.0.yaml")
    assert (answer.code, "`push` has a coefficient `pull_k`, as effect `pull` has" in answer.err) == (0, True)


def test_a_definition_that_was_changed_in_the_model_is_refused(run_cli, elsewhere):
    path = elsewhere / "m1.0.yaml"
    path.write_text(path.read_text().replace("-pull_k * rate", "+pull_k * rate"))
    answer = run_cli("simulate", path, "--maneuver", "zigzag")
    assert answer.code == 2
    assert "the definition of effect `pull` is not the one that the model was made with" in answer.err


def test_a_model_that_does_not_say_where_its_effect_lived_says_so(run_cli, elsewhere):
    path = elsewhere / "m1.0.yaml"
    text = path.read_text()
    path.write_text(text[: text.index("own_effects:")] + text[text.index("method:") :])
    for asked in (("compare", path, "none.csv"), ("extend", path, "none.csv", "--add", "delay"), ("history", path)):
        answer = run_cli(*asked)
        assert answer.code == 2
        assert answer.err.startswith(f"error: `{path}`: the model holds effect `pull`, which is not known here\n  found: ")
        assert "`effects/`" in answer.err
