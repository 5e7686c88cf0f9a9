"""The functions give what the commands give, from files, tables and records alike."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from cli import trial

import fieldsid as fs
from fieldsid.artifacts import plain
from fieldsid.effects import all_effects, forget_effects
from fieldsid.errors import ArtifactError, UsageError
from fieldsid.face import fits as steps
from fieldsid.face.several import Several


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Pulses at two speeds and a zig-zag of a vehicle of known numbers, with the models of the pulses."""
    place = tmp_path_factory.mktemp("trial")
    for speed in (1.0, 1.4):
        trial.flown(place, speed=speed, name=f"pulses_{speed}")
    trial.flown(place, spec="zigzag", name="zigzag")
    for fit in fs.identify(place / "pulses_*.parquet", "yaw"):
        fs.save(fit, place / f"{fit.model.runs[0]}.yaml")
    return place


@pytest.fixture
def inside(folder, monkeypatch):
    monkeypatch.chdir(folder)
    return folder


def test_identify_gives_the_fits_of_the_command(run_cli, inside):
    options = ("--axis", "yaw", "--joint", "--effects", "servo_lag", "--method", "output_error", "--to", "25")
    (theirs,) = run_cli("identify", "pulses_1.0.parquet", "pulses_1.4.parquet", *options, "--json").json["fits"]
    (fit,) = fs.identify("pulses_*.parquet", "yaw", joint=True, effects="servo_lag", method="output_error", end=25.0)
    assert fit.to_frame()["value"].to_dict() == {n: p["value"] for n, p in theirs["parameters"].items()}
    assert [list(row) for row in fit.to_frame()[["low95", "high95"]].to_numpy()] == [
        p["interval95"] for p in theirs["parameters"].values()
    ]
    assert "+".join(fit.model.runs) == theirs["run"]


def test_the_axis_is_that_which_the_runs_excite_where_none_is_given(inside):
    (told,), (seen,) = (fs.identify("pulses_1.4.parquet", *axis) for axis in (("yaw",), ()))
    assert (seen.model.axis, seen.model.values) == (told.model.axis, told.model.values)


def test_tables_give_the_fit_of_their_files(inside):
    runs = fs.load("pulses_*.parquet")
    (of_files,) = fs.identify("pulses_*.parquet", "yaw", joint=True)
    (of_tables,) = fs.identify([run.to_frame() for run in runs], "yaw", joint=True)
    assert of_tables.model.values == of_files.model.values
    assert of_tables.model.runs == of_files.model.runs


def test_compare_gives_the_comparison_of_the_command_whatever_holds_the_model(run_cli, inside):
    (theirs,) = run_cli("compare", "pulses_1.4.yaml", "zigzag.parquet", "--json").json["runs"]
    (fit,) = fs.identify("pulses_1.4.parquet", "yaw")
    zigzag = fs.load("zigzag.parquet")
    for model in ("pulses_1.4.yaml", fs.load_model("pulses_1.4.yaml"), fit, Several([fit]), SimpleNamespace(model=fit.model)):
        (found,) = fs.compare(model, zigzag)
        row = found.to_frame().loc["zigzag"]
        assert row["rate_rms_rad_s"] == theirs["rate_rms_rad_s"]
        assert row["angle_fit_percent"] == theirs["angle_fit_percent"]


def test_one_model_is_not_several(inside):
    fits = fs.identify("pulses_*.parquet", "yaw")
    with pytest.raises(UsageError, match="this takes one model") as caught:
        fs.compare(fits, "zigzag.parquet")
    assert caught.value.found == "2 models"
    with pytest.raises(UsageError, match="that is no model"):
        fs.compare(3, "zigzag.parquet")
    with pytest.raises(UsageError, match="nothing to work on"):
        fs.turn_radius([])


def test_turn_radius_gives_the_rows_of_the_command_from_files_fits_and_laws(run_cli, inside):
    models = ("pulses_1.0.yaml", "pulses_1.4.yaml")
    theirs = run_cli("turn-radius", *models, "--speeds", "1.0:1.4:0.2", "--rudder-max", 0.3, "--json").json["rows"]
    fits = fs.identify("pulses_*.parquet", "yaw")
    for source in ("pulses_*.yaml", list(models), fits):
        ours = fs.turn_radius(source, speeds=[1.0, 1.2, 1.4], rudder_max=0.3).to_frame()
        assert list(ours["radius_m"]) == [r["radius_m"] for r in theirs]
        assert [list(i) for i in ours["interval95"]] == [r["interval95"] for r in theirs]
    by_laws = fs.turn_radius(fs.fit_laws(fits), speeds="1.0,1.4", rudder_max=0.3)
    assert [r.radius for r in by_laws.rows] == pytest.approx([r["radius_m"] for r in theirs if r["speed_m_s"] != 1.2], rel=0.35)


def test_a_law_of_ones_own_is_taken(inside):
    own = fs.turn_radius("pulses_*.yaml", speeds=[1.2], rudder_max=0.3, law="a22=2.0")
    given = fs.turn_radius("pulses_*.yaml", speeds=[1.2], rudder_max=0.3)
    assert own.rows[0].radius > 1.5 * given.rows[0].radius


