"""What is said to help is worked out from the models: it serves where it is pasted, and is left out where nothing is known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cli import trial

from fieldsid.dynamics.free_run import growing_hint
from fieldsid.errors import ModelError, UsageError
from fieldsid.logs import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import save_model
from fieldsid.plant.parameter_source import load_parameter_source
from fieldsid.plant.remedies import fin_limit_hint, limiting_damping_hint, refuse_fin_limit
from fieldsid.schedule.make import design_schedule
from fieldsid.turning.radius import turn_radius


def source(folder, *offsets, fin_max=0.3, a22=1.1):
    """Models at rising speeds whose fins have these offsets, each flown with the fin at up to fin_max."""
    paths = []
    for i, offset in enumerate(offsets):
        vehicle = trial.vehicle(Axis.YAW, a22=a22, C0=-1.2 * offset)
        law = replace(vehicle.law, reference=1.2 + 0.3 * i)
        paths.append(save_model(replace(vehicle, law=law, trained={"fin_max": fin_max}), folder / f"m{i}.yaml", force=True))
    return load_parameter_source(paths)


def table(folder, text="speed_m_s,a22,b2,C0\n1.4,1.1,-1.2,-0.12\n"):
    path = folder / "table.csv"
    path.write_text(text)
    return load_parameter_source([path])


def test_the_fin_limit_advised_is_that_of_the_runs_and_serves_at_every_speed(tmp_path):
    known = source(tmp_path, 0.05, 0.12, fin_max=0.26543)
    for refused in (lambda: turn_radius(known, [1.2, 1.5], 0.08), lambda: design_schedule(known, 0.08)):
        with pytest.raises(UsageError, match=r"offset at 1\.5 m/s") as caught:
            refused()
        assert caught.value.hint == "the models' runs had the fin at up to 0.2655 rad: `--fin-max 0.2655`"


@pytest.mark.parametrize("fin_max", [0.1, 0.0])
def test_where_the_runs_do_not_tell_a_limit_the_least_is_said(tmp_path, fin_max):
    assert fin_limit_hint("--fin-max", 0.12, source(tmp_path, 0.12, fin_max=fin_max)) == (
        "trim the fin: a limit has to be above 0.12 rad, 6.9 deg"
    )
    with pytest.raises(UsageError) as caught:
        turn_radius(table(tmp_path), [1.4], 0.08)
    assert caught.value.hint == "trim the fin: a limit has to be above 0.1 rad, 5.7 deg"


@pytest.mark.parametrize(
    ("given", "said"), [(15.0, "15 rad is 859.4 deg"), (-0.2, "-0.2 rad is -11.46 deg"), (1.745, "1.745 rad is 99.98 deg")]
)
def test_an_angle_that_no_fin_has_is_said_in_both_units(given, said):
    with pytest.raises(UsageError, match="at most at 90 deg") as caught:
        refuse_fin_limit("a fin's limit", given)
    assert caught.value.hint == f"{said}; write it like `--fin-max 15deg`"


def test_an_offset_that_no_fin_has_is_not_to_be_trimmed_but_looked_into(tmp_path):
    for refused in (
        lambda: design_schedule(source(tmp_path, 3.46), 0.26),
        lambda: turn_radius(source(tmp_path, 3.46), [1.2], 0.26),
    ):
        with pytest.raises(UsageError, match="offset") as caught:
            refused()
        assert "deg" not in caught.value.hint
        assert "no fin is trimmed that far" in caught.value.hint
        assert "`sysid diagnose RUN... --axis yaw`" in caught.value.hint
    with pytest.raises(UsageError) as caught:
        design_schedule(table(tmp_path, "speed_m_s,a22,b2,C0\n1.4,1.1,-1.2,-4.15\n"), 0.26)
    assert caught.value.hint == "no fin is trimmed that far: check unit and sign of `C0` and `b2` in the table"


def test_a_rate_that_nothing_holds_is_helped_by_what_the_source_has(tmp_path):
    with pytest.raises(ModelError) as caught:
        turn_radius(source(tmp_path, 0.0, a22=-0.1), [1.2], 0.3)
    assert caught.value.hint == f"add the damping that holds it: `sysid extend {tmp_path}/m0.yaml RUN... --add quadratic_damping`"
    assert "sysid identify RUN... --axis yaw --effects quadratic_damping" in limiting_damping_hint(table(tmp_path), 1.4)
    assert "quadratic" not in limiting_damping_hint(source(tmp_path, 0.0), 1.2, ("quadratic_damping",))


def test_a_model_that_grows_is_given_the_damping_it_has_not():
    assert "--effects servo_lag,quadratic_damping`" in growing_hint(trial.vehicle(Axis.YAW, "servo_lag", lag=0.1))
    assert "--effects" not in growing_hint(trial.vehicle(Axis.YAW, "quadratic_damping", quadratic=0.1))


def test_a_circle_flown_with_less_fin_than_the_offset_has_no_prediction(tmp_path):
    time = np.arange(0.0, 120.0, 0.1)
    turn = {"yaw_rad": 0.1 * time, "yaw_rate_rad_s": np.full(time.size, 0.1), "surge_m_s": np.full(time.size, 1.4)}
    track = {"x_m": 14.0 * np.sin(0.1 * time), "y_m": -14.0 * np.cos(0.1 * time), "rudder_rad": np.full(time.size, 0.05)}
    prediction = turn_radius(table(tmp_path), [1.4], 0.3, measured=[Run("circle", time, {**turn, **track})])
    assert prediction.measured == ()
    (note,) = [n for n in prediction.notes if n.code == "turned_against_rudder"]
    assert "0.05 rad to the other side" in note.message


def test_paths_are_quoted(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("my models").mkdir()
    log = trial.flown(Path("my models"))
    path = save_model(trial.vehicle(Axis.YAW, a22=-0.1), Path("my models/m.yaml"), inputs=[log])
    assert limiting_damping_hint(load_parameter_source([path]), 1.4).endswith(
        "`sysid extend 'my models/m.yaml' 'my models/run7.parquet' --add quadratic_damping`"
    )
