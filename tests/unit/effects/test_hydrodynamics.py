"""Hydrodynamic and sensor effects against values worked by hand."""

from __future__ import annotations

import math
from types import MappingProxyType

import numpy as np
import pytest

from fieldsid.effects import pick_effect
from fieldsid.errors import EffectError
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Motion
from fieldsid.models.record import Record


def record(time, *, axis: Axis = Axis.YAW, speed: float = 2.0, **signals) -> Record:
    time = np.asarray(time, float)
    none, ok = np.zeros(time.size), np.ones(time.size, bool)
    helpers = MappingProxyType({k: np.asarray(v, float) for k, v in signals.items()})
    return Record("made", axis, time, none, True, False, none, none, ok, ok, none, ~ok, helpers, speed)


def terms(name: str, log: Record, **values: float):
    return pick_effect(name).terms(values, log)


def test_half_the_speed_is_a_quarter_of_the_authority_and_half_the_damping():
    found = terms("speed_varying", record([0.0, 1.0], surge=[2.0, 1.0]), speed_share=1.0)
    np.testing.assert_allclose(found.authority_factor, [1.0, 0.25])
    np.testing.assert_allclose(found.damping_factor, [1.0, 0.5])


def test_a_run_without_forward_speed_is_named():
    with pytest.raises(EffectError, match="no forward speed"):
        terms("speed_varying", record([0.0, 1.0], speed=-0.1, surge=[-0.1, -0.1]), speed_share=1.0)


def test_a_missing_signal_is_named():
    with pytest.raises(EffectError, match="no roll signal"):
        terms("roll_coupling", record([0.0, 1.0]), roll_moment=1.0)


def test_the_drift_counts_minutes_from_the_first_sample():
    np.testing.assert_allclose(terms("trim_drift", record([500.0, 530.0, 560.0]), drift=0.2).moment, [0.0, 0.1, 0.2])


def test_an_event_takes_authority_and_adds_a_moment_from_its_time_on():
    found = terms("step_change", record(np.arange(11.0)), event_time=0.55, loss=0.4, moment_step=0.02)
    np.testing.assert_allclose(found.authority_factor, np.where(np.arange(11) >= 6, 0.6, 1.0))
    np.testing.assert_allclose(found.moment, np.where(np.arange(11) >= 6, 0.02, 0.0))


def test_an_event_on_a_sample_is_half_done_there():
    assert terms("step_change", record(np.arange(11.0)), event_time=0.5, loss=1.0, moment_step=0.0).authority_factor[
        5
    ] == pytest.approx(0.5)


def test_a_wave_has_its_period_and_phase_from_the_first_sample():
    found = terms("wave", record([40.0, 41.0, 42.0]), period=4.0, amplitude=0.3, phase=0.5 * math.pi)
    np.testing.assert_allclose(found.moment, [0.3, 0.0, -0.3], atol=1e-15)


@pytest.mark.parametrize(
    ("name", "role", "coefficient", "expected"),
    [
        ("prop_moment", "thrust", "prop_moment", [1.0, -4.0]),
        ("roll_coupling", "roll", "roll_moment", [1.0, -4.0]),
        ("depth_buoyancy", "depth", "depth_moment", [1.0, -4.0]),
        ("speed_moment", "surge", "speed_moment", [2.0, 32.0]),
    ],
)
def test_moments_that_follow_a_signal(name, role, coefficient, expected):
    np.testing.assert_allclose(terms(name, record([0.0, 1.0], **{role: [2.0, -8.0]}), **{coefficient: 0.5}).moment, expected)


def test_the_cross_state_scales_with_speed_as_lift_does():
    for name in ("sway_coupling", "heave_coupling"):
        core = pick_effect(name).core({"cross_damping": 1.0, "cross_rate": 1.0}, 2.0)
        assert (core.cross_damping, core.cross_rate) == (2.0, 4.0)
        own = {"cross_damping": 1.0, "cross_rate": 1.0, "cross_fin": 1.0, "cross_quadratic": 1.0, "damping_exponent": 7.0}
        core = pick_effect(name).core(own | {"cross_exponent": 2.0}, 2.0)
        assert (core.cross_damping, core.cross_rate, core.cross_fin, core.cross_quadratic) == (4.0, 16.0, 64.0, 0.25)


def test_each_core_effect_sets_its_own_terms_only():
    core = pick_effect("quadratic_damping").core({"quadratic": 3.0}, 2.0)
    assert core.quadratic == 3.0
    assert core.strip_moment == core.cross_rate == core.heading_sin == 0.0
    core = pick_effect("current").core({"current_sin": 0.1, "current_cos": 0.2}, 2.0)
    assert (core.heading_sin, core.heading_cos) == (0.1, 0.2)
    core = pick_effect("large_angle_righting").core({"righting_sin": 0.1, "righting_cos": 0.2}, 2.0)
    assert (core.righting_sin, core.righting_cos) == (0.1, 0.2)
    flow = pick_effect("crossflow_drag")
    core = flow.core({"crossflow": 0.1, "flow_damping": 0.5, "flow_rate": 0.3, "flow_fin": 0.2}, 2.0)
    assert (core.strip_moment, core.strip_flow, core.cross_share) == (0.1, 0.5, 0.0)
    assert (core.cross_damping, core.cross_rate, core.cross_fin) == (1.0, 1.2, 1.6)
    core = flow.core({"crossflow": 0.1, "flow_share": 0.7}, 2.0)
    assert (core.strip_moment, core.strip_flow, core.cross_share, core.cross_damping) == (0.1, 0.35, 1.0, 0.0)


def seen(name: str, log: Record, motion: Motion, **values: float) -> Motion:
    return pick_effect(name).measure(motion, values, log)


def test_sensors_that_are_late_show_the_past_and_early_ones_the_future():
    log, ramp = record(np.arange(5.0)), Motion(np.arange(5.0), 2.0 * np.arange(5.0))
    np.testing.assert_allclose(seen("clock_offset", log, ramp, offset=0.5).angle, [0.0, 0.5, 1.5, 2.5, 3.5])
    np.testing.assert_allclose(seen("clock_offset", log, ramp, offset=-0.5).rate, [1.0, 3.0, 5.0, 7.0, 8.0])


def test_a_gyro_errs_in_the_rate_only():
    log, motion = record([0.0, 1.0]), Motion(np.array([0.1, 0.2]), np.array([0.3, -0.4]))
    biased, scaled = seen("gyro_bias", log, motion, bias=0.05), seen("gyro_scale", log, motion, scale_error=0.1)
    np.testing.assert_allclose(biased.rate, [0.35, -0.35])
    np.testing.assert_allclose(scaled.rate, [0.33, -0.44])
    assert biased.angle is scaled.angle is motion.angle


def test_a_compass_errs_by_heading_only():
    motion = Motion(np.array([0.0, 0.5 * math.pi, math.pi]), np.zeros(3))
    found = seen("compass_deviation", record(np.arange(3.0)), motion, deviation_sin=0.1, deviation_cos=0.02)
    np.testing.assert_allclose(found.angle - motion.angle, [0.02, 0.1, -0.02], atol=1e-15)
    assert found.rate is motion.rate
