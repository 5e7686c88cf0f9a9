"""Every effect of the catalogue, injected by the truth's own second implementation, comes back by its coefficients.

No noise: what is left is the difference between two ways to write the same physics.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from truth import maneuvers
from truth.logbook import flown
from truth.noise import Clock
from truth.physics import HIDDEN_EFFECTS, HiddenEffect, Physics

import fieldsid as fs
from fieldsid.dynamics.free_run import simulate
from fieldsid.effects import all_effects, pick_effect
from fieldsid.fitting.fit import fit
from fieldsid.fitting.initial.effect_screen import carry_parameters
from fieldsid.fitting.optimise.levenberg_marquardt import levenberg_marquardt
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.effect import with_variant
from fieldsid.models.model import Noise
from fieldsid.models.record import record_of

CLOCK = Clock(0.05, 1000)
BASE = {
    Axis.YAW: Physics(damping=1.1, authority=-0.9, fin_bend=-0.01, kp=0.9, kd=0.5),
    Axis.PITCH: Physics(damping=1.8, stiffness=0.4, authority=1.2, trim=-0.02, kp=0.9, kd=0.5),
}


CASES = tuple(replace(case, axis=Axis(case.axis)) for case in HIDDEN_EFFECTS)


def flight(case: HiddenEffect) -> dict[str, np.ndarray]:
    rng, time = np.random.default_rng(12), CLOCK.time
    plan = {
        "pulses": lambda: maneuvers.pulses(time, 0.26, 0.15, recovery=6.0),
        "multisine": lambda: maneuvers.multisine(time, rng, 0.25),
        "zigzag": lambda: maneuvers.zigzag(time, 0.25, 0.4),
        "circle": lambda: maneuvers.circle(time, 0.25),
        "stairs": lambda: maneuvers.stairs(time, 0.3, length=3.0),
    }[case.maneuver]()
    return flown(BASE[case.axis]._replace(**case.physics), CLOCK, plan, pitching=case.axis is Axis.PITCH)


def record(case: HiddenEffect):
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
    # in the channel that shows it: without noise a compass error leaves a rate that the plain model follows exactly
    with_it, without = (np.sqrt(np.mean(f.predictions[0].residual ** 2, axis=1)).max() for f in (found, plain))
    assert with_it < 0.2 * without


def test_a_run_that_starts_at_one_end_of_the_play_shows_the_whole_gap():
    (case,) = (c for c in CASES if c.name == "backlash")
    log = flight(case)
    moved = 200 + int(np.argmax(np.abs(np.diff(log["rudder_rad"][200:600]))))
    late = cut(log, moved + 2)  # the fin hangs half a gap behind the command, on the side it came from
    found = fit(
        [record_of(Run(case.name, late.pop("time_s"), late), case.axis)], case.axis, method="output_error", effects=[case.name]
    )
    assert found.model.values["gap"] == pytest.approx(case.expected["gap"], rel=0.02)
    assert np.sqrt(np.mean(found.predictions[0].residual ** 2, axis=1)).max() < 5e-5


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


def test_the_drag_of_the_cross_flow_comes_back_beside_the_moment_of_the_same_sway():
    own = {"cross_damping": 0.7, "cross_rate": 0.9, "cross_moment": -0.5, "crossflow": 6.0, "length": 1.8}
    log = record(HiddenEffect("both", own, {}, "multisine", Axis.YAW))
    values = fit([log], Axis.YAW, method="output_error", effects=["crossflow_drag", "sway_coupling"]).model.values
    expected = {"cross_damping": 0.7, "cross_rate": 0.45, "crossflow": 6.0, "flow_share": 1.0 / (0.5 * 1.8)}
    assert {n: values[n] for n in expected} == pytest.approx(expected, rel=0.05)
    assert "flow_damping" not in values


HELD_BY_STRIPS = {
    "damping": 1.0, "authority": -1.45, "fin_bend": -0.005, "cross_damping": 0.12, "cross_rate": 1.0, "cross_fin": 0.2,
    "cross_strips": 3.1, "crossflow": 4.4, "length": 1.6,
}  # fmt: skip
"""A torpedo of 1.6 m at 1.9 m/s whose sway is in no moment but that of the cross flow along it."""


def noisy(
    physics: Physics,
    plan: maneuvers.Maneuver,
    rng: np.random.Generator,
    name: str,
    columns: tuple[str, ...],
    clock: Clock = CLOCK,
    angle: float = 0.0,
) -> Run:
    """A run of a plan with the noise of a compass of 0.005 rad and a gyro of 0.003 rad/s."""
    log = flown(physics, clock, plan, angle=angle)
    log["yaw_rad"] = log["yaw_rad"] + 0.005 * rng.standard_normal(clock.time.size)
    log["yaw_rate_rad_s"] = log["yaw_rate_rad_s"] + 0.003 * rng.standard_normal(clock.time.size)
    return Run(name, log["time_s"], {c: log[c] for c in ("yaw_rad", "yaw_rate_rad_s", "rudder_rad", *columns)})


def strips_of(runs: Sequence[Run]) -> dict[str, float]:
    """The numbers of `sway_coupling` whose drag is that of the cross flow along the hull, fitted from its own starts."""
    records, sway = tuple(record_of(r, Axis.YAW) for r in runs), pick_effect("sway_coupling")
    strips = next(v for v in sway.variants if v.coefficients[0].name == "strip_drag")
    problem = Problem(records, layout_of(records, Axis.YAW, (with_variant(sway, strips),)))
    base = fit(list(records), Axis.YAW, method="output_error").model.values
    starts = [carry_parameters(problem.layout, otherwise=base | values) for values in strips.initial_guesses(records, [])]
    best = min((levenberg_marquardt(problem, x, Noise(0.005, 0.003)) for x in starts), key=lambda found: found.cost)
    return dict(zip(problem.layout.names, best.x.tolist(), strict=False))


@pytest.mark.slow
def test_a_hull_that_only_the_cross_flow_holds_is_told_by_it_and_its_strips_come_back():
    """No sway is measured. What turns the path into drift, the drag and the inertia's share are those that were put in.

    Either effect with a cross flow holds such a hull. To port or to starboard: the drift has no other moment than one that is
    the same for both.
    """
    rng, time = np.random.default_rng(3), CLOCK.time
    plans = (
        maneuvers.multisine(time, rng, 0.2),
        maneuvers.stairs(time, 0.2, length=3.0),
        maneuvers.pulses(time, 0.2, 0.12, recovery=4.0),
        maneuvers.multisine(time, rng, 0.15),
    )
    runs = [noisy(Physics(**HELD_BY_STRIPS), plan, rng, f"r{i}", ()) for i, plan in enumerate(plans)]
    found = fs.diagnose(runs[:3], "yaw", validate=runs[3:])
    assert (found.verdict, found.effects) in [("effect", ("sway_coupling",)), ("effect", ("crossflow_drag",))]
    assert found.final.validation.angle_rms_rad < 1.15 * 0.005
    assert found.final.validation.rate_rms_rad_s < 1.15 * 0.003
    assert found.base.validation.angle_rms_rad > 3.0 * found.final.validation.angle_rms_rad
    values = strips_of(runs)
    assert values["strip_drag"] == pytest.approx(4.4, rel=0.1)
    assert values["strip_inertia"] == pytest.approx(3.1 * 1.6 / (32.0 * 4.4), rel=0.2)
    assert abs(values["cross_rate"]) == pytest.approx(1.0 / 1.6, rel=0.15)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "path"),
    [("backlash", {"servo_tau": 0.15, "backlash_gap": 0.03}), ("deadband", {"servo_tau": 0.2, "deadband_width": 0.03})],
)
def test_behind_a_slow_and_worn_fin_such_a_hull_is_found_and_the_wear_too(name, path):
    """The drift by its strips shows beside the servo only, and the wear beside both: a lag alone takes up a part of each."""
    clock, rng = Clock(0.1, 500), np.random.default_rng(3)
    plans = (
        maneuvers.pulses(clock.time, 0.2, 0.12, recovery=3.0),
        maneuvers.stairs(clock.time, 0.2, length=2.0),
        maneuvers.pulses(clock.time, 0.17, 0.1, recovery=2.5),
        maneuvers.stairs(clock.time, 0.17, length=2.5),
    )
    physics = Physics(**HELD_BY_STRIPS, **path)
    runs = [noisy(physics, plan, rng, f"r{i}", (), clock) for i, plan in enumerate(plans)]
    found = fs.diagnose(runs[:3], "yaw", validate=runs[3:])
    assert found.verdict == "effect"
    assert set(found.effects) - {"sway_coupling", "crossflow_drag"} == {"servo_lag", name}
    assert len(found.effects) == 3
    assert found.final.validation.angle_rms_rad < 1.15 * 0.005
    assert found.base.validation.angle_rms_rad > 5.0 * 0.005


CROSS_FLOW = {"damping": 0.9, "authority": -1.4, "fin_bend": -0.01, "crossflow": 6.0, "length": 1.8}


@pytest.mark.slow
@pytest.mark.parametrize("drift", [0.5, -0.5], ids=["outwards", "inwards"])
def test_drag_of_a_cross_flow_is_told_beside_a_sway_sensor_whose_noise_is_half_of_what_it_measures(drift):
    """The sensor shows the drift's law, from which the fit starts; its noise is in no moment."""
    rng, time = np.random.default_rng(9), CLOCK.time
    physics = Physics(**CROSS_FLOW, cross_damping=1.1, cross_rate=drift * 1.8 * 1.1)
    plans = (
        maneuvers.multisine(time, rng, 0.25),
        maneuvers.stairs(time, 0.3, length=4.0),
        maneuvers.pulses(time, 0.3, 0.15, recovery=4.0),
        maneuvers.multisine(time, rng, 0.2),
    )
    runs = []
    for i, plan in enumerate(plans):
        run = noisy(physics, plan, rng, f"r{i}", ("sway_m_s",))
        sway = run.signals["sway_m_s"]
        runs.append(replace(run, signals={**run.signals, "sway_m_s": sway + 0.5 * np.std(sway) * rng.standard_normal(time.size)}))
    found = fs.diagnose(runs[:3], "yaw", validate=runs[3:])
    assert (found.verdict, found.effects) == ("effect", ("crossflow_drag",))
    assert found.final.validation.rate_rms_rad_s < 1.15 * 0.003
    values = found.candidates[0].parameters
    assert values["crossflow"] == pytest.approx(6.0, rel=0.05)
    assert values["flow_damping"] == pytest.approx(1.1, rel=0.15)
    # the drift to the other side is the same motion
    assert abs(values["flow_rate"]) == pytest.approx(abs(drift) * 1.1, rel=0.15)
    assert values["flow_fin"] == pytest.approx(0.0, abs=0.15)


