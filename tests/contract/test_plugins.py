"""Parts of other packages: what they are is said, one that is broken harms nobody, and a model says where its code lived."""

from __future__ import annotations

import importlib
import sys

import pytest
from cli import trial

from fieldsid import registry
from fieldsid.effects import forget_effects
from fieldsid.models.axis import Axis
from fieldsid.models.model import save_model

TOW = """
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage

def moment(motion, values, record):
    return -values["tow_k"] * motion.rate

EFFECT = Effect(
    name="tow", says="a towed line", stage=Stage.HYDRODYNAMICS, axes=(Axis.YAW,), equation="r' -= tow_k r",
    coefficients=(Coefficient("tow_k", "1/s", 0.0, 20.0, 0.1),), telltale="none", excited_by=("zigzag",), mistaken_for=(),
    source="made up", moment=moment,
)
"""


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Return a function that installs a package `towed` of one module with an entry point; without a name it has none."""
    site = tmp_path / "site"
    (site / "towed-1.5.dist-info").mkdir(parents=True)
    monkeypatch.syspath_prepend(site)

    def renew():
        importlib.invalidate_caches()
        sys.modules.pop("towed", None)
        registry._installed.cache_clear()

    def call(code, name="tow", group="fieldsid.effects", value="towed:EFFECT"):
        (site / "towed.py").write_text(code)
        (site / "towed-1.5.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: towed\nVersion: 1.5\n")
        points = f"[{group}]\n{name} = {value}\n" if name else ""
        (site / "towed-1.5.dist-info" / "entry_points.txt").write_text(points)
        renew()
        return site / "towed.py"

    yield call
    call("", name="")
    forget_effects()
    for package, attribute in (("fieldsid.effects", "EFFECT"), ("fieldsid.logs.readers", "READER")):
        registry.members(package, attribute)
    assert registry.refused() == ()


def test_a_plug_in_says_its_file_and_its_package(run_cli, install):
    file = install(TOW)
    said = run_cli("effects", "show", "tow", "--json").json["origin"]
    assert said == f"{file} (entry point `towed:EFFECT` of towed 1.5)"
    origins = {e["name"]: e["origin"] for e in run_cli("effects", "list", "--json").json["effects"]}
    assert origins["tow"] == said
    assert {origins[n] for n in origins if n != "tow"} == {"built in"}
    assert "towed:EFFECT" in run_cli("effects", "show", "tow").out


BROKEN = {
    "raises": ("raise OSError('no licence found')", "towed.py:1: OSError: no licence found"),
    "leaves": ("import sys; sys.exit(4)", "SystemExit: 4"),
    "cannot be read": ("def (:", "towed.py:1: SyntaxError"),
    "has no such object": ("OTHER = 1", "AttributeError"),
    "is another kind": ("class EFFECT: name = 'tow'", "leads to no Effect"),
    "has another name": (TOW.replace('name="tow"', 'name="tug"'), "does not hold `EFFECT` with that name"),
}


@pytest.mark.parametrize(("code", "says"), BROKEN.values(), ids=BROKEN)
def test_a_broken_plug_in_is_told_once_and_harms_only_who_asks_for_it(run_cli, install, code, says):
    install(code)
    for arguments in (("effects", "list"), ("effects", "show", "servo_lag")):
        answer = run_cli(*arguments)
        assert answer.code == 0
        assert answer.err.count("warning: the entry point `tow = towed:EFFECT`") == answer.err.count("warning") == 1
        assert says in answer.err
        assert "; it takes no part\n" in answer.err
    asked = run_cli("effects", "show", "tow")
    assert (asked.code, asked.out) == (2, "")
    assert asked.err.startswith("error: the entry point `tow = towed:EFFECT`")
    assert "warning" not in asked.err


def test_a_plug_in_with_a_built_in_name_leaves_that_as_it_is(run_cli, install):
    install(TOW.replace('name="tow"', 'name="stall"'), name="stall")
    answer = run_cli("effects", "show", "stall", "--json")
    assert answer.json["origin"] == "built in"
    assert "the name 'stall' is taken" in answer.err


def test_a_plug_in_whose_coefficient_another_effect_has_is_not_put_into_one_model_with_it(run_cli, install, tmp_path):
    install(TOW.replace("tow_k", "lag"))
    run = trial.flown(tmp_path)
    answer = run_cli("identify", run, "--axis", "yaw", "--effects", "servo_lag,tow")
    assert answer.code == 2
    assert "coefficient 'lag' of effect 'tow' is a name of effect 'servo_lag'" in answer.err
    answer = run_cli("diagnose", run, "--axis", "yaw")
    assert (answer.code, "not tried: `tow` has a coefficient `lag`, as effect `servo_lag` has" in answer.err) == (0, True)


def test_a_broken_reader_of_another_package_does_not_keep_logs_from_being_read(run_cli, install, tmp_path):
    install("raise OSError('gone')", name="sonar", group="fieldsid.logs.readers", value="towed:READER")
    answer = run_cli("inspect", trial.flown(tmp_path))
    assert answer.code == 0
    assert "warning: the entry point `sonar = towed:READER` cannot be loaded; it takes no part" in answer.err


@pytest.fixture
def model(run_cli, install, tmp_path):
    install(TOW)
    return save_model(trial.vehicle(Axis.YAW, "tow", tow_k=0.4), tmp_path / "towing.yaml")


def test_a_model_with_code_that_is_not_installed_says_where_it_lived_and_runs_none(run_cli, install, model, tmp_path):
    assert run_cli("simulate", model, "--maneuver", "zigzag").code == 0
    assert "def moment" not in model.read_text()
    file = install("", name="")
    answer = run_cli("compare", model, trial.flown(tmp_path))
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.startswith(
        f"error: `{model}`: the model holds effect `tow`, which is Python code and is not installed here"
    )
    assert f"it lived in {file} (entry point `towed:EFFECT` of towed 1.5), SHA-256 " in answer.err
    assert "hint: install the package it came with" in answer.err


def test_a_file_of_the_same_name_does_not_stand_in_for_code(run_cli, install, model, tmp_path, monkeypatch):
    install("", name="")
    (tmp_path / "effects").mkdir()
    (tmp_path / "effects" / "tow.yaml").write_text(
        "name: tow\nmoment: '-tow_k * rate'\ncoefficients: {tow_k: {unit: 1/s, low: 0, high: 9, start: 0.1}}\n"
    )
    monkeypatch.chdir(tmp_path)
    answer = run_cli("simulate", model, "--maneuver", "zigzag")
    assert answer.code == 2
    assert "which is Python code and is not installed here" in answer.err


def test_code_that_has_changed_since_is_said(run_cli, install, model):
    assert run_cli("simulate", model, "--maneuver", "zigzag").err == ""
    install(TOW + "# mended\n")
    answer = run_cli("simulate", model, "--maneuver", "zigzag")
    assert answer.code == 0
    assert "effect `tow` is code that has changed since the model was made" in answer.err
