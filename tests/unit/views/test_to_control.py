"""Models and schedules as python-control systems: poles, margins and steps by it are those of the own plant and loop."""

from __future__ import annotations

import control
import numpy as np
import pytest

from fieldsid.errors import UsageError
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.plant.parameter_source import source_of_models
from fieldsid.schedule.controller import Gains, closed_poles, margins
from fieldsid.schedule.flown.response import Flight, fly
from fieldsid.schedule.linear_plant import FinLimits, plants_at
from fieldsid.schedule.record import Row, Schedule

PATHS = {
    "hull": {},
    "lag": {"lag": 0.25},
    "lag and delay": {"lag": 0.25, "delay": 0.2},
    "sway": {"cross_damping": 0.9, "cross_rate": -0.3, "cross_fin": 0.4, "cross_quadratic": 0.0, "lag": 0.2},
}
EFFECTS = {"lag": "servo_lag", "delay": "delay", "cross_damping": "sway_coupling"}


def model_of(own):
    values = {"a22": 1.1, "b2": -1.3, "C0": 0.0} | own
    effects = tuple(EFFECTS[n] for n in own if n in EFFECTS)
    return Model(Axis.YAW, effects, values, {}, (), np.zeros((0, 0)), SpeedLaw(1.5), Noise(0.005, 0.005))


def plant_at(model, speed):
    ((plant, _),) = plants_at(source_of_models([model], ["m"]), speed, FinLimits(), 1, 0)
    return plant


def row_at(speed, gains):
    return Row(speed, gains, 0.0, 0.0, 10.0)


def schedule_of(*rows):
    return Schedule(Axis.YAW, "pd", 0.7, 45.0, depth=False, rows=rows, actuator={})


def closed(model, schedule, speed):
    systems = [model.to_control(speed), schedule.to_control(speed)]
    return control.interconnect(systems, inputs=["yaw_goal_rad"], outputs=["yaw_rad"])


@pytest.mark.parametrize("own", PATHS.values(), ids=PATHS)
@pytest.mark.parametrize("speed", [1.0, 1.5])
def test_a_models_bode_is_the_plants(own, speed):
    model, omega = model_of(own), np.geomspace(0.05, 8.0, 40)
    system, plant = model.to_control(speed), plant_at(model, speed)
    assert system.input_labels == ["rudder_rad"]
    assert system.output_labels == ["yaw_rad", "yaw_rate_rad_s"]
    both = system(1j * omega)
    assert both[0, 0] == pytest.approx(plant.response(omega)[0], rel=1e-3)
    assert both[1, 0] == pytest.approx(1j * omega * plant.response(omega)[0], rel=1e-3)


@pytest.mark.parametrize("own", [PATHS["hull"], PATHS["lag"], PATHS["sway"]], ids=["hull", "lag", "sway"])
@pytest.mark.parametrize("gains", [Gains(-0.6), Gains(-0.6, 0.0, -0.3), Gains(-0.6, -0.05, -0.3)], ids=["p", "pd", "pid"])
def test_poles_of_the_interconnected_loop_are_the_closed_poles(own, gains):
    model, schedule = model_of(own), schedule_of(row_at(1.5, gains))
    ours = closed_poles(plant_at(model, 1.5), gains)[0]
    assert np.sort_complex(closed(model, schedule, 1.5).poles()) == pytest.approx(np.sort_complex(ours), abs=1e-6)


def test_margins_by_python_control_of_the_opened_loop_are_those_of_the_design():
    model, gains = model_of(PATHS["lag and delay"]), Gains(-0.7, 0.0, -0.4)
    plant, controller = model.to_control(), schedule_of(row_at(1.5, gains)).to_control(1.5)
    opened = -controller[0, 1:] * plant  # of angle and rate back to the fin
    gain, phase, *_ = control.margin(control.ss(opened.A, opened.B, opened.C, opened.D))
    found = margins(plant_at(model, 1.5), gains)
    assert phase == pytest.approx(found.phase_deg[0], abs=0.3)
    assert 20.0 * np.log10(gain) == pytest.approx(found.gain_db[0], abs=0.1)


def test_a_step_by_python_control_is_the_one_that_is_flown():
    model, gains = model_of(PATHS["lag"]), Gains(-0.6, 0.0, -0.3)
    flown = fly(plant_at(model, 1.5), [row_at(1.5, gains)], Flight(12.0, reference=0.3))
    theirs = control.step_response(closed(model, schedule_of(row_at(1.5, gains)), 1.5), flown.time)
    assert np.max(np.abs(flown.angle[:, 0] - 0.3 * theirs.outputs)) < 1e-3


def test_a_schedule_gives_its_rows_by_speed_and_what_lies_between():
    schedule = schedule_of(row_at(1.0, Gains(-1.0)), row_at(2.0, Gains(-0.4)))
    assert list(schedule.to_control()) == [1.0, 2.0]
    assert pytest.approx(np.array([[-0.7, 0.7, 0.0]])) == schedule.to_control(1.5).D


def test_a_pitch_loop_has_pitch_names_and_the_reference_gain():
    rows = (Row(1.0, Gains(0.5, 0.0, 0.2), 0.0, 0.3, 0.26),)
    system = Schedule(Axis.PITCH, "pd", 0.7, 45.0, depth=False, rows=rows, actuator={}).to_control(1.0)
    assert system.input_labels == ["pitch_goal_rad", "pitch_rad", "pitch_rate_rad_s"]
    assert system.output_labels == ["elevator_rad"]
    assert pytest.approx(np.array([[0.8, -0.5, -0.2]])) == system.D


def test_what_is_no_linear_system_says_so():
    from fieldsid.display import InControl, View, view_of

    assert InControl.to_control.__doc__
    view: View = view_of(Row)
    with pytest.raises(UsageError, match="linear systems"):
        view.system(row_at(1.0, Gains(-1.0)), None)
