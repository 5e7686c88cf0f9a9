"""Extending a model: the true effect pays on runs that were not fitted, a wrong one does not, and what is written says so."""

from __future__ import annotations

import sys
from dataclasses import replace

import hidden_lag
import numpy as np
import pytest
from cli.trial import vehicle

from fieldsid.errors import DataError, UsageError
from fieldsid.extension.extend import extend_in_steps, whole_of
from fieldsid.fitting.predict.predict import predict
from fieldsid.logs.run import Note
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of

PLAIN = vehicle(Axis.YAW)


def extend(*given):
    """Return all steps of an extension as one."""
    return whole_of(extend_in_steps(*given))


@pytest.fixture(scope="module")
def runs():
    return hidden_lag.runs()


@pytest.fixture(scope="module")
def lagged(runs):
    train, unseen = runs
    return extend(PLAIN, ["servo_lag"], train, [unseen])


def test_the_true_effect_brings_the_error_on_unseen_runs_down_to_the_floor(lagged):
    before, after = lagged.gain.over_floor
    assert before > 3.0
    assert after == pytest.approx(1.0, abs=0.06)
    assert lagged.pays
    assert lagged.evidence > 100.0


def test_a_whole_says_the_forms_of_all_its_steps_and_how_the_runs_were_flown_by_its_last(lagged):
    flown = [Note("own_speed", f"flown {share} % slower") for share in (0.5, 0.7)]
    formed = [Note("form_taken", f"`{name}` in another form") for name in ("servo_lag", "quadratic_damping")]
    steps = [replace(lagged, notes=(form, by)) for form, by in zip(formed, flown, strict=True)]
    assert whole_of(steps).notes == (formed[0], formed[1], flown[1])


def test_the_truth_lies_within_the_extended_models_errors(lagged):
    model = lagged.model
    assert model.effects == ("servo_lag",)
    for name, truth in {"lag": hidden_lag.LAG, "a22": 1.1, "b2": -1.2, "C0": 0.01}.items():
        reference = model.at_speed(hidden_lag.REFERENCE).get(name, model.values[name])
        assert abs(reference - truth) < 4.0 * model.std_error(name) + 0.02 * abs(truth), name
    assert 0.0 < model.std_error("lag") < 0.05


def test_the_model_that_is_kept_is_the_one_whose_error_was_reported(lagged, runs):
    left = predict(lagged.model, record_of(runs[1], Axis.YAW)).residual
    angle, rate = np.sqrt(np.mean(left**2, axis=1))
    assert angle == pytest.approx(lagged.gain.after.validation.angle_rms_rad, rel=1e-3)
    assert rate == pytest.approx(lagged.gain.after.validation.rate_rms_rad_s, rel=1e-3)


def test_an_effect_that_is_not_there_does_not_pay():
    train, unseen = hidden_lag.runs(lag=0.0)
    found = extend(PLAIN, ["deadband"], train, [unseen])
    assert not found.pays
    assert found.gain.unseen
    assert found.gain.over_floor[1] == pytest.approx(1.0, abs=0.1)


def test_what_is_accepted_though_no_unseen_error_falls_is_fitted_to_all_runs(monkeypatch):
    monkeypatch.setattr(sys.modules[extend_in_steps.__module__], "is_accepted", lambda *_of: True)
    train, unseen = hidden_lag.runs(lag=0.0)
    found = extend(PLAIN, ["deadband"], train, [unseen])
    assert not found.gain.unseen
    assert found.gain.learned_on == (*(r.name for r in train), unseen.name) == found.gain.judged_on
    assert "fitted_to_all" in {note.code for note in found.notes}
    assert not found.pays


def test_where_nothing_can_be_held_back_the_evidence_must_pay():
    short = hidden_lag.runs(lag=0.0)[0][0].between(0.0, 9.0)
    found = extend(PLAIN, ["quadratic_damping"], [short])
    assert not found.gain.unseen
    assert not found.pays
    assert [n.code for n in found.notes] == ["nothing_held_back"]


def test_a_base_is_refitted_from_the_parents_own_values_as_well(lagged, runs):
    train, unseen = runs
    again = extend(lagged.model, ["quadratic_damping"], train, [unseen])
    assert again.gain.over_floor[0] == pytest.approx(lagged.gain.over_floor[1], rel=0.01)
    assert again.model.effects == ("servo_lag", "quadratic_damping")
    assert not again.pays


def test_the_steps_to_a_named_model_add_first_what_lowers_the_error_most_and_reach_its_values(runs):
    train, unseen = runs
    named = extend(PLAIN, ["quadratic_damping", "servo_lag"], train, [unseen]).model
    first, last = extend_in_steps(PLAIN, named.effects, train, [unseen], found=named)
    assert first.gain.added == ("servo_lag",)
    assert first.gain.over_floor[1] < 0.5 * first.gain.over_floor[0]
    assert last.gain.over_floor[1] == pytest.approx(1.0, abs=0.06)
    assert last.model.values["lag"] == pytest.approx(named.values["lag"], rel=0.02)


@pytest.mark.parametrize(
    ("model", "add", "says"),
    [
        (PLAIN, [], "no effect to add"),
        (PLAIN, ["servolag"], "no effect named 'servolag'"),
        (PLAIN, ["heave_coupling"], "does not act on the yaw axis"),
        (vehicle(Axis.YAW, "servo_lag", lag=0.3), ["servo_lag"], "is in the model already"),
    ],
)
def test_what_cannot_be_added_is_refused(runs, model, add, says):
    with pytest.raises(UsageError, match=says):
        extend(model, add, runs[0])


def test_an_effect_whose_signal_the_log_lacks_is_refused_with_its_name(runs):
    with pytest.raises(DataError, match="`roll_coupling` needs roll, which the log lacks"):
        extend(PLAIN, ["roll_coupling"], runs[0])
