"""What is made of a model whose own record says that it lacks something begins with that."""

from __future__ import annotations

from dataclasses import replace

import pytest
from cli import trial

from fieldsid.comparison.left_by import lacking
from fieldsid.models.axis import Axis
from fieldsid.models.model import load_model, save_model

NOISE = {"angle_rad": 0.005, "rate_rad_s": 0.004}
NAN = float("nan")


def leaving(over, *, extended=None, **changed):
    left = {"angle_rms_rad": 0.005 * over, "rate_rms_rad_s": 0.004 * over, "noise_floor": NOISE}
    info = {"left": left}
    if extended is not None:
        sides = {side: {"angle_rms_rad": 0.005 * o, "rate_rms_rad_s": NAN} for side, o in extended.items()}
        info["extension"] = {"noise_floor": NOISE, "after": sides}
    return replace(trial.vehicle(Axis.YAW), info=info, **changed)


@pytest.mark.parametrize(
    ("models", "most"),
    [
        ([leaving(2.9)], 2.9),
        ([leaving(1.1), leaving(1.4), leaving(1.3)], 1.4),
        ([leaving(1.1)], NAN),
        ([leaving(2.9, method="pem")], NAN),  # what it leaves is a disturbance
        ([replace(trial.vehicle(Axis.YAW), info={})], NAN),  # nothing is known
        ([leaving(2.9, extended={"train": 1.0, "validation": 1.1})], NAN),
        ([leaving(2.9, extended={"train": 1.0, "validation": 1.6})], 1.6),
        ([], NAN),
    ],
)
def test_a_model_lacks_something_by_its_last_addition_or_its_fit(models, most):
    assert lacking(models) == pytest.approx(most, nan_ok=True)


@pytest.mark.parametrize("asked", [("turn-radius", "--method", "steady"), ("schedule", "design")])
def test_gains_and_radius_begin_with_what_their_model_lacks(run_cli, tmp_path, asked):
    lacks = save_model(leaving(2.9), tmp_path / "lacks.yaml")
    says = run_cli(*asked, lacks, "--fin-max", "0.26", "--quiet").out.splitlines()[0]
    assert says.startswith("from a model that lacks something (2.90 x the noise; `sysid diagnose` first): ")
    whole = save_model(leaving(1.05), tmp_path / "whole.yaml")
    assert "lacks" not in run_cli(*asked, whole, "--fin-max", "0.26", "--quiet").out


def test_a_verification_says_what_the_model_lacks_as_the_design_does(run_cli, tmp_path):
    lacks, gains = save_model(leaving(2.9), tmp_path / "lacks.yaml"), tmp_path / "gains.yaml"
    assert run_cli("schedule", "design", lacks, "--fin-max", "0.26", "-o", gains).code == 0
    says = run_cli("schedule", "verify", gains, "--quiet").out.splitlines()[0]
    assert says.startswith("from a model that lacks something (2.90 x the noise; `sysid diagnose` first): ")


def test_gains_and_their_verification_begin_with_what_no_loop_was_flown_with(run_cli, tmp_path):
    loose, gains = trial.vehicle(Axis.YAW, "backlash", gap=0.02), tmp_path / "gains.yaml"
    file = save_model(loose, tmp_path / "loose.yaml")
    says = run_cli("schedule", "design", file, "--fin-max", "0.26", "-o", gains).out.splitlines()[0]
    assert says.startswith("flown without backlash's gap: kp ")
    answer = run_cli("schedule", "verify", gains)
    assert answer.out.splitlines()[0].startswith("flown without backlash's gap: holds: ")
    assert answer.out.count("backlash") == 1 + answer.out.splitlines()[1].count("backlash")  # the model's effects are listed
    assert run_cli("schedule", "verify", gains, "--json").json["not_counted"] == {"backlash": ["gap"]}


def test_identify_keeps_in_the_model_what_it_leaves(run_cli, tmp_path):
    log = trial.flown(tmp_path, hidden=("servo_lag", {"lag": 0.35}))
    body = run_cli("identify", log, "--axis", "yaw", "--method", "output_error", "-o", tmp_path, "--no-figures", "--json").json
    (fit,) = body["fits"]
    left = load_model(tmp_path / "run7_yaw.yaml").info["left"]
    assert left["noise_floor"] == pytest.approx(fit["noise_floor"])
    assert left["rate_rms_rad_s"] == pytest.approx(fit["rate_rms_rad_s"])
