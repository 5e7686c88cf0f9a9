"""The settled circle by algebra is where the model's own simulation ends; speed lost, drift and both sides counted in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fieldsid.dynamics.free_run import command_record, simulate
from fieldsid.effects import add_effects, forget_effects
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Coefficient, Effect, Stage, Terms, as_fitted
from fieldsid.models.model import Model, Noise
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.plant.yaw_plant import yaw_plant
from fieldsid.turning.steady.speed_loss import SpeedLoss, draw_speed_loss, fit_surge, no_speed_loss
from fieldsid.turning.steady.steady_turn import steady_turn
from fieldsid.turning.steady.transient import turn_transient

EFFECTS = {
    "plain": ((), {}),
    "quadratic": (("quadratic_damping",), {"quadratic": 3.0}),
    "another power": (("quadratic_damping",), {"quadratic": 3.0, "rate_power": 1.5}),
    "sway": (("sway_coupling",), {"cross_damping": 0.9, "cross_rate": -0.4}),
    "sway squared": (("sway_coupling",), {"cross_damping": 0.9, "cross_rate": -0.4, "cross_quadratic": 4.0, "cross_fin": 0.1}),
    "strips": (
        ("sway_coupling",),
        {
            "cross_damping": 0.3,
            "cross_rate": 0.5,
            "cross_fin": 0.2,
            "strip_drag": 4.0,
            "strip_inertia": 0.04,
            "strip_munk": -0.4,
        },
    ),
    "cross flow": (
        ("crossflow_drag",),
        {"crossflow": 4.0, "flow_damping": 0.8, "flow_rate": 0.5, "flow_fin": 0.2},
    ),
    "sway and cross flow": (
        ("sway_coupling", "crossflow_drag"),
        {"cross_damping": 0.9, "cross_rate": -0.4, "crossflow": 4.0, "flow_share": -1.2},
    ),
    "fins": (("servo_lag", "rate_limit", "asymmetric_fin"), {"lag": 0.2, "max_rate": 0.5, "asymmetry": 0.1}),
    "stall": (("stall",), None),
    "all": (
        ("servo_lag", "sway_coupling", "quadratic_damping"),
        {"lag": 0.15, "cross_damping": 0.9, "cross_rate": -0.4, "quadratic": 2.0},
    ),
}


def model_of(name, sign=-1.0, **base):
    from fieldsid.effects import pick_effect

    effects, own = EFFECTS[name]
    starts = {c.name: c.start for e in effects for c in as_fitted(pick_effect(e), own or {}).shared}
    values = {"a22": 1.5, "b2": sign * 2.0, "C0": 0.02} | starts | (own or {}) | base
    return Model(Axis.YAW, effects, values, {}, tuple(values), np.zeros((len(values),) * 2), SpeedLaw(1.5), Noise(0.01, 0.01))


def turn_of(model, side, speed=1.5, fin=0.3, slowing=None, entry=None):
    speeds = np.array(entry or [speed])
    plant = yaw_plant(model, [dict(model.values)], fin, np.array([model.law.damping_exponent]), speeds)
    return plant, steady_turn(plant, slowing or no_speed_loss(1), speeds, side)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("name", EFFECTS)
def test_the_settled_rate_is_that_of_the_models_own_simulation(name, sign, side):
    model = model_of(name, sign)
    time = np.arange(0.0, 80.0, 0.05)
    record = command_record(Axis.YAW, time, np.full(time.size, side * sign * 0.3), speed=1.5)
    wanted = float(simulate(model, record, state=(0.0, 0.0, 0.0)).rate[-1])
    _, turn = turn_of(model, side)
    assert np.sign(wanted) == side
    assert turn.rate[0, 0] == pytest.approx(wanted, rel=1e-5)
    assert turn.radius[0, 0] == pytest.approx(1.5 / abs(wanted), rel=1e-5)


@pytest.mark.parametrize("name", EFFECTS)
def test_at_another_speed_the_rate_is_that_of_the_simulation_there(name):
    model = model_of(name)
    time = np.arange(0.0, 120.0, 0.05)
    record = command_record(Axis.YAW, time, np.full(time.size, -0.3), speed=0.9)
    wanted = float(simulate(model, record, state=(0.0, 0.0, 0.0)).rate[-1])
    assert turn_of(model, 1.0, speed=0.9)[1].rate[0, 0] == pytest.approx(wanted, rel=1e-4)


def test_the_loss_of_speed_satisfies_its_own_balance():
    slowing = SpeedLoss(*(np.array([[v]]) for v in (4.0, 0.5, 0.4, 0.2)))
    _, turn = turn_of(model_of("all"), 1.0, slowing=slowing)
    u, r = turn.surge[0, 0], turn.rate[0, 0]
    assert u**2 * (1.0 + 0.5 * 0.09) + 4.0 * r**2 == pytest.approx(1.5**2, rel=1e-6)
    assert turn.speed[0, 0] == pytest.approx(np.hypot(u, 0.4 * r))
    assert u < 1.4


def test_an_unstable_model_turns_steadily_only_where_its_drag_holds_it():
    assert np.isnan(turn_of(model_of("plain", a22=-0.3), 1.0)[1].radius[0, 0])
    held = turn_of(model_of("quadratic", a22=-0.3), 1.0)[1].rate[0, 0]
    assert -0.3 * held + 3.0 * held**2 == pytest.approx(2.0 * 0.3 + 0.02, rel=1e-6)


@pytest.mark.parametrize("name", ["plain", "all"])
def test_the_transient_ends_on_the_settled_circle(name):
    slowing = SpeedLoss(*(np.array([[v]]) for v in (3.0, 0.2, 0.3, 0.2)))
    plant, turn = turn_of(model_of(name, C0=0.0), 1.0, slowing=slowing)
    after = turn_transient(plant, slowing, np.array([1.5]), 1.0, 0.3)
    assert after.time_90[0] < after.time_180[0]
    assert after.tactical_diameter[0] > 1.8 * turn.radius[0, 0]
    assert after.path_180[0] > np.pi * turn.radius[0, 0]
    late = turn_transient(plant, slowing, np.array([1.5]), -1.0, 0.3)
    assert late.tactical_diameter[0] == pytest.approx(after.tactical_diameter[0], rel=1e-6)


@pytest.mark.parametrize("name", ["sway squared", "strips", "cross flow", "sway and cross flow"])
def test_the_transient_without_lost_speed_is_the_models_own_simulation(name):
    model = model_of(name, C0=0.0)
    plant, _ = turn_of(model, 1.0)
    time = np.arange(0.0, 40.0, 0.02)
    record = command_record(Axis.YAW, time, np.full(time.size, -0.3), speed=1.5)
    heading = simulate(model, record, state=(0.0, 0.0, 0.0)).angle
    after = turn_transient(plant, no_speed_loss(1), np.array([1.5]), 1.0, 0.3)
    for angle, reached in ((0.5 * np.pi, after.time_90[0]), (np.pi, after.time_180[0])):
        assert reached == pytest.approx(float(np.interp(angle, heading, time)), rel=5e-3)


def test_the_transient_of_a_first_order_model_agrees_with_its_closed_form():
    plant, _ = turn_of(model_of("plain", C0=0.0), 1.0)
    after = turn_transient(plant, no_speed_loss(1), np.array([1.5]), 1.0, 0.3)
    rate, a, t = 2.0 * 0.3 / 1.5, 1.5, after.time_180[0]
    assert rate * (t - (1.0 - np.exp(-a * t)) / a) == pytest.approx(np.pi, rel=1e-3)
    assert after.path_180[0] == pytest.approx(1.5 * t, rel=1e-3)


def surge_run(seed, speed=1.5, drag=0.2, loss=0.8, fin_loss=0.1, drift=0.4, noise=0.02):
    rng, time = np.random.default_rng(seed), np.arange(0.0, 60.0, 0.05)
    fin = np.where((time > 5) & (time < 60), 0.2 * np.sign(np.sin(0.5 * time)), 0.0)
    rate = np.zeros(time.size)
    surge = np.full(time.size, speed)
    for i in range(time.size - 1):
        rate[i + 1] = rate[i] + 0.05 * (-1.5 * rate[i] - 2.0 * fin[i])
        slope = drag * (speed**2 - surge[i] ** 2) - loss * rate[i] ** 2 - fin_loss * surge[i] ** 2 * fin[i] ** 2
        surge[i + 1] = surge[i] + 0.05 * slope
    noisy = {
        "surge_m_s": surge + noise * rng.standard_normal(time.size),
        "sway_m_s": -drift * rate + noise * rng.standard_normal(time.size),
        "yaw_rate_rad_s": rate + 0.003 * rng.standard_normal(time.size),
        "rudder_rad": fin,
    }
    return Run(f"surge{seed}", time, noisy)


def test_the_loss_of_speed_comes_back_from_measured_surge():
    model = fit_surge([surge_run(1), surge_run(2, speed=1.1)])
    slowing = draw_speed_loss(model, 0.3, 200, np.random.default_rng(0))
    truth = np.sqrt(1.0 + 0.1 / 0.2 * 0.09 + 0.8 / 0.2 * 0.09)
    factors = slowing.factor(np.full((200, 1), 0.3), np.full((200, 1), 0.3))
    assert factors[0, 0] == pytest.approx(truth, rel=0.02)
    low, high = np.percentile(factors, [1.0, 99.0])
    assert low <= truth <= high
    assert model.drift_per_rate == pytest.approx(0.4, rel=0.05)


def test_without_surge_a_typical_loss_is_taken_and_spread_widely():
    assert fit_surge([]) is None
    slowing = draw_speed_loss(None, 0.3, 2000, np.random.default_rng(0))
    factors = slowing.factor(np.full((2000, 1), 0.3), np.full((2000, 1), 0.3))
    assert factors[0, 0] == pytest.approx(1.0 / 0.85, rel=1e-6)
    low, high = np.percentile(1.0 - 1.0 / factors, [2.5, 97.5])
    assert low < 0.06
    assert high > 0.4


@pytest.mark.parametrize("exponent", [1.0, 2.0])
def test_a_propellers_moment_is_that_of_the_thrust_at_each_speed(exponent):
    """What the simulation settles at when its thrust goes with the speed of the approach as the training runs' did."""
    values = {"a22": 1.5, "b2": -2.0, "C0": 0.02, "prop_moment": 0.02, "prop_trimmed": -0.03}
    trained = {"thrust_at_1_m_s": 3.0, "thrust_exponent": exponent}
    model = Model(
        Axis.YAW, ("prop_moment",), values, {}, tuple(values), np.zeros((5, 5)), SpeedLaw(1.5), Noise(0.01, 0.01), trained
    )
    time = np.arange(0.0, 60.0, 0.05)
    for speed in (0.8, 1.5, 2.5):
        thrust = np.full(time.size, 3.0 * speed**exponent)
        record = command_record(Axis.YAW, time, np.full(time.size, -0.3), speed=speed, signals={"thrust": thrust})
        wanted = float(simulate(model, record, state=(0.0, 0.0, 0.0)).rate[-1])
        plant, turn = turn_of(model, 1.0, entry=[0.8, 1.5, 2.5])
        at = [0.8, 1.5, 2.5].index(speed)
        assert turn.rate[0, at] == pytest.approx(wanted, rel=1e-6)
        after = turn_transient(plant, no_speed_loss(1), np.array([0.8, 1.5, 2.5]), 1.0, 0.3)
        assert np.isfinite(after.tactical_diameter[at])


