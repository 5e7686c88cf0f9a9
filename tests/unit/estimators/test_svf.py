"""What the state-variable-filter estimators say besides their numbers: remarks, history, discretisation."""

from __future__ import annotations

import numpy as np
import pytest
from truth.paper import PITCH, YAW, paper_run

from fieldsid.errors import DataError
from fieldsid.estimators.svf_ls import bandwidth_notes, base_slots, regress
from fieldsid.estimators.svf_rls import settle_time
from fieldsid.fitting.fit import fit
from fieldsid.fitting.problem.estimator import Options
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.fitting.regression.svf_equation import filtered_equation, measured_signals
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import Record, record_of

NOISE = np.deg2rad(0.3)


def record(row=YAW[0], axis=Axis.YAW, *, by_rate=True, seed=1, noise=0.0, **more) -> Record:
    log = paper_run(row, angle_noise=noise, rate_noise=noise, seed=seed, **more)
    if not by_rate:
        log.pop("yaw_rate_rad_s", None)
        log.pop("pitch_rate_rad_s", None)
    return record_of(Run("paper", log.pop("time_s"), log), axis)


def problem(log: Record) -> Problem:
    return Problem((log,), layout_of([log], log.axis, ()))


@pytest.mark.parametrize(("row", "axis"), [(YAW[0], Axis.YAW), (PITCH[4], Axis.PITCH)])
@pytest.mark.parametrize("by_rate", [True, False])
def test_straight_lines_between_samples_bias_by_less_than_six_thousandths_at_20_hz(row, axis, by_rate):
    log = record(row, axis, by_rate=by_rate)
    rows = filtered_equation(log, measured_signals(log, 4.0), 4.0)
    keep = [0, 2, 3] if axis is Axis.YAW else [0, 1, 2, 3]
    found = np.linalg.lstsq(np.column_stack([rows.columns[:, keep], rows.start]), rows.target, rcond=None)[0]
    damping, authority = (row.a22, row.b2) if axis is Axis.YAW else (row.c22, row.d2)
    assert 1e-5 < abs(found[0] / damping - 1.0) < 6e-3
    assert found[len(keep) - 2] == pytest.approx(authority, rel=6e-3)


@pytest.mark.parametrize("by_rate", [True, False])
def test_the_curvature_of_the_model_takes_that_bias_away(by_rate):
    x, _, _ = regress(problem(record(by_rate=by_rate)), 4.0)
    assert x[0] == pytest.approx(YAW[0].a22, rel=2e-5)


@pytest.mark.parametrize("bandwidth", [2.0, 8.0])
def test_the_bandwidth_does_not_move_the_answer_without_noise(bandwidth):
    x, _, _ = regress(problem(record(PITCH[0], Axis.PITCH)), bandwidth)
    np.testing.assert_allclose(x[:4], [PITCH[0].c22, PITCH[0].c23, PITCH[0].d2, PITCH[0].Cb], rtol=1e-3)


def test_a_wide_filter_on_an_angle_alone_is_remarked():
    alone, both = record(by_rate=False, noise=NOISE), record(noise=NOISE)
    codes = [n.code for n in fit([alone], Axis.YAW, method="svf_ls", options=Options(bandwidth=6.0)).notes]
    assert "wide_filter_angle_only" in codes
    assert bandwidth_notes([measured_signals(alone, 4.0)], 4.0) == ()
    assert bandwidth_notes([measured_signals(both, 6.0)], 6.0) == ()


def test_a_history_ends_at_the_model_and_says_when_each_parameter_settled():
    found = fit([record(noise=NOISE)], Axis.YAW, method="svf_rls")
    history = found.history
    assert history.names == ("a22", "b2", "C0")
    assert history.values.shape == history.std_errors.shape == (history.time.size, 3)
    np.testing.assert_allclose(history.values[-1], [found.model.values[n] for n in history.names])
    np.testing.assert_allclose(history.std_errors[-1], [found.model.std_error(n) for n in history.names], rtol=1e-4)
    assert 2.0 < history.settled_s["b2"] < 33.0
    middle = history.time.size // 2
    assert (history.std_errors[-1] < history.std_errors[middle]).all()


def test_forgetting_widens_the_band():
    kept, forgot = (
        fit([record(noise=NOISE)], Axis.YAW, method="svf_rls", options=Options(forgetting=b)).model for b in (1.0, 0.99)
    )
    assert forgot.std_error("a22") > 1.2 * kept.std_error("a22")


def test_a_parameter_is_settled_from_where_it_stays_within_its_band():
    time = np.arange(10.0)
    assert settle_time(time, np.array([9, 9, 1.2, 9, 1.04, 0.97, 1.01, 1, 1, 1.0]), 0.0) == 4.0
    assert settle_time(time, np.ones(10), 0.0) == 0.0
    assert settle_time(time, np.array([9, 9, 1.2, 1.2, 1.2, 1, 1, 1, 1, 1.0]), 0.15) == 2.0


@pytest.mark.parametrize("beta", [0.0, 1.1])
def test_a_forgetting_factor_out_of_range_is_refused(beta):
    with pytest.raises(DataError, match=r"must be in \(0, 1\]"):
        fit([record()], Axis.YAW, method="svf_rls", options=Options(forgetting=beta))


def test_a_record_too_short_for_the_filter_is_refused():
    log = record(noise=NOISE, by_rate=False)
    short = record_of(Run("short", log.time[:45], {"yaw_rad": log.angle[60:105], "rudder_rad": log.fin[60:105]}), Axis.YAW)
    with pytest.raises(DataError, match="too short for the recursion"):
        fit([short], Axis.YAW, method="svf_rls", options=Options(bandwidth=3.0))


def test_angle_only_pitch_knows_all_four_parameters():
    assert list(base_slots(problem(record(PITCH[0], Axis.PITCH, by_rate=False)))) == ["c22", "c23", "d2", "Cb"]


def test_instrumental_variables_reach_the_output_error_answer_on_an_angle_alone():
    log = record(PITCH[0], Axis.PITCH, by_rate=False, noise=NOISE)
    one, two = (fit([log], Axis.PITCH, method=m).model for m in ("srivc", "output_error"))
    for name in ("c22", "c23", "d2", "Cb"):
        assert one.values[name] == pytest.approx(two.values[name], abs=0.1 * two.std_error(name))
        assert one.std_error(name) == pytest.approx(two.std_error(name), rel=0.15)


def test_instrumental_variables_refuse_a_log_without_an_angle():
    log = paper_run(YAW[0])
    run = Run("rate", log["time_s"], {n: log[n] for n in ("yaw_rate_rad_s", "rudder_rad")})
    with pytest.raises(DataError, match="no measured angle"):
        fit([record_of(run, Axis.YAW)], Axis.YAW, method="srivc")
