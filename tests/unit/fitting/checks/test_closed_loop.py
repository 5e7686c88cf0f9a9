"""Which logs are refused as feedback alone: an autopilot's without excitation, never one flown open loop."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.diagnosis.diagnose import diagnose
from fieldsid.errors import DataError
from fieldsid.fitting.checks.closed_loop import closed_loop_note, controller, refuse_feedback_alone
from fieldsid.fitting.identify import identify
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of

STEP, LENGTH = 0.05, 1600
NOISE = 0.003


def flown(seed, *, gains=(0.0, 0.0), delay=2, excitation="none", with_rate=True, counts=0.0) -> Run:
    """A vehicle of first order in yaw under gusts, its fin feedback of the measured angle plus an excitation."""
    random = np.random.default_rng(seed)
    t = STEP * np.arange(LENGTH)
    own = OPEN_LOOP[excitation](t, random)
    angle, rate, fin, seen, turn = (np.zeros(LENGTH) for _ in range(5))
    gust, a, b = 0.0, random.uniform(0.6, 1.5), random.choice([-1.0, 1.0]) * random.uniform(0.6, 2.0)
    for i in range(LENGTH):
        seen[i] = angle[i] + NOISE * random.standard_normal()
        turn[i] = rate[i] + NOISE * random.standard_normal()
        k = max(i - delay, 1)
        slope = turn[k] if with_rate else (seen[k] - seen[k - 1]) / STEP
        fin[i] = own[i] - np.sign(b) * (gains[0] * seen[k] + gains[1] * slope)
        fin[i] = np.round(fin[i] * counts) / counts if counts else fin[i]
        gust += STEP * (-gust) + 0.15 * np.sqrt(STEP) * random.standard_normal()
        if i + 1 < LENGTH:
            rate[i + 1] = rate[i] + STEP * (-a * rate[i] + b * fin[i] + gust)
            angle[i + 1] = angle[i] + STEP * rate[i + 1]
    return Run("flight", t, {"yaw_rad": seen, "rudder_rad": fin} | ({"yaw_rate_rad_s": turn} if with_rate else {}))


def _holds(t, random):
    return np.repeat(random.choice([-0.25, -0.1, 0.0, 0.1, 0.25], t.size // 60 + 1), 60)[: t.size]


def _chirp(t, random):
    return 0.25 * np.sin(2.0 * np.pi * (0.02 + random.uniform(0.0005, 0.003) * t) * t)


def _sine(t, random):
    return 0.2 * np.sin(2.0 * np.pi * random.uniform(0.03, 0.4) * t)


def _multisine(t, random):
    return sum(0.06 * np.sin(2.0 * np.pi * f * t + random.uniform(0.0, 6.0)) for f in (0.03, 0.07, 0.13, 0.24))


OPEN_LOOP = {"none": lambda t, _: 0.0 * t, "holds": _holds, "chirp": _chirp, "sine": _sine, "multisine": _multisine}
PILOTS = {
    "P": {"gains": (1.15, 0.0), "with_rate": False},
    "P, fin in counts": {"gains": (1.15, 0.0), "with_rate": False, "counts": 200.0},
    "PD": {"gains": (1.0, 0.8)},
    "PD on differences": {"gains": (1.0, 0.3), "with_rate": False},
}


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("pilot", PILOTS.values(), ids=PILOTS)
def test_feedback_alone_is_refused(pilot, seed):
    with pytest.raises(DataError, match="does not identify yaw: its fin is feedback"):
        refuse_feedback_alone([record_of(flown(seed, **pilot), Axis.YAW)])


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("pilot", PILOTS.values(), ids=PILOTS)
def test_feedback_with_pulses_on_top_is_not(pilot, seed):
    refuse_feedback_alone([record_of(flown(seed, excitation="holds", **pilot), Axis.YAW)])


@pytest.mark.parametrize("with_rate", [True, False])
@pytest.mark.parametrize("kind", ["holds", "chirp", "sine", "multisine"])
@pytest.mark.parametrize("seed", range(5))
def test_open_loop_is_never_refused(kind, with_rate, seed):
    refuse_feedback_alone([record_of(flown(seed, excitation=kind, with_rate=with_rate), Axis.YAW)])


def test_a_controller_is_found_from_the_angle_alone():
    share, gain, _, delay = controller(record_of(flown(1, **PILOTS["P, fin in counts"]), Axis.YAW))
    assert share > 0.9
    assert abs(gain) == pytest.approx(1.15, rel=0.05)
    assert delay == pytest.approx(0.1, abs=1.01 * STEP)  # a difference of the angle holds the angle one sample before as well


@pytest.mark.parametrize("door", [lambda run: identify([run], Axis.YAW, whole=True), lambda run: diagnose([run], Axis.YAW)])
def test_identify_and_diagnose_refuse(door):
    with pytest.raises(DataError, match="its fin is feedback"):
        door(flown(2, **PILOTS["P"]))


def steered(seed, *, goal_is_logged=True, per_degree=4.0, step=0.5, length=900):
    """An autopilot that holds a goal which changes every half minute: 4 counts per degree of what is left, 200 counts a rad."""
    random = np.random.default_rng(seed)
    t = step * np.arange(length)
    goal = np.repeat(random.uniform(-np.pi, np.pi, length // 60 + 1), 60)[:length]
    angle, fin = np.zeros(length), np.zeros(length)
    rate = 0.0
    for i in range(length):
        left = np.remainder(goal[i] - angle[i] + np.pi, 2.0 * np.pi) - np.pi
        fin[i] = np.clip(np.round(per_degree * np.degrees(left)), -60, 60) / 200.0
        for _ in range(10 if i + 1 < length else 0):
            rate += 0.1 * step * (-0.9 * rate + 0.8 * fin[i] + 0.02 * random.standard_normal())
            angle[i : i + 2] += 0.1 * step * rate * np.array([0.0, 1.0])
        if i + 1 < length:
            angle[i + 1] += angle[i]
    seen = angle + 0.002 * random.standard_normal(length)
    return Run("iver", t, {"yaw_rad": seen, "rudder_rad": fin} | ({"yaw_goal_rad": goal} if goal_is_logged else {}))


@pytest.mark.parametrize("seed", range(4))
def test_a_controller_is_found_against_the_goal_that_the_log_has(seed):
    (note,) = closed_loop_note(record_of(steered(seed), Axis.YAW))
    assert "`yaw_rad` less `yaw_goal_rad`" in note.message
    assert note.data["gain"] == pytest.approx(-4.0 * np.degrees(1.0) / 200.0, rel=0.15)
    assert note.data["value"] > 0.95
    refuse_feedback_alone([record_of(steered(seed), Axis.YAW)])


@pytest.mark.parametrize("kind", ["holds", "chirp", "multisine"])
def test_a_goal_that_nothing_follows_makes_no_controller(kind):
    run = flown(3, excitation=kind)
    goal = np.repeat(np.random.default_rng(1).uniform(-3.0, 3.0, LENGTH // 200), 200)
    record = record_of(Run("r", run.time, {**run.signals, "yaw_goal_rad": goal}), Axis.YAW)
    assert not list(closed_loop_note(record))
