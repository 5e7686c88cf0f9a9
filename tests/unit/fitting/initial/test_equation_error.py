"""Where a fit starts: the base parameters, and a cross state, without a simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fieldsid.dynamics.free_run import command_record, simulate
from fieldsid.effects import pick_effect
from fieldsid.fitting.initial.equation_error import equation_error_starts
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.model import Model, Noise
from fieldsid.models.speed_law import SpeedLaw

HULLS = (
    (Axis.PITCH, "heave_coupling", {"c22": 1.8, "c23": 1.2, "d2": 0.6, "Cb": -0.01, "cross_damping": 2.3, "cross_rate": -4.1}),
    (Axis.YAW, "sway_coupling", {"a22": 1.2, "b2": -0.7, "C0": 0.01, "cross_damping": 0.5, "cross_rate": 0.3}),
    (Axis.YAW, "sway_coupling", {"a22": 0.2, "b2": -1.7, "C0": 0.0, "cross_damping": 0.2, "cross_rate": 1.0}),
)


def flown(axis, effect, values, speed, seed, noise):
    """A run of 60 s under pulses of a hull whose law is that of 1.2 m/s."""
    rng, time = np.random.default_rng(seed), np.arange(0.0, 60.0, 0.05)
    fin = 0.15 * np.repeat(rng.choice([-1.0, 0.0, 1.0], 40), 30)
    model = Model(axis, (effect,), values, {}, (), np.zeros((0, 0)), SpeedLaw(1.2), Noise(noise, noise))
    record = command_record(axis, time, fin, speed=speed, name=f"run{seed}")
    motion = simulate(model, record)
    angle, rate = (v + noise * rng.standard_normal(time.size) for v in (motion.angle, motion.rate))
    ok = np.ones(time.size, bool)
    return replace(record, angle=angle, rate=rate, angle_ok=ok, rate_ok=ok)


@pytest.mark.parametrize(("axis", "effect", "values"), HULLS)
def test_a_start_with_a_cross_state_is_near_the_hull_that_has_it(axis, effect, values):
    records = tuple(flown(axis, effect, values, speed, seed, 1e-3) for seed, speed in enumerate((0.9, 1.2, 1.6), 1))
    layout = layout_of(records, axis, (pick_effect(effect),))
    start = dict(zip(layout.names, equation_error_starts(records, layout)[-1], strict=False))
    for name in ("cross_damping", "cross_rate", NAMES[axis].damping, NAMES[axis].authority):
        assert start[name] == pytest.approx(values[name], rel=0.5), name


def test_what_a_cross_state_starts_from_is_what_a_steady_turn_has_built_up():
    axis, effect, values = HULLS[1]
    whole = flown(axis, effect, values, 1.2, 5, 1e-4)
    cut = slice(400, None)
    late = replace(
        whole, time=whole.time[cut], fin=whole.fin[cut], angle=whole.angle[cut], rate=whole.rate[cut],
        angle_ok=whole.angle_ok[cut], rate_ok=whole.rate_ok[cut],
    )  # fmt: skip
    layout = layout_of((late,), axis, (pick_effect(effect),))
    start = dict(zip(layout.names, equation_error_starts((late,), layout)[-1], strict=False))
    assert start["cross_damping"] == pytest.approx(values["cross_damping"], rel=0.5)
    assert start["cross_rate"] == pytest.approx(values["cross_rate"], rel=0.5)


def test_the_stiffness_of_a_log_without_an_angle_is_that_of_the_integrated_rate():
    values = {"c22": 1.0, "c23": 0.5, "d2": -1.3, "Cb": -0.02}
    axis, effect, _ = HULLS[0]
    whole = flown(axis, effect, values | {"cross_damping": 2.0, "cross_rate": 0.0}, 1.2, 3, 1e-3)
    rate_only = replace(whole, angle=np.full(whole.time.size, np.nan), angle_ok=np.zeros(whole.time.size, bool))
    layout = layout_of((rate_only,), axis, ())
    start = dict(zip(layout.names, equation_error_starts((rate_only,), layout)[0], strict=False))
    for name in ("c22", "c23", "d2"):
        assert start[name] == pytest.approx(values[name], rel=0.1), name
