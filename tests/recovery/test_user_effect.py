"""A user's own effect takes part like a built-in one: the truth has roll coupling, the YAML file says so, the fit finds k."""

from __future__ import annotations

import numpy as np
import pytest
from truth import kernel, maneuvers
from truth.noise import Clock, calm
from truth.physics import Physics
from truth.simple import fly

from fieldsid.effects import forget_effects
from fieldsid.effects._user_folder import add_user_effects
from fieldsid.errors import EffectError
from fieldsid.fitting.fit import fit
from fieldsid.fitting.predict.predict import predict
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of

DRAG = "name: own_drag\nmoment: '-k * r * abs(r)'\ncoefficients: {k: {unit: 1/rad, low: 0, high: 20, start: 0.5}}\n"
ROLL = "name: own_roll\nmoment: 'k * phi'\ncoefficients: {k: {unit: 1/s^2, low: -9, high: 9, start: 0.1}}\n"
WILD = "name: wild\nmoment: 'k * exp(50 * abs(r))'\ncoefficients: {k: {unit: rad/s^2, low: 0, high: 20, start: 1.0}}\n"


@pytest.fixture(autouse=True)
def _forget():
    yield
    forget_effects()


def record(**physics):
    clock = Clock(0.05, 900)
    inputs = calm(clock)
    inputs[kernel.ROLL_PUSH] = 0.2 * np.sin(0.9 * clock.whole)
    truth = Physics(damping=1.1, authority=-0.9, trim=0.01, kp=0.9, kd=0.5, **physics)
    m = fly(truth, clock, maneuvers.zigzag(clock.time, 0.25, 0.4), inputs)
    signals = {"yaw_rad": m.angle, "yaw_rate_rad_s": m.rate, "rudder_rad": m.command, "surge_m_s": m.surge, "roll_rad": m.roll}
    return record_of(Run("made", m.time, signals), Axis.YAW)


def own(tmp_path, text):
    (tmp_path / "own.yaml").write_text(text)
    add_user_effects(tmp_path)


def test_an_effect_of_the_motion_comes_back_and_predicts_like_the_built_in_one(tmp_path):
    own(tmp_path, DRAG)
    log = record(quadratic=2.0)
    mine = fit([log], Axis.YAW, method="output_error", effects=["own_drag"])
    theirs = fit([log], Axis.YAW, method="output_error", effects=["quadratic_damping"])
    assert mine.model.values["k"] == pytest.approx(2.0, rel=0.02)
    assert mine.model.values["k"] == pytest.approx(theirs.model.values["quadratic"], rel=1e-3)
    np.testing.assert_allclose(predict(mine.model, log).rate, predict(theirs.model, log).rate, atol=1e-4)


def test_an_effect_of_a_logged_signal_comes_back(tmp_path):
    own(tmp_path, ROLL)
    found = fit([record(roll_moment=0.6)], Axis.YAW, method="output_error", effects=["own_roll"])
    assert found.model.values["k"] == pytest.approx(0.6, rel=0.05)
    assert found.model.effects == ("own_roll",)


def test_an_effect_that_grows_without_bound_says_so_with_its_numbers(tmp_path):
    own(tmp_path, WILD)
    with pytest.raises(EffectError, match=r"'wild' grows without bound: .* at t = "):
        fit([record()], Axis.YAW, method="output_error", effects=["wild"])
