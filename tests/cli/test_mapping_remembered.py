"""A mapping named by `--mapping FILE`, whatever it is called, is that of the model's logs: what reads them again takes it."""

from __future__ import annotations

import shlex
import shutil
from contextlib import chdir
from pathlib import Path

import pytest
from cli import trial

import fieldsid
from fieldsid.cli.inputs import mapping_behind
from fieldsid.logs import load_run, save_run
from fieldsid.models.axis import Axis
from fieldsid.records.reading import read_yaml

NAMES = {"time_s": "uhr", "yaw_rad": "kurs", "yaw_rate_rad_s": "drehung", "rudder_rad": "ruder", "surge_m_s": "fahrt"}
LAG = ("servo_lag", {"lag": 0.3})


@pytest.fixture(scope="module")
def prepared(run_shared, tmp_path_factory):
    """A folder of two logs whose columns are in words of their own, and of models made with a mapping not called mapping.yaml."""
    folder = tmp_path_factory.mktemp("own words")
    units = {"yaw_rad": "rad", "yaw_rate_rad_s": "rad/s", "rudder_rad": "rad", "surge_m_s": "m/s"}
    lines = [f"  {name}: {{column: {NAMES[name]}, unit: {unit}}}" for name, unit in units.items()]
    head = "schema: fieldsid/mapping/1\ntime: {column: uhr, unit: s}\nsignals:\n"
    (folder / "kanaele.yaml").write_text(head + "\n".join(lines) + "\n")
    logs, flown = [], tmp_path_factory.mktemp("flown")
    for speed in (1.0, 1.8):
        run = load_run(trial.flown(flown, Axis.YAW, speed=speed, name=f"pulses_{speed}", hidden=LAG))
        table = save_run(run, flown / "own.csv", force=True).read_text().split("\n", 1)
        named = [NAMES.get(c, c) for c in table[0].split(",")]
        logs.append(f"log_{speed}.csv")
        (folder / logs[-1]).write_text("\n".join([",".join(named), table[1]]))
    with chdir(folder):
        asked = ("--axis", "yaw", "--effects", "servo_lag", "-o", "models", "--no-figures")
        assert run_shared("identify", *logs, "-m", "kanaele.yaml", *asked).code == 0
    return folder


@pytest.fixture
def models(prepared, tmp_path, monkeypatch):
    """The models in a copy of that folder, which is the working folder."""
    shutil.copytree(prepared, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return sorted((tmp_path / "models").glob("*.yaml"))


def test_a_turn_gains_and_a_report_read_the_models_logs_by_it(run_cli, models, tmp_path):
    assert read_yaml(models[0])["mapping"]["path"] == "kanaele.yaml"
    turn = run_cli("turn-radius", *models)
    assert "cannot be read again" not in turn.err
    assert "surge_not_measured" not in turn.err
    assert "gone" not in run_cli("schedule", "design", *models, "-o", "gains.yaml").err
    assert "gone" not in run_cli("schedule", "verify", "gains.yaml").err
    assert "not_in_report" not in run_cli("report").err
    assert fieldsid.turn_radius(models).rows[0].radius > 0.0
    assert "mapping.yaml" not in {p.name for p in tmp_path.iterdir()}


def test_a_model_saved_from_python_keeps_it_too(models):
    path = fieldsid.save(fieldsid.load_model(models[0]), "again.yaml", inputs=["log_1.0.csv"], mapping="kanaele.yaml")
    assert read_yaml(path)["mapping"] == read_yaml(models[0])["mapping"]


def test_a_model_is_stale_where_its_mapping_has_changed(run_cli, models, tmp_path):
    assert "nothing is stale" in run_cli("status").out
    file = tmp_path / "kanaele.yaml"
    file.write_text(file.read_text() + "# the rudder again\n")
    assert "kanaele.yaml has changed" in run_cli("status").out


def test_a_new_log_is_read_as_the_models_logs_were(run_cli, models, tmp_path):
    new = tmp_path / "new.csv"
    new.write_bytes((tmp_path / "log_1.8.csv").read_bytes()[:-200].rsplit(b"\n", 1)[0] + b"\n")
    made = run_cli("identify", "log_1.0.csv", "-m", "kanaele.yaml", "--axis", "yaw", "-o", "plain", "--no-figures")
    assert made.code == 0
    for model, is_named in ((models[0], True), ("plain/log_1.0_yaw.yaml", False)):
        told = run_cli("compare", model, new)
        assert told.code == 0
        line = next(line for line in told.out.splitlines() if line.startswith("next: ")).removeprefix("next: sysid ")
        assert ("--model" in line, "--mapping kanaele.yaml" in line) == (is_named, not is_named)
        assert run_cli(*shlex.split(line), "--json").code == 0
    assert fieldsid.compare(models[0], new)[0].run == "new"
    added = run_cli("extend", models[0], new, "--add", "quadratic_damping", "--keep", "-o", "more.yaml")
    assert added.code == 0
    assert read_yaml(tmp_path / "more.yaml")["mapping"]["path"] == "kanaele.yaml"
    assert run_cli("simulate", models[0], "--run", new).code == 0


def test_own_names_of_a_log_count_more_than_the_models_mapping(run_cli, models, tmp_path):
    own = tmp_path / "own.csv"
    text = (tmp_path / "log_1.8.csv").read_text()
    for name, column in NAMES.items():
        text = text.replace(column, name, 1)
    own.write_text(text)
    assert run_cli("compare", models[0], own).code == 0
    fitted = run_cli("extend", models[0], own, "--add", "quadratic_damping", "--keep", "-o", "more.yaml")
    assert fitted.code == 0
    assert "mapping" not in read_yaml(tmp_path / "more.yaml")


def test_a_mapping_whose_columns_a_log_lacks_is_not_tried(run_cli, models, tmp_path):
    foreign = tmp_path / "foreign.csv"
    foreign.write_text("a,b\n" + "\n".join(f"{0.1 * i},{i}" for i in range(50)) + "\n")
    told = run_cli("compare", models[0], foreign)
    assert told.code == 2
    assert "kanaele" not in told.err


def test_a_log_that_cannot_be_read_does_not_stand_in_the_way_of_the_mapping_of_the_next_line(models, tmp_path):
    (tmp_path / "spoilt.parquet").write_bytes(b"PAR1 and no more")
    assert mapping_behind(models, [Path("spoilt.parquet"), Path("log_1.8.csv")]) == Path("kanaele.yaml")


def test_a_log_that_cannot_be_read_does_not_stand_in_the_way_of_the_status(run_cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run_cli("init", ".")
    (tmp_path / "logs").mkdir(exist_ok=True)
    (tmp_path / "logs" / "spoilt.parquet").write_bytes(b"PAR1 and no more")
    done = run_cli("status")
    assert done.code == 0
    assert "next: sysid" in done.out
