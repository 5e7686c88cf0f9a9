"""What a schedule is made for: the vehicle that all runs make believe in, or each speed's own model and the reason said."""

from __future__ import annotations

import numpy as np
import pytest
from truth.maneuvering.hulls import draw_hull
from truth.maneuvering.trials import training

from fieldsid.fitting.identify import identify
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.plant.parameter_source import source_of_models
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.record import load_schedule, save_schedule

BELIEF = "fieldsid.turning.maneuvering.belief"


@pytest.fixture(scope="module")
def trial():
    hull = draw_hull(0, 8)
    logs = training(hull, "pulses", np.random.default_rng(8), sway=True)[:1]
    runs = [Run(log.name, log.time, log.columns) for log in logs]
    models = [f.model for f in identify(runs, Axis.YAW, effects=("quadratic_damping",))]
    return source_of_models(models, ["m0"]), runs


def singular(*_):
    raise np.linalg.LinAlgError("Singular matrix")


@pytest.mark.parametrize(
    ("where", "instead", "code", "says"),
    [
        (f"{BELIEF}.fit_maneuvering", singular, "maneuvering_not_fitted", "Singular matrix"),
        ("fieldsid.turning.maneuvering.fit.FARTHEST_PRIOR_COST", -1.0, "like_no_vehicle", "state `length_m` in vehicle.yaml"),
    ],
)
def test_a_schedule_for_each_speeds_own_model_says_why(monkeypatch, trial, tmp_path, where, instead, code, says):
    source, runs = trial
    monkeypatch.setattr(where, instead)
    made = design_schedule(source, 0.26, runs=runs, length=None if code == "like_no_vehicle" else 2.0)
    (note,) = made.notes
    assert note.code == code
    assert says in note.message
    assert "each speed's own model is taken instead" in note.message
    again = load_schedule(save_schedule(made, tmp_path / "gains.yaml"))
    assert [(n.code, n.message) for n in again.notes] == [(note.code, note.message)]


def test_gains_are_for_a_vehicle_of_the_length_that_is_stated(monkeypatch, trial):
    source, runs = trial
    asked = []
    monkeypatch.setattr(f"{BELIEF}.fit_maneuvering", lambda _runs, length: asked.append(length) or singular())
    made = design_schedule(source, 0.26, runs=runs, length=1.75)
    assert asked == [1.75]
    assert made.provenance["length_m"] == 1.75
