"""Every finding about the data: raised with its number and limit where it should be, silent on clean runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from truth import maneuvers
from truth.logbook import flown
from truth.noise import Clock
from truth.paper import DEG, PITCH, YAW, YawRow, paper_run, physics_of

from fieldsid.fitting.checks.record_checks import clipped_share
from fieldsid.fitting.checks.score_tests import lateness
from fieldsid.fitting.fit import fit
from fieldsid.fitting.identify import identify
from fieldsid.fitting.problem.estimator import Solution
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import left_out, record_of
from fieldsid.vehicle import vehicle_of

NOISE = 0.3 * DEG
CODES = {
    "fin_unknown", "fin_missing", "offset_beyond_fin",
    "short_record", "speed_changing", "clock_jump", "sensor_clipped", "filtered_sensor", "feedback", "ignored_delay",
    "negative_delay", "hidden_instability", "fin_measured_used", "fin_at_limit", "other_axis_moving", "impossible_sign",
}  # fmt: skip
CLOCK = Clock(0.05, 660)


def run_of(log) -> Run:
    log = dict(log)
    return Run("paper", log.pop("time_s"), log)


def paper(row=YAW[1], seed=1) -> Run:
    return run_of(paper_run(row, angle_noise=NOISE, rate_noise=NOISE, seed=seed))


def pulsed(seed=3, **numbers) -> Run:
    plan = maneuvers.pulses(CLOCK.time, 0.26, 0.15, start=2.0, recovery=9.0)
    physics = physics_of(YAW[1])._replace(**numbers)
    return run_of(flown(physics, CLOCK, plan, angle_noise=NOISE, rate_noise=NOISE, seed=seed))


def notes(run: Run, axis=Axis.YAW, **kw) -> dict[str, dict]:
    return {n.code: dict(n.data) for n in identify([run], axis, whole=True, **kw)[0].notes}


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("row", [YAW[0], YAW[4], PITCH[0], PITCH[4]], ids=lambda r: f"{type(r).__name__}{r.speed}")
def test_clean_runs_raise_no_alarm(row, seed):
    assert not CODES & set(notes(paper(row, seed), Axis.YAW if isinstance(row, YawRow) else Axis.PITCH))


@pytest.mark.parametrize("numbers", [{"delay": 0.05}, {"servo_tau": 0.05}], ids=str)
def test_fifty_ms_of_delay_is_found_with_what_it_costs(numbers):
    found = notes(pulsed(**numbers))["ignored_delay"]
    assert found["value"] == pytest.approx(0.05, abs=0.025)
    assert -15.0 < found["bias_percent"] < -4.0


@pytest.mark.parametrize(("numbers", "late"), [({"delay": 0.1}, 0.1), ({"delay": 0.2}, 0.2), ({"servo_tau": 0.6}, 0.35)], ids=str)
def test_what_a_long_delay_costs_is_that_of_a_fit_with_it(numbers, late):
    found = notes(pulsed(**numbers))["ignored_delay"]
    assert found["value"] == pytest.approx(late, abs=0.02)
    with_it = identify([pulsed(**numbers)], Axis.YAW, whole=True, effects=["delay"], method="output_error")[0].model.values
    without = identify([pulsed(**numbers)], Axis.YAW, whole=True, method="output_error")[0].model.values
    assert found["bias_percent"] == pytest.approx(100.0 * (without["a22"] / with_it["a22"] - 1.0), abs=1.0)
    if "delay" in numbers:
        assert found["with"] == pytest.approx(YAW[1].a22, rel=0.03)


def test_where_the_measured_fin_is_used_nobody_is_told_to_log_it():
    late = pulsed(delay=0.1)
    signals = {name: late[name] for name in late.signals}
    measured = Run("paper", late.time, {**signals, "rudder_measured_rad": late["rudder_rad"]})
    for run, is_told in ((late, True), (measured, False)):
        (note,) = (n for n in identify([run], Axis.YAW, whole=True)[0].notes if n.code == "ignored_delay")
        assert ("log the measured fin" in note.message, "after the logged fin" in note.message) == (is_told, is_told)


@pytest.mark.parametrize("offset", [0.05, 0.1])
def test_how_far_a_clock_is_off_is_that_of_a_fit_with_it(offset):
    assert notes(pulsed(clock_offset=offset))["negative_delay"]["value"] == pytest.approx(-offset, abs=0.015)


def test_under_a_disturbance_the_fit_without_it_is_the_one_that_is_printed():
    plan = maneuvers.pulses(CLOCK.time, 0.26, 0.15, start=2.0, recovery=9.0)
    late = physics_of(YAW[1])._replace(delay=0.1)
    run = run_of(flown(late, CLOCK, plan, angle_noise=NOISE, rate_noise=NOISE, gust=0.02, seed=1))
    (found,) = identify([run], Axis.YAW, whole=True, method="pem")
    (said,) = (n.data for n in found.notes if n.code == "ignored_delay")
    assert said["without"] == pytest.approx(found.model.values["a22"], rel=1e-3)


def test_a_lateness_that_a_refit_does_not_settle_at_is_not_said():
    record = record_of(pulsed(), Axis.YAW)
    found = fit([record], Axis.YAW, method="output_error")
    problem = Problem((record,), layout_of([record], Axis.YAW, ()))
    x = np.array([found.model.values[n] for n in problem.layout.names] + list(found.predictions[0].state[:2]))
    assert lateness(problem, Solution(x, found.model.covariance, found.model.noise, "output_error"), 0.9) is None


def test_a_clock_that_is_off_is_never_called_a_lag():
    found = notes(pulsed(clock_offset=0.1))
    assert "ignored_delay" not in found
    assert found["negative_delay"]["value"] < 0.0


def test_an_instability_hidden_by_nonlinear_drag_is_said_loudly():
    record = record_of(pulsed(damping=-0.15, quadratic=4.0), Axis.YAW)
    said = [n for n in fit([record], Axis.YAW).notes if n.code == "hidden_instability"]
    assert said
    assert said[0].message.startswith("UNSTABLE")
    assert said[0].data["value"] == pytest.approx(-0.15, abs=0.1)


def test_feedback_is_named_with_gain_and_delay():
    rng, n = np.random.default_rng(4), 1200
    angle, rate, fin = np.zeros(n), np.zeros(n), np.zeros(n)
    goal = np.repeat([0.0, 0.3, -0.2, 0.1], n // 4)
    seen = np.zeros(n)
    for i in range(n - 1):
        seen[i] = angle[i] + 0.002 * rng.standard_normal()
        fin[i] = -1.5 * (goal[i] - seen[max(i - 4, 0)]) / 1.0
        rate[i + 1] = rate[i] + 0.05 * (-1.1 * rate[i] - 0.86 * fin[i])
        angle[i + 1] = angle[i] + 0.05 * rate[i + 1]
    seen[-1], fin[-1] = angle[-1], fin[-2]
    run = Run(
        "auto", np.arange(n) * 0.05, {"yaw_rad": seen, "yaw_rate_rad_s": rate + 0.002 * rng.standard_normal(n), "rudder_rad": fin}
    )
    found = notes(run)["feedback"]
    assert found["gain"] == pytest.approx(1.5, rel=0.1)
    assert found["delay_s"] == pytest.approx(0.2, abs=0.05)


def test_a_clipped_rate_sensor_is_named():
    run = paper()
    clipped = np.clip(run["yaw_rate_rad_s"], -0.1, 0.1)
    found = notes(Run("clip", run.time, {**run.signals, "yaw_rate_rad_s": clipped}))["sensor_clipped"]
    assert abs(found["level"]) == pytest.approx(0.1)
    assert found["value"] > found["limit"]


def test_the_rounded_peak_of_a_coarse_sensor_is_not_clipping():
    wave = np.round(0.2 * np.sin(np.arange(660) * 0.02) / 0.01) * 0.01
    assert clipped_share(wave, 5)[1] == 0.0
    of_three_digits = np.array([float(f"{v:.2e}") for v in 35.1 * np.sin(np.arange(2000) * 0.002)])
    assert clipped_share(of_three_digits, 5)[1] == 0.0


@pytest.mark.parametrize(
    ("code", "change"),
    [
        ("speed_changing", {"surge_m_s": np.linspace(1.5, 1.2, 660)}),
        ("other_axis_moving", {"pitch_rate_rad_s": 0.2 * np.sin(np.arange(660) * 0.05)}),
        ("fin_measured_used", {"rudder_measured_rad": np.roll(paper()["rudder_rad"], 6)}),
    ],
)
def test_what_a_run_shows_beside_its_own_axis_is_named(code, change):
    run = paper()
    found = notes(Run("odd", run.time, {**run.signals, **change}))[code]
    assert found["value"] > found["limit"]


def test_a_clock_jump_is_named_with_its_place():
    run = paper()
    found = notes(Run("jump", run.time + np.where(np.arange(660) > 300, 1.0, 0.0), run.signals))["clock_jump"]
    assert found["value"] == pytest.approx(1.05)
    assert found["count"] == 1


@pytest.mark.parametrize("late", [-0.5, 0.0, 0.5])
@pytest.mark.parametrize("kind", ["fin", "all"])
def test_a_hole_that_hides_a_switch_of_the_fin_is_cut_out_and_said(kind, late):
    run = pulsed()
    switch = run.time[np.flatnonzero(run["rudder_rad"] < -0.2)[0]]  # from one side to the other
    inside = np.abs(run.time - switch - late) < 0.6
    holed = Run("holed", run.time, {**run.signals, "rudder_rad": np.where(inside, np.nan, run["rudder_rad"])})
    if kind == "all":
        holed = Run("holed", run.time[~inside], {name: values[~inside] for name, values in run.signals.items()})
    (found,) = identify([holed], Axis.YAW, whole=True)
    assert found.model.values["a22"] == pytest.approx(YAW[1].a22, rel=0.03)
    said = {n.code: n for n in found.notes}
    assert not {"unstable", "hidden_instability", "coloured_residuals", "clock_jump"} & set(said)
    assert said["fin_unknown"].data["value"] == pytest.approx(1.2, abs=0.06)
    assert said["fin_unknown"].data["start_s"] == pytest.approx(switch + late - 0.6, abs=0.06)
    used = found.predictions[0].record.time
    assert f"{used[0]:.2f} .. {used[-1]:.2f} s are used" in said["fin_unknown"].message
    assert [n.code for n in left_out([holed], Axis.YAW)] == ["fin_unknown"]


def test_a_hole_in_the_fin_that_hides_no_move_is_held_and_said():
    run = pulsed()
    inside = np.abs(run.time - 10.0) < 0.6
    holed = Run("holed", run.time, {**run.signals, "rudder_rad": np.where(inside, np.nan, run["rudder_rad"])})
    found = notes(holed)
    assert found["fin_missing"]["value"] == pytest.approx(1.2, abs=0.06)
    assert "fin_unknown" not in found


def test_an_offset_beyond_any_fin_is_named():
    (found,) = identify([pulsed(trim=1.0)], Axis.YAW, whole=True)
    (said,) = (n for n in found.notes if n.code == "offset_beyond_fin")
    assert abs(said.data["value"]) == pytest.approx(1.0 / abs(YAW[1].b2), rel=0.05)
    assert said.message.startswith("delta_r0 = -1.1")
    assert "beyond the largest fin of the runs" in said.message
    limited = vehicle_of({"name": "v", "rudder_max_rad": 0.1})
    assert "offset_beyond_fin" in notes(pulsed(trim=0.12), vehicle=limited)
    assert "offset_beyond_fin" not in notes(pulsed(trim=0.12))


def test_a_record_of_a_slow_vehicle_is_called_short():
    record = record_of(paper(), Axis.YAW)
    keep = slice(0, 120)
    cut = replace(record, time=record.time[keep], fin=record.fin[keep], angle=record.angle[keep], rate=record.rate[keep],
                  angle_ok=record.angle_ok[keep], rate_ok=record.rate_ok[keep], signals={k: v[keep] for k, v in record.signals.items()})  # fmt: skip  # noqa: E501
    from fieldsid.fitting.checks.record_checks import _short

    (note,) = _short(cut, 0.5)
    assert note.data["limit"] == pytest.approx(10.0)


def test_a_vehicle_that_says_its_side_and_limit_is_believed():
    right = vehicle_of({"name": "v", "positive_rudder": "port", "rudder_max_rad": 0.4})
    wrong = vehicle_of({"name": "v", "positive_rudder": "starboard", "rudder_max_rad": 0.22})
    assert not {"impossible_sign", "fin_at_limit"} & set(notes(paper(), vehicle=right))
    assert {"impossible_sign", "fin_at_limit"} <= set(notes(paper(), vehicle=wrong))


def test_a_plan_of_the_whole_fin_is_no_fault_of_its_run():
    whole = vehicle_of({"name": "v", "positive_rudder": "port", "rudder_max_rad": 0.26})
    assert np.max(np.abs(paper()["rudder_rad"])) > 0.26  # the pulses are about the trim
    assert "fin_at_limit" not in notes(paper(), vehicle=whole)
