"""Which effects, and which of their forms, a log can show at all."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest

from fieldsid.diagnosis.data.applicable_effects import applicable_effects
from fieldsid.diagnosis.data.holdout_split import holdout_split
from fieldsid.dynamics.free_run import command_record
from fieldsid.effects import pick_effect
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of

PROP = pick_effect("prop_moment")


def run(axis: Axis, *roles: str):
    time = np.arange(0.0, 10.0, 0.1)
    signals = {role: np.ones(time.size) for role in roles}
    made = command_record(axis, time, np.zeros(time.size), speed=1.5, signals=signals)
    object.__setattr__(made, "signals", MappingProxyType(signals))
    return made


def test_an_effect_without_its_signal_is_left_out_with_the_reason():
    kept, skipped = applicable_effects([PROP], [run(Axis.YAW, "thrust"), run(Axis.YAW)])
    assert kept == ()
    assert skipped == {"prop_moment": "needs thrust, which the log lacks"}


@pytest.mark.parametrize(
    ("speed", "why"),
    [
        (128.4, "surge_m_s is 128 m/s in the middle, above the 50 m/s of any vehicle in water"),
        (50.01, "surge_m_s is 50.01 m/s in the middle, above the 50 m/s of any vehicle in water"),
        (-1.4, "surge_m_s is -1.40 m/s in the middle, below the 0.05 m/s of one under way"),
    ],
)
def test_of_a_speed_that_the_log_has_it_is_said_why_it_is_not_taken(speed, why):
    time = np.arange(0.0, 10.0, 0.1)
    rudder, yaw = 0.1 * np.sign(np.sin(time)), np.cumsum(0.01 * np.sin(time))
    flown = Run("flight", time, {"yaw_rad": yaw, "rudder_rad": rudder, "surge_m_s": np.full(time.size, speed)})
    _, skipped = applicable_effects([pick_effect("speed_varying")], [record_of(flown, Axis.YAW)])
    assert skipped == {"speed_varying": f"needs surge, and {why}"}


@pytest.mark.parametrize(
    ("axis", "roles", "more"),
    [
        (Axis.YAW, ("thrust", "surge"), {"build_up", "prop_trimmed"}),
        (Axis.YAW, ("thrust",), {"build_up"}),
        (Axis.PITCH, ("thrust", "surge"), set()),
    ],
)
def test_a_form_is_tried_on_its_own_axes_and_with_its_own_signals_alone(axis, roles, more):
    (kept,), _ = applicable_effects([PROP], [run(axis, *roles)])
    tried = {c.name for form in kept.variants for c in form.coefficients}
    assert tried == {"prop_square"} | more


def test_each_form_has_its_own_numbers():
    assert len({frozenset(c.name for c in f.coefficients) for f in PROP.variants}) == len(PROP.variants)


def test_an_effect_all_of_whose_forms_can_be_tried_is_the_one_declared():
    (kept,), _ = applicable_effects([PROP], [run(Axis.YAW, "thrust", "surge")])
    assert kept is PROP


def test_runs_that_log_their_thrust_in_different_units_do_not_show_one_moment_of_it():
    mixed = [replace(run(Axis.YAW, "thrust"), thrust_column=c) for c in ("thrust", "propeller_rpm")]
    kept, skipped = applicable_effects([PROP], mixed)
    assert kept == ()
    assert skipped == {"prop_moment": "needs one thrust for all runs, and they log it as propeller_rpm and as thrust"}


def test_parts_held_back_of_runs_that_log_another_thrust_cannot_show_its_moment():
    time = np.arange(0.0, 60.0, 0.1)
    rudder = np.where(time % 20.0 < 5.0, 0.1, 0.0)
    signals = {"yaw_rate_rad_s": 0.1 * rudder, "rudder_rad": rudder, "surge_m_s": 1.5 + 0.1 * np.sin(time)}
    runs = [Run(of, time, {**signals, of: 1.0 + 0.1 * np.sin(time)}) for of in ("thrust_ratio", "propeller_rpm")]
    learned, unseen, _ = holdout_split([record_of(run, Axis.YAW) for run in runs])
    assert unseen
    _, skipped = applicable_effects([PROP], [*learned, *unseen])
    assert skipped == {"prop_moment": "needs one thrust for all runs, and they log it as propeller_rpm and as thrust_ratio"}
