"""A mapping named by `--mapping FILE`, whatever it is called, is that of the model's logs: what reads them again takes it."""

from __future__ import annotations

import pytest
from cli import trial

import fieldsid
from fieldsid.logs import load_run, save_run
from fieldsid.models.axis import Axis
from fieldsid.records.reading import read_yaml

NAMES = {"time_s": "uhr", "yaw_rad": "kurs", "yaw_rate_rad_s": "drehung", "rudder_rad": "ruder", "surge_m_s": "fahrt"}
LAG = ("servo_lag", {"lag": 0.3})


@pytest.fixture
def models(run_cli, tmp_path, tmp_path_factory, monkeypatch):
    """Models of two logs whose columns are in words of their own, made with a mapping called otherwise than mapping.yaml."""
    monkeypatch.chdir(tmp_path)
    units = {"yaw_rad": "rad", "yaw_rate_rad_s": "rad/s", "rudder_rad": "rad", "surge_m_s": "m/s"}
    lines = [f"  {name}: {{column: {NAMES[name]}, unit: {unit}}}" for name, unit in units.items()]
    head = "schema: fieldsid/mapping/1\ntime: {column: uhr, unit: s}\nsignals:\n"
    (tmp_path / "kanaele.yaml").write_text(head + "\n".join(lines) + "\n")
    logs, flown = [], tmp_path_factory.mktemp("flown")
    for speed in (1.0, 1.8):
        run = load_run(trial.flown(flown, Axis.YAW, speed=speed, name=f"pulses_{speed}", hidden=LAG))
        table = save_run(run, flown / "own.csv", force=True).read_text().split("\n", 1)
        named = [NAMES.get(c, c) for c in table[0].split(",")]
        logs.append(tmp_path / f"log_{speed}.csv")
        logs[-1].write_text("\n".join([",".join(named), table[1]]))
    done = run_cli("identify", *logs, "-m", "kanaele.yaml", "--axis", "yaw", "--effects", "servo_lag", "-o", "models")
    assert done.code == 0
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


def test_a_model_is_stale_where_its_mapping_has_changed(run_cli, models, tmp_path):
    assert "nothing is stale" in run_cli("status").out
    file = tmp_path / "kanaele.yaml"
    file.write_text(file.read_text() + "# the rudder again\n")
    assert "kanaele.yaml has changed" in run_cli("status").out
