"""Outputs are outputs: what the hull's own motion makes is measured, and never drives the motion that made it.

Angle, rate, sway and heave are outputs of a model; surge and depth, as far as they are inputs, act through their own channel.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fieldsid.dynamics.free_run import simulate
from fieldsid.effects import all_effects
from fieldsid.effects._user_file import effect_of
from fieldsid.logs.run import Run
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.effect import Effect, with_variant
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import ROLES, Record, record_of
from fieldsid.models.speed_law import SpeedLaw

SAMPLES = 400
BASE = {Axis.YAW: {"a22": 1.2, "b2": -1.5, "C0": 0.01}, Axis.PITCH: {"c22": 1.8, "c23": 0.4, "d2": 1.2, "Cb": -0.02}}
OWN = effect_of(
    {
        "name": "own",
        "moment": "k * r * abs(r) * u * phi * z * thrust * sin(angle)",
        "coefficients": {"k": {"unit": "1", "low": -1.0, "high": 1.0, "start": 0.01}},
    },
    origin="test",
)
OUTPUTS = ("angle", "rate", "cross")
FORMS = [
    (form, axis)
    for effect in (*all_effects().values(), OWN)
    for form in (effect, *(with_variant(effect, v) for v in effect.variants))
    for axis in form.axes
]


@cache
def run_of(axis: Axis) -> Run:
    """A log with every column that a record takes, none of them without noise."""
    rng, time, names = np.random.default_rng(5), 0.05 * np.arange(SAMPLES), NAMES[axis]
    fin = np.repeat(rng.uniform(-0.25, 0.25, SAMPLES // 20), 20)
    rate = np.convolve(fin, np.exp(-time[:80]), "full")[:SAMPLES] * -0.05
    shapes = {
        names.fin: fin, names.rate: rate, names.angle: 0.05 * np.cumsum(rate), names.cross: -0.4 * rate,
        "surge_m_s": 1.5 - 0.3 * rate**2, "depth_m": 3.0 + 0.2 * np.sin(time), "roll_rad": 0.1 * rate,
        "thrust": 50.0 + 5.0 * np.sin(0.5 * time),
    }  # fmt: skip
    noisy = {n: v if n == names.fin else v + 0.002 * rng.standard_normal(SAMPLES) for n, v in shapes.items()}
    return Run("log", time, noisy)


def with_noise(run: Run, column: str, seed: int = 8) -> Run:
    noise = 0.01 * np.random.default_rng(seed).standard_normal(SAMPLES)
    return replace(run, signals={**run.signals, column: run.signals[column] + noise})


@cache
def recorded(axis: Axis, noisy: str | None = None) -> Record:
    """The record of the log, of which one channel may have more noise."""
    return record_of(with_noise(run_of(axis), column_of(noisy, axis)) if noisy else run_of(axis), axis)


def column_of(channel: str, axis: Axis) -> str:
    return ROLES[channel] if channel in ROLES else getattr(NAMES[axis], channel)


def motion(effect: Effect, axis: Axis, record: Record) -> np.ndarray:
    """The free run of a fixed model from a fixed state along a record, angle, rate, cross state and fin (4, n)."""
    values = BASE[axis] | effect.starts()
    model = Model(axis, (effect.name,), values, {}, tuple(values), np.zeros((len(values),) * 2), SpeedLaw(1.5), Noise(0.01, 0.01))
    path = simulate(model, record, state=(0.1, -0.05, 0.02), effects=(effect,))
    return np.array([path.angle, path.rate, path.cross, path.fin])


@pytest.mark.parametrize(("effect", "axis"), FORMS, ids=lambda v: v if isinstance(v, Axis) else f"{v.name}:{len(v.coefficients)}")
def test_noise_on_a_measured_output_leaves_every_free_run(effect, axis):
    plain = motion(effect, axis, recorded(axis))
    assert np.isfinite(plain).all()
    for channel in OUTPUTS:
        np.testing.assert_array_equal(motion(effect, axis, recorded(axis, channel)), plain)


@pytest.mark.parametrize("channel", ["surge", "depth"])
@pytest.mark.parametrize(("effect", "axis"), FORMS, ids=lambda v: v if isinstance(v, Axis) else f"{v.name}:{len(v.coefficients)}")
def test_what_is_an_input_acts_through_its_own_channel_alone(effect, axis, channel):
    """At the same speed of the run, which is a number of the whole of it."""
    record = recorded(axis)
    noisy = recorded(axis, channel).at_speed(record.speed)
    is_same = np.array_equal(motion(effect, axis, noisy), motion(effect, axis, record))
    assert is_same or channel in effect.needs


@pytest.mark.parametrize("axis", Axis)
def test_no_input_knows_an_output(axis):
    plain = recorded(axis)
    assert set(plain.signals) == set(ROLES)
    assert plain.cross_ok.all()
    for channel in OUTPUTS:
        noisy = recorded(axis, channel)
        assert not np.array_equal(getattr(noisy, channel), getattr(plain, channel))
        assert noisy.speed == plain.speed
        for role, signal in plain.signals.items():
            np.testing.assert_array_equal(noisy.signals[role], signal, err_msg=f"{role} of {channel}")
        for other in set(OUTPUTS) - {channel}:
            np.testing.assert_array_equal(getattr(noisy, other), getattr(plain, other), err_msg=f"{other} of {channel}")


@pytest.mark.parametrize("axis", Axis)
@pytest.mark.parametrize("channel", ["surge", "roll", "depth"])
def test_an_input_is_in_no_other_input(axis, channel):
    plain, noisy = recorded(axis), recorded(axis, channel)
    assert {role for role in ROLES if not np.array_equal(plain.signals[role], noisy.signals[role])} == {channel}