@pytest.mark.slow
def test_damping_that_does_not_grow_with_the_speed_is_told_from_that_of_lift():
    rng, time = np.random.default_rng(6), CLOCK.time
    physics = Physics(damping=1.1, authority=-0.9, fin_bend=-0.01, speed_varying=1.0, damping_power=0.0, surge_loss=8.0)
    plans = (
        maneuvers.circle(time, 0.25),
        maneuvers.stairs(time, 0.25, length=6.0),
        maneuvers.circle(time, -0.2),
        maneuvers.stairs(time, 0.2, length=5.0),
    )
    runs = [noisy(physics, plan, rng, f"r{i}", ("surge_m_s",)) for i, plan in enumerate(plans)]
    found = fs.diagnose(runs[:3], "yaw", validate=runs[3:])
    assert (found.verdict, found.effects) == ("effect", ("speed_varying",))
    assert found.final.validation.angle_rms_rad < 1.15 * 0.005
    values = found.candidates[0].parameters
    assert values["speed_share"] == pytest.approx(1.0, abs=0.1)
    assert values["damping_share"] == pytest.approx(0.0, abs=0.25)


@pytest.mark.slow
def test_a_current_is_told_by_a_log_whose_speed_is_over_ground():
    """Through the water the hull is as fast on every heading; the fin's authority goes with that, and not with what is logged."""
    rng, time, north, east = np.random.default_rng(4), CLOCK.time, 0.3, -0.2
    runs = []
    for i, (ratio, heading) in enumerate(zip((0.7, 1.0, 1.4, 1.2, 0.85), (0.4, 2.6, 4.4, 1.2, 5.5), strict=True)):
        plan = maneuvers.pulses(time, 0.26, 0.15, recovery=4.0) if i % 2 else maneuvers.stairs(time, 0.25, length=6.0)
        physics = Physics(damping=1.1 * ratio, authority=-0.9 * ratio**2, nominal_speed=1.5 * ratio)
        run = noisy(physics, plan, rng, f"r{i}", ("surge_m_s",), angle=heading)
        past, yaw = run.signals["surge_m_s"], run.signals["yaw_rad"]
        over_ground = past + north * np.cos(yaw) + east * np.sin(yaw) + 0.02 * rng.standard_normal(time.size)
        runs.append(replace(run, signals={**run.signals, "surge_m_s": over_ground}))
    found = fs.diagnose(runs[:3], "yaw", validate=runs[3:])
    assert (found.verdict, found.effects) == ("effect", ("current",))
    assert found.final.validation.angle_rms_rad < 1.15 * 0.005 < 0.5 * found.base.validation.angle_rms_rad
    values = found.candidates[0].parameters
    assert values["current_north"] == pytest.approx(north, abs=0.03)
    assert values["current_east"] == pytest.approx(east, abs=0.03)


