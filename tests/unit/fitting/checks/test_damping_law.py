"""A vehicle is called unstable where no law of damping that the data leave says otherwise, and a Norrbin boat is not."""

import numpy as np
import pytest

from fieldsid.fitting.checks.damping_law import slope_at_rest
from fieldsid.fitting.fit import fit
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of

STEP, NOISE, FIN = 0.1, 0.002, 0.26


def flown(slope, drag, power, *, pulsed=False, seed=0, samples=1200):
    """A zig-zag, or pulses, of r' = -slope r - drag r |r|^(power - 1) + 0.9 fin, each step in twenty."""
    angle = rate = 0.0
    fin, rows = FIN, []
    for k in range(samples):
        phase = (k * STEP) % 24.0
        if pulsed:
            fin = FIN if phase < 2.0 else -FIN if 12.0 <= phase < 14.0 else 0.0
        elif abs(angle) > 1.3 * FIN and angle * fin > 0.0:
            fin = -fin
        rows.append((angle, rate, fin))
        for _ in range(20):
            angle += 0.05 * STEP * rate
            rate += 0.05 * STEP * (-slope * rate - drag * rate * abs(rate) ** (power - 1.0) + 0.9 * fin)
    angles, rates, fins = np.array(rows).T
    noise = NOISE * np.random.default_rng(seed).standard_normal((2, samples))
    signals = {"yaw_rad": angles + noise[0], "yaw_rate_rad_s": rates + noise[1], "rudder_rad": fins}
    return record_of(Run("flown", STEP * np.arange(samples), signals), Axis.YAW)


def said(record, *effects):
    found = fit([record], Axis.YAW, method="output_error", effects=effects)
    return {n.code: n.message for n in found.notes if n.code in ("unstable", "hidden_instability", "slope_at_rest")}


STABLE = [(0.083, 3.0, 3.0), (0.083, 11.0, 3.0), (0.1, 1.0, 2.0), (0.08, 2.0, 2.5), (0.3, 0.0, 2.0)]
UNSTABLE = [(-0.15, 2.0, 2.0), (-0.15, 4.0, 3.0), (-0.2, 3.0, 2.5)]


@pytest.mark.parametrize("effects", [(), ("quadratic_damping",)], ids=["plain", "square"])
@pytest.mark.parametrize("pulsed", [False, True], ids=["zigzag", "pulses"])
@pytest.mark.parametrize(("slope", "drag", "power"), STABLE)
def test_a_stable_vehicle_is_not_called_unstable_whatever_its_law(slope, drag, power, pulsed, effects):
    assert not [m for m in said(flown(slope, drag, power, pulsed=pulsed), *effects).values() if "UNSTABLE" in m]


@pytest.mark.parametrize("pulsed", [False, True], ids=["zigzag", "pulses"])
@pytest.mark.parametrize(("slope", "drag", "power"), UNSTABLE)
def test_one_that_turns_by_itself_is_and_it_is_said_of_what(slope, drag, power, pulsed):
    message = said(flown(slope, drag, power, pulsed=pulsed))["hidden_instability"]
    assert message.startswith("UNSTABLE")
    assert "the slope at rest of that curve fitted to turns" in message


def test_a_square_law_that_alone_says_so_is_named_as_what_says_it():
    found = said(flown(0.083, 11.0, 3.0), "quadratic_damping")
    assert "unstable" not in found
    assert "by this law of damping only" in found["slope_at_rest"]


def test_one_that_only_grows_is_unstable_without_any_curve():
    """Pulses that a hull without damping answers by ever faster turns: nothing in the data bends."""
    message = said(flown(-0.05, 0.0, 2.0, pulsed=True, samples=200))["unstable"]
    assert message.startswith("UNSTABLE")
    assert "nothing in the model holds it" in message


@pytest.mark.parametrize(("slope", "drag", "power"), [*STABLE[:-1], *UNSTABLE])
def test_slope_and_power_come_back_within_their_errors(slope, drag, power):
    record = flown(slope, drag, power)
    problem = Problem((record,), layout_of([record], Axis.YAW, ()))
    plain = fit([record], Axis.YAW, method="output_error")
    x = np.array([plain.model.values[n] for n in problem.layout.names] + list(plain.predictions[0].state[:2]))
    found = slope_at_rest(problem, x)
    assert found is not None
    assert found.value == pytest.approx(slope, abs=3.5 * found.std_error)
    assert found.std_error < 0.06
    assert found.power == pytest.approx(power, abs=0.25)
