"""What a schedule is made for: the vehicle that all runs make believe in, or each speed's own model and the reason said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from truth.maneuvering.hulls import draw_hull
from truth.maneuvering.trials import training

from fieldsid.fitting.identify import identify
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.plant.parameter_source import source_of_models
from fieldsid.schedule.flown.response import Steps, tightest
from fieldsid.schedule.linear_plant import FinLimits, LinearPlant
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.plants import Plants, plants_of
from fieldsid.schedule.record import load_schedule, save_schedule
from fieldsid.schedule.verdict import rests_on
from fieldsid.schedule.verify import STEPS_RAD, verify_schedule

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
        ("fieldsid.turning.maneuvering.fit.FARTHEST_COST", -1.0, "like_no_vehicle", "state `length_m` in vehicle.yaml"),
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


def test_the_fin_that_is_said_is_the_one_that_was_flown(trial):
    source, runs = trial
    made = design_schedule(source, 0.26, runs=runs, length=2.0)
    of = plants_of(source, FinLimits(), runs, 2.0)
    assert of.belief is not None
    flown = of.family_at(made.rows[0].speed, 0.26, 4, 1)
    assert (made.actuator["lag_s"], made.actuator["fin_rate_rad_s"]) == (flown.lag[0], flown.fin_rate[0])
    stated = design_schedule(source, 0.26, limits=FinLimits(lag=0.3, rate=0.7), runs=runs, length=2.0).actuator
    assert (stated["lag_s"], stated["fin_rate_rad_s"]) == (0.3, 0.7)


def test_the_curvature_of_a_step_is_that_of_its_first_case_held_for_a_second():
    time = np.arange(0.0, 4.0, 0.02)
    angle = np.interp(time, [0.0, 1.0, 1.1, 4.0], [0.0, 0.5, 0.5, 0.5])  # 0.5 rad/s for a second, at 2 m/s
    steps = Steps(time, np.stack([angle, 9.0 * angle], axis=1), *(np.full((time.size, 2), v) for v in (0.0, 0.0, 2.0)))
    assert tightest(steps) == pytest.approx(0.25, rel=0.01)


def test_a_step_that_turns_tighter_than_any_run_is_said_to_be_extrapolated(trial):
    source, runs = trial
    made = design_schedule(source, 0.26, runs=runs, length=2.0)
    checked = verify_schedule(made, source, draws=4, runs=runs)
    turns = [tightest(step) for step in checked.flown[0].scheduled]
    assert turns == sorted(turns)
    held = replace(checked, tightest_flown=turns[-1])
    assert held.extrapolated is None
    assert "extrapolated" not in rests_on(held, made, source)
    loose = replace(checked, tightest_flown=0.5 * turns[-1])
    assert loose.extrapolated is not None
    size, share = loose.extrapolated
    assert size in STEPS_RAD[Axis.YAW]
    assert share == pytest.approx(0.5, abs=0.3)
    assert "how it settles is extrapolated until a turn that tight is flown" in rests_on(loose, made, source)
    assert replace(checked, tightest_flown=float("nan")).extrapolated is None


def test_how_an_unstable_hull_comes_out_of_a_turn_tighter_than_any_run_is_not_said(trial, monkeypatch):
    source, runs = trial
    made = design_schedule(source, 0.26, runs=runs, length=2.0)

    def checked(flown, growth):
        monkeypatch.setattr(Plants, "tightest_flown", property(lambda _: flown))
        monkeypatch.setattr(LinearPlant, "growth", property(lambda plant: np.full(plant.count, growth)))
        return verify_schedule(made, source, draws=4, runs=runs)

    for flown, growth in ((1e-3, -0.1), (1e3, 0.1)):
        steps = checked(flown, growth).scheduled[0].steps
        assert all(s.said and np.isfinite(s.settling) for s in steps)
    found = checked(1e-3, 0.1)
    assert [s.said for s in found.scheduled[0].steps] == [True, True, False]
    assert "how a 90 deg step settles is not said (`-`) until" in rests_on(found, made, source)
    assert found.scheduled[0].settling == steps[1].settling
