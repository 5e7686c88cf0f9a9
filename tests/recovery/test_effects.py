"""Every effect of the catalogue, injected by the truth's own second implementation, comes back by its coefficients.

No noise: what is left is the difference between two ways to write the same physics.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from truth import maneuvers
from truth.logbook import flown
from truth.noise import Clock
from truth.physics import Physics

from fieldsid.dynamics.free_run import simulate
from fieldsid.effects import all_effects
from fieldsid.fitting.fit import fit
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of

CLOCK = Clock(0.05, 1000)
BASE = {
    Axis.YAW: Physics(damping=1.1, authority=-0.9, fin_bend=-0.01, kp=0.9, kd=0.5),
    Axis.PITCH: Physics(damping=1.8, stiffness=0.4, authority=1.2, trim=-0.02, kp=0.9, kd=0.5),
}


@dataclass(frozen=True)
class Hidden:
    """An effect, what the truth is told, what the fit must say, the maneuver, and how near it must come."""

    name: str
    physics: dict[str, float]
    expected: dict[str, float]
    maneuver: str = "pulses"
    axis: Axis = Axis.YAW
    near: float = 0.02


CASES = (
    Hidden("delay", {"delay": 0.17}, {"delay": 0.17}),
    Hidden("rate_limit", {"max_rate": 0.6}, {"max_rate": 0.6}),
    Hidden("servo_lag", {"servo_tau": 0.22}, {"lag": 0.22}),
    Hidden("backlash", {"backlash_gap": 0.06}, {"gap": 0.06}, "multisine", near=0.05),
    Hidden("deadband", {"deadband_width": 0.04}, {"width": 0.04}, "multisine", near=0.05),
    Hidden("asymmetric_fin", {"asymmetry": 0.2}, {"asymmetry": 0.2}),
    Hidden("stall", {"stall_angle": 0.15, "stall_slope": 0.2}, {"stall_angle": 0.15, "slope_after": 0.2}, "multisine", near=0.05),
    Hidden("quadratic_damping", {"quadratic": 2.0}, {"quadratic": 2.0}, "zigzag"),
    Hidden("speed_varying", {"speed_varying": 1.0, "surge_loss": 6.0}, {"speed_share": 1.0}, "circle", near=0.1),
    Hidden("trim_drift", {"drift": 0.0015}, {"drift": 0.09}),
    Hidden("step_change", {"step_time": 20.0, "step_loss": 0.3, "step_moment": 0.03}, {"loss": 0.3, "moment_step": 0.03}),
    Hidden("wave", {"wave_amplitude": 0.05, "wave_period": 6.3, "wave_phase": 0.6}, {"amplitude": 0.05, "period": 6.3}),
    Hidden("sway_coupling", {"cross_damping": 0.7, "cross_rate": 0.9, "cross_moment": -0.5},
           {"cross_damping": 0.7, "cross_rate": 0.45}, "multisine", near=0.05),
    Hidden("current", {"current_sin": 0.03, "current_cos": -0.02},
           {"current_sin": 0.03, "current_cos": -0.02}, "circle", near=0.05),
    Hidden("compass_deviation", {"compass_sin": 0.05, "compass_cos": 0.08},
           {"deviation_sin": 0.05, "deviation_cos": 0.08}, "circle"),
    Hidden("gyro_bias", {"gyro_bias": 0.02}, {"bias": 0.02}),
    Hidden("gyro_scale", {"gyro_scale": 0.15}, {"scale_error": 0.15}),
    Hidden("clock_offset", {"clock_offset": -0.2}, {"offset": 0.2}, near=0.03),
    Hidden("quadratic_damping", {"quadratic": 2.0}, {"quadratic": 2.0}, "stairs", Axis.PITCH),
    Hidden("servo_lag", {"servo_tau": 0.22}, {"lag": 0.22}, axis=Axis.PITCH),
    Hidden("heave_coupling", {"cross_damping": 0.7, "cross_rate": 0.9, "cross_moment": -0.5},
           {"cross_damping": 0.7, "cross_rate": 0.45}, "multisine", Axis.PITCH, 0.05),
    Hidden("large_angle_righting", {"righting": 1.0}, {"righting_sin": 0.4, "righting_cos": -0.02}, "stairs", Axis.PITCH, 0.1),
    Hidden("depth_buoyancy", {"depth_moment": 0.01}, {"depth_moment": 0.01}, "stairs", Axis.PITCH),
)  # fmt: skip


def flight(case: Hidden) -> dict[str, np.ndarray]:
    rng, time = np.random.default_rng(12), CLOCK.time
    plan = {
        "pulses": lambda: maneuvers.pulses(time, 0.26, 0.15, recovery=6.0),
        "multisine": lambda: maneuvers.multisine(time, rng, 0.25),
        "zigzag": lambda: maneuvers.zigzag(time, 0.25, 0.4),
        "circle": lambda: maneuvers.circle(time, 0.25),
        "stairs": lambda: maneuvers.stairs(time, 0.3, length=3.0),
    }[case.maneuver]()
    return flown(BASE[case.axis]._replace(**case.physics), CLOCK, plan, pitching=case.axis is Axis.PITCH)


def record(case: Hidden):
    log = flight(case)
    return record_of(Run(case.name, log.pop("time_s"), log), case.axis)


def cut(log: dict[str, np.ndarray], first: int) -> dict[str, np.ndarray]:
    return {name: values[first:] for name, values in log.items()}


@pytest.mark.parametrize("case", CASES, ids=lambda c: f"{c.name}_{c.axis.value}")
def test_the_coefficients_that_were_put_in_come_back(case):
    log = record(case)
    found = fit([log], case.axis, method="output_error", effects=[case.name])
    plain = fit([log], case.axis, method="output_error")
    for name, value in case.expected.items():
        assert found.model.values[name] == pytest.approx(value, rel=case.near, abs=case.near * 0.02), name
    with_it, without = (np.sqrt(np.mean(f.predictions[0].residual[1] ** 2)) for f in (found, plain))
    assert with_it < 0.2 * without


@pytest.mark.parametrize("case", [c for c in CASES if c.name.endswith("_coupling")], ids=lambda c: c.name)
def test_a_run_that_starts_in_a_turn_shows_the_hidden_state_it_starts_with(case):
    log = flight(case)
    turning = 200 + int(np.argmax(np.abs(log[f"{case.axis.value}_rate_rad_s"][200:600])))
    whole, late = (record_of(Run(case.name, c.pop("time_s"), c), case.axis) for c in (dict(log), cut(log, turning)))
    first, found = (fit([r], case.axis, method="output_error", effects=[case.name]) for r in (whole, late))
    for name, value in case.expected.items():
        assert found.model.values[name] == pytest.approx(value, rel=case.near), name
    hidden = simulate(first.model, whole, state=first.predictions[0].state).cross
    assert abs(hidden[turning]) > 0.3 * np.abs(hidden).max()
    assert found.predictions[0].state[2] == pytest.approx(hidden[turning], rel=0.05)


def test_every_effect_that_needs_no_helper_signal_is_in_the_list():
    helped = {"crossflow_drag", "prop_moment", "roll_coupling", "speed_moment"}
    assert {c.name for c in CASES} >= set(all_effects()) - helped
