"""Why an authority cannot be told from zero: the cause that is named is the one that was put in."""

from __future__ import annotations

import hidden_lag
import numpy as np
import pytest
from truth.pilots import Autopilot, excited
from truth.vehicle import Fins, Sea, fly_vehicle

from fieldsid.fitting.checks.authority_checks import confounded_with, far_from_zero
from fieldsid.fitting.fit import Fit
from fieldsid.fitting.identify import identify
from fieldsid.fitting.predict.goodness_of_fit import goodness_of_fit
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis

DEG = np.pi / 180.0
STEP = 0.05


def _fitted(log: dict[str, np.ndarray], axis: Axis = Axis.YAW, method: str = "output_error") -> Fit:
    log = dict(log)
    return identify([Run("run", log.pop("time_s"), log)], axis, whole=True, method=method)[0]


def _said(fit: Fit) -> dict[str, tuple[str, dict]]:
    return {n.code: (n.message, dict(n.data)) for n in fit.notes}


def _at_sea(fin: np.ndarray, *, gust: float, seed: int, noise: float = 0.2 * DEG) -> dict[str, np.ndarray]:
    """A vehicle of a22 = 1.1, b2 = -1.2 in gusts (rad/s^2, 1 s) with its fin held by a program, n samples."""
    rng, n = np.random.default_rng(seed), fin.size
    angle, rate, push = np.zeros(n), np.zeros(n), 0.0
    for i in range(n - 1):
        push = 0.95 * push + gust * np.sqrt(1.0 - 0.95**2) * rng.standard_normal()
        rate[i + 1] = rate[i] + STEP * (-1.1 * rate[i] - 1.2 * fin[i] + push)
        angle[i + 1] = angle[i] + STEP * rate[i + 1]
    seen = [v + noise * rng.standard_normal(n) for v in (angle, rate)]
    return {"time_s": np.arange(n) * STEP, "yaw_rad": seen[0], "yaw_rate_rad_s": seen[1], "rudder_rad": fin}


def _pulses(size: float, count: int = 800) -> np.ndarray:
    return size * np.sign(np.sin(2.0 * np.pi * (np.arange(count) * STEP + 0.01) / 8.0))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_fin_that_did_next_to_nothing_is_called_that_with_its_share(seed):
    message, data = _said(_fitted(_at_sea(_pulses(0.3 * DEG), gust=0.1, seed=seed)))["not_excited"]
    assert "hardly moved the vehicle" in message
    assert data["share"] < 1.0 / 3.0


@pytest.mark.parametrize("seed", [1, 2])
def test_a_fin_that_moved_the_vehicle_is_told_from_zero(seed):
    assert not {"not_excited", "authority_unclear"} & set(_said(_fitted(_at_sea(_pulses(10.0 * DEG), gust=0.1, seed=seed))))


def test_a_record_too_short_for_its_noise_is_not_blamed_on_the_model():
    message, data = _said(_fitted(_at_sea(_pulses(0.7 * DEG, 100)[40:], gust=0.0, seed=1, noise=1.4 * DEG)))["authority_unclear"]
    assert data["causes"] == ["too_little"]
    assert "even at the sensors' noise alone" in message


@pytest.mark.parametrize("gust", [0.5, 2.0, 8.0])
def test_under_a_controller_that_uses_all_its_fin_the_feedback_is_the_cause(gust):
    pilot, goals = Autopilot(heading=0.0, kp=0.8, kd=1.0), (0.0, 0.6, -0.4, 0.2)

    def steer(t, seen):
        pilot.heading = goals[int(t // 15) % 4]
        return pilot(t, seen)

    log = fly_vehicle(steer, 60.0, sea=Sea(gust=(0.0, gust)), fins=Fins(limit=24.0 * DEG), seed=1).log
    assert np.max(np.abs(log["rudder_rad"])) == pytest.approx(24.0 * DEG)
    said = _said(_fitted(log))
    assert "not_excited" not in said
    message, data = said["authority_unclear"]
    assert data["causes"] == ["feedback"]
    assert "a controller flies the fin" in message
    assert said["feedback"][1]["gain"] == pytest.approx(0.8, abs=0.01)
    assert said["feedback"][1]["rate_gain_s"] == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("speed", [1.54, 2.0])
def test_a_form_that_does_not_fit_is_named_with_the_twin_and_what_is_left(speed):
    t = np.arange(0.0, 30.0, STEP)
    fins = sum((np.sign(np.sin(np.pi * (t - a) / 2.0)) * ((t > a) & (t < a + 4.0)) for a in (2.0, 12.0)), np.zeros(t.size))
    log = fly_vehicle(excited(Autopilot(), "pitch", t, 15.0 * DEG * fins), 30.0, speed=speed, seed=1).log
    fit = _fitted(log, Axis.PITCH)
    assert goodness_of_fit(fit.predictions).rate_fit > 65.0
    message, data = _said(fit)["authority_unclear"]
    assert "hardly" not in message
    assert data["causes"] == ["collinear", "misfit"]
    assert "c22" in message
    assert "x the sensors' noise" in message


def test_an_error_by_what_the_model_leaves_is_not_called_a_value_near_zero():
    training, _ = hidden_lag.runs()
    fit = identify(training, Axis.YAW, joint=True, method="output_error")[0]
    notes = [n for n in fit.notes if n.code == "authority_unclear"]
    assert [n.data["parameter"] for n in notes] == ["b2@1", "b2"]
    for note in notes:
        assert "misfit" in note.data["causes"]
        assert "from zero" not in note.message
        assert "x the sensors' noise" in note.message


def test_of_many_parameters_those_are_named_whose_knowledge_helps():
    rng = np.random.default_rng(3)
    j = rng.standard_normal((200, 4))
    j[:, 3] = j[:, 0] + j[:, 1] + 1e-3 * rng.standard_normal(200)
    known = np.linalg.inv(j.T @ j)
    twins, error = confounded_with(known, 3, 0.2)
    assert len(twins) == 1
    assert set(twins) < {0, 1}
    assert error == pytest.approx(np.sqrt(np.linalg.inv(np.delete(np.delete(j.T @ j, twins, 0), twins, 1))[-1, -1]))
    assert confounded_with(known, 2, 0.2)[0] == []


def test_how_far_a_value_is_from_zero_is_said_by_the_number_that_was_compared():
    assert far_from_zero(-1.58, 0.5277) == "is 2.99 standard errors from zero, less than 3"
    assert far_from_zero(-2.9998, 1.0) == "is 2.9998 standard errors from zero, less than 3"
    assert far_from_zero(1.0, 0.6) == "cannot be told from zero"
