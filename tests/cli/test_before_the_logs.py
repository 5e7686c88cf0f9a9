"""What is wrong with a model or an option is told before any log is looked at, however bad or slow the log is."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace

import pytest
from cli import trial

from fieldsid.artifacts import save_record
from fieldsid.models.axis import Axis
from fieldsid.models.model import KIND, save_model

NEVER = ("none.csv",)
WRONG = {
    "is not there": "cannot be read",
    "is another file": "is not a fieldsid/model file",
    "is not whole": "is not a complete model file",
    "holds an unknown effect": "holds effect `towline`, which is not known here",
}


@pytest.fixture
def models(tmp_path):
    """Models with something wrong, by what it is."""
    paths = {wrong: tmp_path / f"{wrong.replace(' ', '_')}.yaml" for wrong in WRONG}
    paths["is another file"].write_text("schema: fieldsid/plan/1\n")
    save_record(paths["is not whole"], f"{KIND}/1", {"axis": "yaw"})
    save_model(trial.vehicle(Axis.YAW, "stall", stall_angle=0.3, stall_drop=0.5), paths["holds an unknown effect"])
    text = paths["holds an unknown effect"].read_text()
    paths["holds an unknown effect"].write_text(text.replace("- stall\n", "- towline\n"))
    return paths


@pytest.mark.parametrize("wrong", WRONG)
@pytest.mark.parametrize("asked", [("compare", *NEVER), ("extend", *NEVER, "--add", "delay"), ("history",)], ids=lambda a: a[0])
def test_a_bad_model_is_told_before_a_bad_log(run_cli, models, asked, wrong):
    name, *rest = asked
    answer = run_cli(name, models[wrong], *rest)
    assert (answer.code, answer.out) == (2, "")
    assert WRONG[wrong] in answer.err
    assert models[wrong].name in answer.err
    assert "none.csv" not in answer.err


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("extend", "MODEL", *NEVER, "--add", "servo_lagg"), "did you mean `servo_lag`"),
        (("extend", "MODEL", *NEVER, "--add", "heave_coupling"), "does not act on the yaw axis"),
        (("extend", "MODEL", *NEVER), "there is no effect to add"),
        (("history", "MODEL", "--figure", "h.gif"), "a figure cannot be written as `h.gif`"),
        (("history", "MODEL", "--figure", "MODEL.png"), "exists"),
        (("diagnose", *NEVER, "--axis", "yaw", "--figure", "h.gif"), "a figure cannot be written as `h.gif`"),
        (("schedule", "verify", "none.yaml", "-o", "h.gif"), "a figure cannot be written as `h.gif`"),
    ],
    ids=lambda v: v if isinstance(v, str) else "",
)
def test_an_option_that_cannot_be_meant_is_told_before_a_bad_log(run_cli, tmp_path, options, says):
    model = trial.model_file(tmp_path)
    model.with_name("truth.yaml.png").touch()
    answer = run_cli(*(o.replace("MODEL", str(model)) for o in options))
    assert (answer.code, answer.out) == (2, "")
    assert says in answer.err
    assert "\nhint: " in answer.err


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs a pipe with a name")
@pytest.mark.parametrize("name", ["extend", *(pytest.param(n, marks=pytest.mark.slow) for n in ("compare", "history"))])
def test_a_log_that_never_comes_is_not_waited_for(models, tmp_path, name):
    os.mkfifo(tmp_path / "slow.csv")
    rest = {"compare": ("slow.csv",), "extend": ("slow.csv", "--add", "delay"), "history": ()}[name]
    command = [sys.executable, "-m", "fieldsid", name, models["holds an unknown effect"], *rest]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 2
    assert "holds effect `towline`" in done.stderr


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs a pipe with a name")
def test_the_parents_of_a_model_are_read_before_the_logs_of_any(tmp_path):
    os.mkfifo(tmp_path / "slow.csv")
    pair = {"angle_rms_rad": 0.01, "rate_rms_rad_s": 0.01}
    said = {
        "added": ["delay"], "before": {"train": pair, "validation": pair}, "after": {"train": pair, "validation": pair},
        "noise_floor": {"angle_rad": 0.01, "rate_rad_s": 0.01}, "unseen": True, "learned_on": ["a"], "judged_on": ["b"],
        "kept_by": "unseen", "data": [{"run": "a", "role": "training", "path": str(tmp_path / "slow.csv"), "sha256": "0"}],
    }  # fmt: skip
    parent = trial.model_file(tmp_path)
    child = replace(trial.vehicle(Axis.YAW, "delay", delay=0.1), info={"extension": said})
    save_model(child, tmp_path / "child.yaml", parent=parent)
    command = [sys.executable, "-m", "fieldsid", "history", tmp_path / "child.yaml"]
    whole = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert whole.returncode == 0
    parent.write_text("schema: fieldsid/model/1\n")
    broken = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert broken.returncode == 2
    assert "truth.yaml` is not a complete model file" in broken.stderr