def test_the_rudder_is_the_vehicles_or_the_largest_of_the_runs(inside, tmp_path, caplog):
    vehicle = tmp_path / "vehicle.yaml"
    vehicle.write_text("schema: fieldsid/vehicle/1\nname: boat\nrudder_max_rad: 0.21\n")
    assert fs.turn_radius("pulses_*.yaml", vehicle=vehicle).rudder_max == 0.21
    with caplog.at_level("INFO", logger="fieldsid"):
        flown = fs.turn_radius("pulses_*.yaml").rudder_max
    assert flown == max(fs.load_model(f"pulses_{u}.yaml").trained["fin_max"] for u in ("1.0", "1.4"))
    assert "the largest in the models' runs" in caplog.text


def test_schedules_are_designed_and_verified_as_by_the_commands(run_cli, inside, tmp_path):
    models = ("pulses_1.0.yaml", "pulses_1.4.yaml")
    path = tmp_path / "gains.yaml"
    options = ("--controller", "pd", "--fin-limit", 0.3, "--fin-lag", 0.1, "--speeds", "1.0,1.4", "-o", path)
    theirs = run_cli("schedule", "design", *models, *options, "--json").json["rows"]
    ours = fs.design_schedule("pulses_*.yaml", controller="pd", fin_limit=0.3, fin_lag=0.1, speeds=[1.0, 1.4])
    assert plain(ours.to_frame().reset_index().to_dict("records")) == theirs
    checked = run_cli("schedule", "verify", path, "--json").json["worst"]
    assert plain(fs.verify_schedule(ours).worst) == checked
    of_fits = fs.design_schedule(fs.identify("pulses_1.4.parquet", "yaw"), controller="p", fin_limit=0.3)
    with pytest.raises(ArtifactError, match="are not where they were"):
        fs.verify_schedule(of_fits)


def test_diagnose_and_extend_are_asked_what_the_commands_ask(inside, monkeypatch):
    asked = []
    monkeypatch.setattr("fieldsid.diagnosis.diagnose", lambda *a, **k: asked.append((a, k)))
    monkeypatch.setattr("fieldsid.extension.extend.extend_in_steps", lambda *a, **k: asked.append((a, k)))
    monkeypatch.setattr("fieldsid.extension.extend.whole_of", lambda steps: steps)
    model = fs.load_model("pulses_1.4.yaml")
    fs.diagnose("pulses_*.parquet", "yaw", validate="zigzag.parquet", model=model, thorough=True)
    fs.extend(model, "pulses_*.parquet", "servo_lag+delay", validate="zigzag.parquet")
    (runs, axis, unseen), known = asked[0]
    assert ([r.name for r in runs], axis, [r.name for r in unseen]) == (["pulses_1.0", "pulses_1.4"], fs.Axis.YAW, ["zigzag"])
    assert known == {"model": model, "thorough": True}
    (parent, add, runs, unseen), _ = asked[1]
    assert (parent, add) == (model, ("servo_lag", "delay"))
    assert ([r.name for r in runs], [r.name for r in unseen]) == (["pulses_1.0", "pulses_1.4"], ["zigzag"])


def test_an_extension_pays_and_its_model_goes_on(inside):
    found = fs.extend("pulses_1.4.yaml", "pulses_1.4.parquet", ["servo_lag"], validate="zigzag.parquet")
    assert not found.pays
    assert found.to_frame().query("channel == 'rate' and runs == 'unseen'")["noise_floor"].item() == pytest.approx(0.004, rel=0.2)
    (with_it,) = fs.compare(found, "zigzag.parquet")
    assert with_it.run == "zigzag"


def test_runs_to_learn_from_and_runs_to_judge_by_have_different_names(made):
    learned, unseen = steps._training_and_unseen([made.run("a")], [made.run("a")], None, None)
    assert [run.name for run in (*learned, *unseen)] == ["a", "a_2"]


@pytest.mark.parametrize(("axis", "hint"), [("jaw", "did you mean `yaw`?"), ("roll", "choose one of: pitch, yaw")])
def test_an_axis_that_is_none_is_refused(made, axis, hint):
    with pytest.raises(UsageError, match="there is no axis") as caught:
        fs.identify(made.run("a"), axis)
    assert caught.value.hint == hint


def test_a_model_of_the_other_axis_is_refused(made):
    with pytest.raises(UsageError, match="that is a yaw model"):
        fs.diagnose(made.run("a"), "pitch", model=made.model("a"))


def test_the_users_own_effects_of_the_folder_take_part(made, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "effects").mkdir()
    (tmp_path / "effects" / "pull.yaml").write_text(
        'name: pull\nsays: a steady pull\naxes: [yaw]\nmoment: "-pull_k * rate * abs(rate)"\n'
        "coefficients:\n  pull_k: {unit: 1/rad, low: -20, high: 20, start: 0.1}\n"
    )
    try:
        with pytest.raises(UsageError, match="that is no log"):
            fs.identify(3, "yaw", effects="pull")
        assert "pull" in all_effects()
    finally:
        forget_effects()


@pytest.mark.parametrize(
    ("given", "speeds"),
    [(None, []), ("", []), ("1.0:1.4:0.2", [1.0, 1.2, 1.4]), ([1, 2.5], [1.0, 2.5]), (np.array([1.0, 1.5]), [1.0, 1.5])],
)
def test_speeds_are_numbers_or_as_the_option_has_them(given, speeds):
    from fieldsid.face.speeds import speeds_of

    assert speeds_of(given) == speeds
