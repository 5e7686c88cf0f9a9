"""The pieces of code on the guide's pages, run as they stand."""

from __future__ import annotations

import tomllib
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from contract.test_registries import REGISTRIES
from guide.blocks import PYTHON
from guide.make import GUIDE

import fieldsid
from fieldsid.demo.vehicle import flown, hidden_vehicle, training_maneuver
from fieldsid.fitting.identify import identify
from fieldsid.logs import load_run
from fieldsid.logs.channels import ChannelMap, Source
from fieldsid.models.axis import Axis
from fieldsid.models.model import load_model
from fieldsid.registry import add, forget
from fieldsid.schedule.record import load_schedule

PAGE = (GUIDE / "extending.md").read_text()
EFFECT, READER, EXPORT = ("EFFECT", "fieldsid.effects"), ("READER", "fieldsid.logs.readers"), ("EXPORT", "fieldsid.exports")


def member(attribute):
    """The object that one of the page's pieces of Python defines."""
    (source,) = (block for block in PYTHON.findall(PAGE) if f"\n{attribute} = " in block)
    module = ModuleType(attribute.lower())
    exec(compile(source, "extending.md", "exec"), module.__dict__)  # noqa: S102 - the page is ours
    return getattr(module, attribute)


@pytest.fixture
def known():
    """Make members known by name for one test."""
    packages = []

    def make(attribute, package):
        item = member(attribute)
        add(package, item)
        packages.append(package)
        return item

    yield make
    for package in packages:
        forget(package)


@pytest.fixture
def own_folder(tmp_path, monkeypatch):
    """A folder with the page's effect of YAML in it, worked in."""
    (block,) = [b for b in PAGE.split("```yaml\n")[1:] if b.startswith("# effects/")]
    path = tmp_path / "effects" / "propeller_wash.yaml"
    path.parent.mkdir()
    path.write_text(block.partition("```")[0])
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    forget("fieldsid.effects")


def test_the_effect_of_yaml_is_fitted(own_folder, run_cli):
    model = hidden_vehicle("prop_moment")
    run, names = flown(model, training_maneuver(model), 1.4, 3), ("yaw_rad", "yaw_rate_rad_s", "rudder_rad", "thrust")
    np.savetxt(
        own_folder / "run.csv", np.column_stack([run.time, *(run[n] for n in names)]),
        delimiter=",", header=",".join(("time_s", *names)), comments="",
    )  # fmt: skip
    (fit,) = run_cli("identify", "run.csv", "--axis", "yaw", "--effects", "propeller_wash", "--json").json["fits"]
    assert fit["effects"] == ["propeller_wash"]
    assert fit["parameters"]["wash"]["std_error"] > 0.0


def test_the_effect_in_python_comes_back(known):
    known(*EFFECT)
    model = hidden_vehicle("flooding")
    run = flown(model, training_maneuver(model), 1.4, 3)
    (fit,) = identify([run], Axis.YAW, effects=("flooding",), method="output_error")
    low, high = fit.interval95("flooding")
    assert low <= model.values["flooding"] <= high


def test_the_reader_reads_its_lines(known, tmp_path, monkeypatch, run_cli):
    known(*READER)
    time = 0.05 * np.arange(200)
    log = tmp_path / "log.kv"
    log.write_text("".join(f"t={t:.2f} hdg={10 + t:.3f} rud={-0.6 * np.sign(np.sin(t)):.2f} u=1.40\n" for t in time))
    assert "name=number lines" in run_cli("inspect", log).out
    (line,) = (w for w in PAGE.split("`") if w.startswith("sysid import log.kv"))
    monkeypatch.chdir(tmp_path)
    answer = run_cli(*line.split()[1:])
    assert answer.code == 0, answer.err
    (run,) = (load_run(path) for path in (tmp_path / "runs").iterdir())
    np.testing.assert_allclose(np.degrees(run["yaw_rad"]), 10.0 + time, atol=1e-3)


def test_the_reader_names_what_is_not_there(known, tmp_path):
    known(*READER)
    log = tmp_path / "log.kv"
    log.write_text("".join(f"t={0.1 * i:.1f} hdg={i}\n" for i in range(50)))
    with pytest.raises(Exception, match="has no `heading`"):
        load_run(log, ChannelMap({"yaw_rad": Source(column="heading", unit="deg")}, time=Source(column="t", unit="s")))


def test_the_export_renders_a_schedule(known, guide_session, run_cli):
    known(*EXPORT)
    out = run_cli("schedule", "export", guide_session.folder / "demo/turning/gains.yaml", "--to", "c_header").out
    assert out.startswith("/* heading gain schedule")
    assert "static const double heading_kp[] = {-0." in out


def test_the_entry_points_name_registries_and_the_objects_that_the_page_defines():
    (block,) = (b.partition("```")[0] for b in PAGE.split("```toml\n")[1:])
    groups = tomllib.loads(block)["project"]["entry-points"]
    assert set(groups) <= set(REGISTRIES)
    for package, points in groups.items():
        for name, target in points.items():
            assert target.endswith(f".{name}:{REGISTRIES[package]}")
            assert member(REGISTRIES[package]).name == name


@pytest.mark.skipif(not hasattr(fieldsid, "load"), reason="the functions of `import fieldsid` are not there yet")
def test_the_page_on_python_takes_the_trial_to_its_gains(guide_session, monkeypatch, capsys):
    monkeypatch.chdir(guide_session.folder)
    script = "".join(PYTHON.findall((GUIDE / "python.md").read_text()))
    exec(compile(script, "python.md", "exec"), {})  # noqa: S102 - the page is ours
    out = capsys.readouterr().out
    assert "check_1.2: rate fit 8" in out
    assert "effect ('servo_lag',)" in out
    assert load_model(Path("demo/extended.yaml")).effects == ("servo_lag",)
    assert len(load_schedule(Path("demo/gains.yaml")).rows) == 5