def followed(path, values, record):
    """Return a fin that a faster flow holds back."""
    held = 1.0 / (1.0 + values["flow_held"] * record["surge"][:-1] ** 2)
    return replace(path, start=path.start * held, end=path.end * held)


FOLLOWING = {
    "fin": {"stage": Stage.ACTUATOR, "needs": ("surge",), "fin": followed},
    "terms": {
        "needs": ("thrust",),
        "terms": lambda v, record: Terms(
            authority_factor=1.0 + v["flow_held"] * record["thrust"], damping=0.1 * record["thrust"]
        ),
    },
    "moment": {
        "needs": ("surge", "thrust"),
        "moment": lambda m, v, record: v["flow_held"] * record["thrust"] * record.fin - v["flow_held"] * m.rate * record["surge"],
    },
}


@pytest.fixture(params=FOLLOWING)
def following(request):
    """An effect of the user's own that follows the speed or the thrust, known for the length of a test."""
    held = (Coefficient("flow_held", "1", -5.0, 5.0, 0.2),)
    effect = Effect(
        name="flow_following", says="", stage=Stage.HYDRODYNAMICS, axes=(Axis.YAW,), equation="", coefficients=held, telltale="",
        excited_by=(), mistaken_for=(), source="", origin="here",
    )  # fmt: skip
    add_effects([replace(effect, **FOLLOWING[request.param])])
    yield request.param
    forget_effects()


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_effect_that_follows_the_run_is_as_it_is_at_each_speed(following, side):
    values = {"a22": 1.5, "b2": -2.0, "C0": 0.0, "flow_held": 0.2}
    trained = {"thrust_at_1_m_s": 1.0, "thrust_exponent": 1.0}
    model = Model(
        Axis.YAW, ("flow_following",), values, {}, tuple(values), np.zeros((4, 4)), SpeedLaw(1.5), Noise(0.01, 0.01), trained
    )
    entry = [0.8, 1.5, 2.5]
    plant, turn = turn_of(model, side, entry=entry)
    after = turn_transient(plant, no_speed_loss(1), np.array(entry), side, 0.3)
    for at, speed in enumerate(entry):
        time = np.arange(0.0, 40.0, 0.02)
        thrust = np.full(time.size, speed)
        record = command_record(Axis.YAW, time, np.full(time.size, -side * 0.3), speed=speed, signals={"thrust": thrust})
        wanted = simulate(model, record, state=(0.0, 0.0, 0.0))
        assert turn.rate[0, at] == pytest.approx(float(wanted.rate[-1]), rel=1e-4)
        assert after.time_180[at] == pytest.approx(float(np.interp(np.pi, side * wanted.angle, time)), rel=5e-3)
