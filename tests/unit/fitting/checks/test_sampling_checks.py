"""A log whose samples are further apart than the vehicle's time constant says what it knows, and no more."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.errors import DataError
from fieldsid.fitting.checks.sampling_checks import sampling_findings
from fieldsid.fitting.identify import identify
from fieldsid.fitting.predict.goodness_of_fit import GoodnessOfFit
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import Model, Noise
from fieldsid.models.record import record_of
from fieldsid.models.speed_law import SpeedLaw

FINE_S = 0.05


def glider(damping: float, step: float, *, measured: bool, seed: int = 1, gain: float = -0.25) -> Run:
    """Half an hour of a glider's steering, sampled every `step` s: pulses of 20 to 60 s, by a servo of 0.1 rad/s if measured."""
    random = np.random.default_rng(seed)
    count = round(1800.0 / FINE_S)
    fin, at = np.zeros(count), round(20.0 / FINE_S)
    while at < count:
        length = round(random.uniform(20.0, 60.0) / FINE_S)
        fin[at : at + length] = random.choice([-1.0, 1.0]) * random.uniform(0.1, 0.4)
        at += length + round(random.uniform(0.0, 30.0) / FINE_S)
    angle, left = np.zeros(count), np.exp(-damping * FINE_S)
    rate = 0.0
    for i in range(1, count):
        if measured:
            fin[i] = fin[i - 1] + np.clip(fin[i] - fin[i - 1], -0.1 * FINE_S, 0.1 * FINE_S)
        steady = gain * fin[i - 1]
        angle[i] = angle[i - 1] + steady * FINE_S + (rate - steady) * (1.0 - left) / damping
        rate = steady + (rate - steady) * left
    every = slice(None, None, round(step / FINE_S))
    time = FINE_S * np.arange(count)[every]
    name = "rudder_measured_rad" if measured else "rudder_rad"
    return Run("glider", time, {"yaw_rad": angle[every] + 0.01 * random.standard_normal(time.size), name: fin[every]})


@pytest.mark.parametrize(
    ("damping", "measured", "seed"),
    [(1.0, False, 1), (10.0, False, 1), (45.0, False, 1), (45.0, True, 1), (45.0, True, 3), (45.0, True, 6)],
)
def test_a_time_constant_far_below_the_sampling_is_refused_with_its_gain_and_a_true_bound(damping, measured, seed):
    with pytest.raises(DataError, match=r"4\.5 s apart do not tell a time constant") as refused:
        identify([glider(damping, 4.5, measured=measured, seed=seed)], Axis.YAW)
    gain, bound = (float(refused.value.found.split(s)[1].split()[0]) for s in ("b2/a22 = ", "a22 is above "))
    assert gain == pytest.approx(-0.25, rel=0.1)
    assert 0.0 < bound < damping
    assert "more often than every 4.5 s" in refused.value.hint


@pytest.mark.parametrize("damping", [0.2, 1.0])
def test_a_measured_fin_that_travels_shows_a_time_constant_below_the_sampling(damping):
    found = identify([glider(damping, 4.5, measured=True)], Axis.YAW)[0]
    assert found.model.values["a22"] == pytest.approx(damping, rel=0.15)
    assert "coarse_sampling" not in {n.code for n in found.notes}


def test_a_command_between_coarse_samples_leaves_a_range_that_holds_the_truth():
    found = identify([glider(0.2, 4.5, measured=False, seed=2)], Axis.YAW)[0]
    note = next(n for n in found.notes if n.code == "coarse_sampling")
    assert note.data["low"] < 0.2 < note.data["value"]
    assert "4.5 s" in note.message


def test_the_same_vehicle_sampled_as_usual_is_identified_without_a_word():
    found = identify([glider(1.0, 0.25, measured=False)], Axis.YAW)[0]
    assert found.model.values["a22"] == pytest.approx(1.0, rel=0.2)
    assert "coarse_sampling" not in {n.code for n in found.notes}


def test_a_pulse_between_two_samples_is_refused_for_the_samples_that_there_are():
    time = 30.0 * np.arange(200)
    run = Run("sparse", time, {"yaw_rad": 0.01 * time, "rudder_rad": np.where(np.arange(200) == 90, 0.3, 0.0)})
    with pytest.raises(DataError, match="too short to identify yaw") as refused:
        identify([run], Axis.YAW)
    assert "3 measured samples in 60 s" in refused.value.found
    assert "sampled more often" in refused.value.hint


@pytest.mark.parametrize(("effects", "asked"), [((), True), (("servo_lag",), False), (("sway_coupling",), False)])
def test_a_model_with_slower_poles_than_the_hulls_is_not_asked(effects, asked):
    """A lag of 0.4 s or a hidden state is seen in samples 0.05 s apart, whatever the hull's own pole."""
    time = FINE_S * np.arange(400)
    run = Run("hull", time, {"yaw_rad": 0.1 * time, "yaw_rate_rad_s": 0.0 * time, "rudder_rad": 0.1 * np.sign(np.sin(time))})
    own = {"servo_lag": {"lag": 0.4}, "sway_coupling": {"cross_damping": 0.8, "cross_rate": 0.1}}
    values = {"a22": 40.0, "b2": -10.0, "C0": 0.0} | {k: v for e in effects for k, v in own[e].items()}
    model = Model(Axis.YAW, effects, values, {}, ("a22",), np.array([[400.0]]), SpeedLaw(1.4), Noise(0.005, 0.005))
    records = [record_of(run, Axis.YAW)]
    good = GoodnessOfFit(0.005, 0.006, 97.0, 94.0)
    if asked:
        with pytest.raises(DataError, match="too coarse"):
            sampling_findings(model, records, good, model.noise)
    else:
        assert sampling_findings(model, records, good, model.noise) == ()


def test_no_sampling_is_blamed_where_the_clock_of_the_fin_is_off():
    """The rate shows each pulse 0.15 s before the fin does: no damping explains it, and that at its bound is not the hull's."""
    time = FINE_S * np.arange(1200)
    fin = 0.2 * np.sign(np.sin(2.0 * np.pi * time / 6.0)) * (time > 3.0)
    rate = np.zeros(time.size)
    for i in range(1, time.size):
        rate[i] = rate[i - 1] + FINE_S * (-1.1 * rate[i - 1] - 1.2 * fin[i - 1])
    random, late = np.random.default_rng(3), np.roll(fin, 3)
    signals = {"yaw_rad": np.cumsum(rate) * FINE_S, "yaw_rate_rad_s": rate, "rudder_rad": late}
    noisy = {n: v + (0.0 if n == "rudder_rad" else 0.003) * random.standard_normal(time.size) for n, v in signals.items()}
    (found,) = identify([Run("early", time, noisy)], Axis.YAW)
    assert not {"coarse_sampling"} & {n.code for n in found.notes}
