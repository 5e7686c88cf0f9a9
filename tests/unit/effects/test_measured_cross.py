"""The moment of a measured cross speed: the drift law of its runs, what stands in for it, and the verdict on such a vehicle.

The truth here is the sway-yaw pair of Fossen 2011, section 7.1, written out and integrated finely. Where the water drifts
sideways too, no hidden state knows it: only the sensor does.
"""

from __future__ import annotations

import numpy as np
import pytest

import fieldsid as fs
from fieldsid.dynamics.assemble import Base, assemble, integrate_record
from fieldsid.dynamics.free_run import command_record, effects_of, simulate
from fieldsid.effects import pick_effect
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.effect import with_variant
from fieldsid.models.helpers.drift_law import drift_law
from fieldsid.models.record import record_of

STEP_S, FINE = 0.1, 20
DAMPING, AUTHORITY, MOMENT = 0.9, -1.6, -0.35
DRIFT_S, PER_RATE, PER_FIN = 1.4, -1.1, 0.5
"""Of the truth at 1.5 m/s: a22, b2, yaw moment per m/s of sway; T v' + v = x r + y delta."""


def flown(seconds=60.0, speed=1.5, seed=1, *, sway_noise=0.01, noise=0.004, gust=0.0):
    """A run of the truth at a speed, its Munk moment the same at every speed; sway by the drift law, lift with the speed."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, seconds, STEP_S)
    fin = np.interp(time, np.arange(0.0, seconds + 4.0, 4.0), 0.25 * rng.uniform(-1.0, 1.0, int(seconds / 4) + 1))
    f, h = speed / 1.5, STEP_S / FINE
    push = gust * np.interp(time, np.arange(0.0, seconds + 6.0, 6.0), rng.standard_normal(int(seconds / 6) + 1)) / DRIFT_S
    state, rows = np.zeros(3), np.empty((time.size, 3))
    for i in range(time.size):
        rows[i] = state
        # the log holds a command until its next sample
        for _ in range(FINE):
            middle = state + 0.5 * h * slope(state, fin[i], f, push[i])
            state = state + h * slope(middle, fin[i], f, push[i])
    signals = {
        "rudder_rad": fin, "yaw_rad": rows[:, 0] + noise * rng.standard_normal(time.size),
        "yaw_rate_rad_s": rows[:, 1] + noise * rng.standard_normal(time.size),
        "sway_m_s": rows[:, 2] + sway_noise * rng.standard_normal(time.size), "surge_m_s": np.full(time.size, speed),
    }  # fmt: skip
    return Run(f"run {seed}", time, signals), rows


def slope(state, fin, f, push):
    _, rate, sway = state
    return np.array(
        [
            rate,
            -DAMPING * f * rate + AUTHORITY * f * f * fin + MOMENT * sway,
            (PER_RATE * rate + PER_FIN * f * fin - sway) * f / DRIFT_S + push,
        ]
    )


def records(*runs):
    return [record_of(run, Axis.YAW) for run, _ in runs]


def test_the_drift_law_of_runs_at_two_speeds_is_the_one_they_were_flown_by():
    law = drift_law(records(flown(seed=1, sway_noise=0.002), flown(seed=2, speed=2.2, sway_noise=0.002)), 1.5)
    assert law.per_rate == pytest.approx(PER_RATE, rel=0.03)
    assert law.per_fin == pytest.approx(PER_FIN, rel=0.06)
    assert law.time_constant == pytest.approx(DRIFT_S, rel=0.04)


def test_port_for_starboard_leaves_the_drift_law():
    run, _ = flown(seed=3)
    mirrored = Run(run.name, run.time, {n: v if n == "surge_m_s" else -v for n, v in run.signals.items()})
    one, other = drift_law([record_of(run, Axis.YAW)], 1.5), drift_law([record_of(mirrored, Axis.YAW)], 1.5)
    assert (one.per_rate, one.per_fin, one.time_constant) == pytest.approx((other.per_rate, other.per_fin, other.time_constant))


@pytest.mark.parametrize("moment", ["cross_moment", "munk_moment"])
@pytest.mark.parametrize("scale", [1.0, 1.5])
def test_what_stands_in_moves_the_hull_as_the_sway_it_stands_for(moment, scale):
    """The hidden state of the drift law is fed the same rate and fin: with its own sway as if measured the motion is the same."""
    effect = pick_effect("sway_coupling")
    shaped = with_variant(effect, next(v for v in effect.variants if v.coefficients[0].name == moment))
    speed = 1.5 * scale
    time = np.arange(0.0, 30.0, 0.02)
    fin = 0.2 * np.sign(np.sin(2.0 * np.pi * time / 7.0))
    values = {moment: -0.3, "drift_damping": 0.7, "drift_per_rate": -1.1, "drift_per_fin": 0.5, "drift_speed": 1.5}
    base, start = Base(0.9 * scale, 0.0, -1.6 * scale**2, 0.0), np.zeros(3)
    blind = command_record(Axis.YAW, time, fin, speed=speed)
    hidden = integrate_record(blind, assemble(blind, [shaped], base, values, scale), start)
    k = -0.3 * (speed if moment == "munk_moment" else 1.0)
    seen = command_record(Axis.YAW, time, fin, speed=speed, signals={"cross": hidden[:, 2] / k})
    measured = integrate_record(seen, assemble(seen, [shaped], base, {moment: -0.3}, scale), start)
    np.testing.assert_allclose(measured[:, 1], hidden[:, 1], atol=2e-4)


def test_a_vehicle_whose_sway_is_measured_is_told_by_it_and_flown_without_it_afterwards():
    runs = [flown(seed=s, speed=v, gust=0.15, sway_noise=0.004) for s, v in ((4, 1.5), (5, 1.5), (6, 2.2))]
    unseen, _ = flown(seed=7, gust=0.15, sway_noise=0.004)
    found = fs.diagnose([r for r, _ in runs], "yaw", validate=[unseen])
    assert (found.verdict, found.effects) == ("effect", ("sway_coupling",))
    assert found.final.validation.angle_rms_rad < 1.15 * 0.004
    joint = next(iter(fs.identify([r for r, _ in runs], "yaw", joint=True))).model
    model = fs.extend(joint, [r for r, _ in runs], "sway_coupling", validate=unseen).model
    assert model.values["cross_moment"] == pytest.approx(MOMENT, rel=0.1)
    assert effects_of(model)[0].stand_in is not None

    # without a sensor, as plans and schedules fly it: the truth without noise, from the same fin
    quiet, truth = flown(seed=8, noise=0.0, sway_noise=0.0)
    blind = command_record(Axis.YAW, quiet.time, quiet.signals["rudder_rad"], speed=1.5)
    rate = simulate(model, blind, state=(0.0, 0.0, 0.0)).rate
    assert float(np.sqrt(np.mean((rate - truth[:, 1]) ** 2))) < 0.06 * float(np.sqrt(np.mean(truth[:, 1] ** 2)))
