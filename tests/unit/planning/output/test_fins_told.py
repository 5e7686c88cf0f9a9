"""Plans for a vehicle of several fins: every file tells each of them, within its limit."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from moos_helm import script
from numpy.testing import assert_allclose
from plan_legs import leg, plan
from played import ArduPilot

from fieldsid.logs.load import load_run
from fieldsid.logs.mapping.mapping_file import mapping_of
from fieldsid.models.allocation import Fins
from fieldsid.planning.design.leg import commands_of
from fieldsid.planning.output.command_files import conditions_text, table_text, write_all
from fieldsid.planning.output.mission import render, steps_of
from fieldsid.planning.output.plan_file import load_plan, save_plan

X = Fins(("fin1", "fin2", "fin3", "fin4"), (0.25, 0.25, -0.25, -0.25), (0.25, -0.25, 0.25, -0.25), (0.3, 0.3, 0.3, 0.2))
"""The fourth fin reaches less than the rudder of the plan, 0.26 rad."""
PLAN = replace(plan(), fins=X.of("yaw"))


def rudder():
    return commands_of(leg(), PLAN.envelope)[1]


def test_the_table_has_a_column_for_each_fin_and_none_beyond_its_limit():
    head, *rows = table_text(PLAN, leg()).splitlines()
    assert head == "time_s,rudder_rad,autopilot,fin1,fin2,fin3,fin4"
    told = np.array([row.split(",") for row in rows], dtype=float)
    fins = told[:, 3:]
    assert np.abs(rudder()).max() > 0.2
    assert np.abs(fins[:, 3]).max() == pytest.approx(0.2)
    wanted = np.sign(rudder()) * np.minimum(np.abs(rudder()), 0.2)
    assert_allclose(fins, np.outer(wanted, [1, 1, -1, -1]), atol=1e-6)


def test_the_log_of_the_table_maps_back_to_the_rudder(tmp_path):
    (tmp_path / "leg.csv").write_text(table_text(PLAN, leg()))
    entries = [{"column": f"fin{k}", "scale": s} for k, s in enumerate(X.to_rudder, 1)]
    run = load_run(tmp_path / "leg.csv", mapping_of({"time": {"column": "time_s"}, "signals": {"rudder_rad": {"sum": entries}}}))
    assert_allclose(run["rudder_rad"], np.sign(rudder()) * np.minimum(np.abs(rudder()), 0.2), atol=1e-6)


def test_a_plan_comes_back_with_its_fins(tmp_path):
    assert load_plan(save_plan(PLAN, tmp_path / "plan.yaml")).fins == PLAN.fins
    assert load_plan(save_plan(plan(), tmp_path / "one.yaml")).fins is None


def test_a_moos_script_posts_each_fin_in_degrees():
    events, _ = script(render(PLAN, leg(), "moos_timer_script.moos"))
    steps = [s for s in steps_of(PLAN, leg()) if not s.autopilot]
    for k, name in enumerate(PLAN.fins.names):
        posted = [(t, float(v)) for t, n, v in events if n == f"DESIRED_{name.upper()}"]
        assert_allclose(posted, [(s.time, np.degrees(s.fins[k])) for s in steps], atol=1e-3)


def test_a_dune_task_lists_each_fin():
    text = render(PLAN, leg(), "dune.ini")
    steps = steps_of(PLAN, leg())
    for k, name in enumerate(PLAN.fins.names):
        listed = re.search(rf"^{name} \(rad\) *= (.*)$", text, re.MULTILINE)[1]
        assert_allclose([float(v) for v in listed.split(", ")], [s.fins[k] for s in steps], atol=1e-6)
    assert re.search(r"^Maximum fin4 \(rad\) *= 0.2$", text, re.MULTILINE)


def test_a_bag_has_a_topic_for_each_fin(tmp_path):
    (bag,) = [p for p in write_all(replace(PLAN, legs=(leg(),)), tmp_path, ["ros2"]) if p.is_dir()]
    topics = {"rudder_rad": "/fin1_command", "elevator_rad": "/fin4_command"}
    signals = {signal: {"topic": topic, "field": "data"} for signal, topic in topics.items()}
    run = load_run(bag, mapping_of({"signals": signals}))
    assert_allclose(run["elevator_rad"], -run["rudder_rad"])
    assert np.abs(run["elevator_rad"]).max() == pytest.approx(0.2)
    assert '"fins": {"names": ["fin1"' in conditions_text(PLAN, leg())


def test_thrusters_are_told_in_their_own_unit():
    boat = Fins(("port", "stbd"), (-0.01, 0.01), (), (30.0, 30.0), "N").of("yaw")
    text = render(replace(plan(), fins=boat), leg(), "moos_timer_script.moos")
    events, _ = script(text)
    stbd = [float(v) for _, n, v in events if n == "DESIRED_STBD"]
    wanted = [50.0 * s.fin for s in steps_of(plan(), leg()) if not s.autopilot]
    assert_allclose(stbd, wanted, atol=2e-3)
    assert "N, never more than 30" in text


class Servos(ArduPilot):
    """A vehicle whose fins each have a function, a channel and a sign of their own."""

    def __init__(self, text):
        self.told = {}
        for k in range(4):
            for word, value in ((f"PWM_PER_RAD_fin{k + 1}", 600.0 + 100.0 * k), (f"FIN_FUNCTION_fin{k + 1}", 31 + k)):
                assert f"local {word} = nil" in text
                text = text.replace(f"local {word} = nil", f"local {word} = {value}")
        super().__init__("local PWM_PER_RAD = nil\nlocal FIN_FUNCTION = nil\n" + text, 0.0)

    def get_output_pwm(self, function):
        return 1400 + function

    def find_channel(self, function):
        return function

    def set_output_pwm_chan_timeout(self, channel, pwm, milliseconds):
        assert milliseconds >= self.step_ms
        k = channel - 31
        self.told[k] = (pwm - 1400 - channel) / (600.0 + 100.0 * k)


def straight(t):
    """A vehicle on its leg that nothing turns."""
    return SimpleNamespace(surge=1.4, yaw=0.0, pitch=0.0, roll=0.0, depth=3.0, x=10.0 + 1.4 * t, y=0.0)


def test_an_ardupilot_script_tells_each_servo_within_its_limit():
    vehicle = Servos(render(replace(PLAN, envelope=replace(PLAN.envelope, area_length=None)), leg(), "ardupilot.lua"))
    steps = steps_of(PLAN, leg())
    seen = []
    for t in np.arange(0.0, 20.0, 0.05):
        vehicle.told = {}
        vehicle.step(float(t), straight(t))
        last = [s for s in steps if s.time <= t + 1e-6][-1]
        if vehicle.told and not last.autopilot:
            assert_allclose(
                [vehicle.told[k] for k in range(4)], np.clip(last.fin, -0.2, 0.2) * np.array([1, 1, -1, -1]), atol=2e-3
            )
            seen.append(last.fin)
    assert vehicle.aborted is None
    assert np.ptp(seen) > 0.3
