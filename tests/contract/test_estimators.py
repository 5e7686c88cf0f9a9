"""What every estimator keeps to; a new file in fieldsid/estimators gets these tests for free."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest
from truth.paper import PITCH, YAW, paper_run

from fieldsid.errors import FieldsidError, UsageError
from fieldsid.fitting.fit import estimators, fit
from fieldsid.logs.run import Run
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.record import Record, record_of

ESTIMATORS = estimators()
each = pytest.mark.parametrize("name", ESTIMATORS)
NOISE = np.deg2rad(0.3)


def record(axis: Axis, **change) -> Record:
    log = paper_run(YAW[1] if axis is Axis.YAW else PITCH[1], angle_noise=NOISE, rate_noise=NOISE, seed=4)
    made = record_of(Run("paper", log.pop("time_s"), log), axis)
    return replace(made, **change)


@each
def test_it_says_what_it_does_and_where_it_is_from(name):
    assert ESTIMATORS[name].name == name
    assert len(ESTIMATORS[name].says) > 20
    assert len(ESTIMATORS[name].source) > 10


@each
@pytest.mark.parametrize("axis", Axis)
def test_the_model_is_complete_and_its_errors_positive(name, axis):
    found = fit([record(axis)], axis, method=name)
    model, base = found.model, NAMES[axis].base
    assert model.method == name
    assert set(base) <= set(model.values)
    assert all(np.isfinite(model.values[n]) and model.std_error(n) > 0.0 for n in base)
    np.testing.assert_allclose(model.covariance, model.covariance.T)
    assert np.linalg.eigvalsh(found.correlation).min() > -1e-9
    assert np.isfinite(found.predictions[0].rate).all()


@each
def test_the_same_data_give_the_same_answer(name):
    one, two = (fit([record(Axis.YAW)], Axis.YAW, method=name).model for _ in range(2))
    assert dict(one.values) == dict(two.values)


@each
def test_the_records_are_left_as_they_were(name):
    log = record(Axis.PITCH)
    before = [np.array(a) for a in (log.time, log.fin, log.angle, log.rate)]
    fit([log], Axis.PITCH, method=name)
    for was, now in zip(before, (log.time, log.fin, log.angle, log.rate), strict=True):
        np.testing.assert_array_equal(was, now)


@each
def test_a_gap_and_uneven_steps_do_no_harm(name):
    log = record(Axis.YAW)
    rng = np.random.default_rng(1)
    keep = np.sort(rng.choice(len(log), 560, replace=False))
    ok = np.ones(560, bool)
    ok[300:330] = False
    cut = {f: getattr(log, f)[keep] for f in ("time", "fin", "angle", "rate")}
    cut["angle"] = np.where(ok, cut["angle"], 0.0)
    cut["rate"] = np.where(ok, cut["rate"], 0.0)
    model = fit([record(Axis.YAW, **cut, angle_ok=ok, rate_ok=ok, signals=MappingProxyType({}))], Axis.YAW, method=name).model
    assert model.values["a22"] == pytest.approx(YAW[1].a22, rel=0.15)
    assert model.values["b2"] == pytest.approx(YAW[1].b2, rel=0.15)


@each
@pytest.mark.parametrize("channel", ["angle", "rate"])
def test_one_channel_alone_is_used_or_refused_with_a_hint(name, channel):
    none = np.zeros(660, bool)
    log = record(Axis.YAW, **{f"{channel}_ok": none, channel: np.zeros(660)})
    try:
        found = fit([log], Axis.YAW, method=name).model.values["a22"]
    except FieldsidError as error:
        found = YAW[1].a22 if error.hint else 0.0
    assert found == pytest.approx(YAW[1].a22, rel=0.25)


@pytest.mark.parametrize("name", [n for n, e in ESTIMATORS.items() if not e.takes_effects])
def test_effects_are_refused_by_an_estimator_that_has_none(name):
    with pytest.raises(UsageError, match="cannot estimate effects"):
        fit([record(Axis.YAW)], Axis.YAW, method=name, effects=["servo_lag"])


@each
def test_two_runs_are_fitted_jointly_or_refused(name):
    logs = [record(Axis.YAW), record(Axis.YAW, speed=1.9)]
    if not ESTIMATORS[name].joint:
        with pytest.raises(UsageError, match="one run at a time"):
            fit(logs, Axis.YAW, method=name)
        return
    model = fit(logs, Axis.YAW, method=name).model
    assert len(model.law.points) == 2