def test_a_fin_that_wanders_is_told_from_a_weight_that_does_by_runs_at_several_speeds():
    rng, time = np.random.default_rng(4), CLOCK.time
    runs = []
    for i, ratio in enumerate((0.7, 1.0, 1.4, 1.2)):
        plan = maneuvers.pulses(time, 0.26, 0.15, recovery=4.0) if i % 2 else maneuvers.stairs(time, 0.25, length=3.0)
        physics = Physics(damping=1.1 * ratio, authority=-0.9 * ratio**2, drift=0.0012 * ratio**2, nominal_speed=1.5 * ratio)
        runs.append(noisy(physics, plan, rng, f"r{i}", ("surge_m_s",)))
    found = fs.diagnose(runs[:3], "yaw", validate=runs[3:])
    assert (found.verdict, found.effects) == ("effect", ("trim_drift",))
    assert found.final.validation.angle_rms_rad < 1.15 * 0.005
    values = found.candidates[0].parameters
    assert values["drift_power"] == pytest.approx(2.0, abs=0.1)
    assert values["drift"] == pytest.approx(60.0 * 0.0012 / 1.5**2, rel=0.1)


def test_every_effect_that_needs_no_helper_signal_is_in_the_list():
    helped = {"prop_moment", "roll_coupling", "speed_moment"}
    assert {c.name for c in CASES} >= set(all_effects()) - helped
