"""`compare_models` and `report` as functions: what changed between two states, and a trial in one file."""

from __future__ import annotations

import pytest
from cli import trial

import fieldsid as fs
from fieldsid.errors import ArtifactError, UsageError


@pytest.fixture
def both(tmp_path):
    before = fs.identify(trial.flown(tmp_path / "old", seed=1), "yaw")
    heavier = trial.flown(tmp_path / "new", seed=2, speed=1.4, name="after", hidden=("servo_lag", {"lag": 0.02, "b2": -0.9}))
    return before, fs.identify(heavier, "yaw")


def test_what_changed_is_said_in_one_line_in_tables_and_in_a_figure(both):
    found = fs.compare_models(*both)
    assert isinstance(found, fs.Change)
    assert repr(found) == f"<Change {found.line}>"
    assert "authority" in found.line
    assert {"a22", "b2"} <= set(found.to_frame().index)
    assert found.to_frame("gains").index.name == "speed_m_s"
    assert found.line.split(",")[0] in found.summary()
    assert len(found.plot().axes) >= 3


def test_the_fin_limit_of_the_vehicle_counts(both, tmp_path):
    (tmp_path / "vehicle.yaml").write_text("schema: fieldsid/vehicle/1\nname: small\nrudder_max_rad: 0.2\n")
    assert fs.compare_models(*both, vehicle=tmp_path / "vehicle.yaml").rudder == pytest.approx(0.2)


def test_a_report_is_written_once_and_again_only_when_forced(tmp_path):
    log = trial.flown(tmp_path / "runs")
    (fit,) = fs.identify(log, "yaw")
    (tmp_path / "models").mkdir()
    fs.save(fit, tmp_path / "models" / "run7_yaw.yaml")
    path = fs.report(tmp_path)
    assert path == tmp_path / "report.html"
    assert "<svg" in path.read_text()
    assert callable(fs.report)
    with pytest.raises(ArtifactError):
        fs.report(tmp_path)
    assert fs.report(tmp_path, force=True) == path
    with pytest.raises(UsageError):
        fs.report(tmp_path, tmp_path / "report.txt")
