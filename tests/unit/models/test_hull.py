"""The one right-hand side: its slopes, and what constants move, are its differences; the strips are sums over the hull."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.dynamics.steady_kernel import settled_rates, straight_slopes
from fieldsid.models.hull import CONSTANTS, Core, by_constants, crossflow, crossforce, either, kinds_of, named, slope

SIZES = [0.8, 0.05, -0.04, 0.2, 0.1, 0.9, 0.3, 1.4, -0.3, 0.03, 0.06, 0.4, 0.7, 0.9, 1.2, 1.1, 0.5]
FULL = np.resize(SIZES, len(CONSTANTS))
DRIVES = {"damping": 1.1, "stiffness": 0.3, "moment": 0.2, "fin": 0.15, "factor": 0.9}
STATES = ({"y": 0.7, "p": -0.4, "x": 0.3, "clock": 12.0}, {"y": -1.2, "p": 0.3, "x": 0.05, "clock": -4.0})
STEP = 1e-6


def at(c, **moved):
    return slope(named(c), kinds_of(FULL), **{**DRIVES, **moved})


def difference(high, low):
    return [(getattr(high, of) - getattr(low, of)) / (2.0 * STEP) for of in ("rate", "cross")]


@pytest.mark.parametrize("state", STATES)
def test_its_slopes_are_its_central_differences(state):
    now = at(FULL, **state)
    declared = {
        "y": (now.by_angle, 0.0),
        "p": (now.by_rate, now.cross_by_rate),
        "x": (now.by_cross, now.cross_by_cross),
        "factor": (now.by_factor, now.cross_by_factor),
    }
    for name, wanted in declared.items():
        middle = {**DRIVES, **state}[name]
        found = difference(*(at(FULL, **{**state, name: middle + side * STEP}) for side in (1.0, -1.0)))
        assert found == pytest.approx(wanted, abs=1e-7), name


@pytest.mark.parametrize("state", STATES)
def test_what_each_constant_moves_is_its_central_difference(state):
    of_rate, of_cross = np.zeros((len(CONSTANTS), 4)), np.zeros((len(CONSTANTS), 4))
    k, kinds, given = named(FULL), kinds_of(FULL), (DRIVES["fin"], DRIVES["factor"], state["p"], state["x"])
    by_constants(k, kinds, at(FULL, **state), *given, 0, of_rate, of_cross)
    for j, name in enumerate(CONSTANTS):
        step = STEP * np.eye(len(CONSTANTS))[j]
        found = difference(at(FULL + step, **state), at(FULL - step, **state))
        assert found == pytest.approx([of_rate[j, 0], of_cross[j, 0]], abs=1e-7), name


def test_a_constant_alone_is_not_left_out():
    for name in set(CONSTANTS) - {"cross_share", "beyond_square", "heading_turn", "strip_flow"}:
        c = np.array(Core(**{name: 0.3, "strip_flow": 1.0}))
        alone, every = (slope(named(c), k, 1.0, 0.0, 0.0, 0.1, 1.0, **STATES[0]) for k in (kinds_of(c), kinds_of(FULL)))
        assert (alone.rate, alone.cross) == pytest.approx((every.rate, every.cross), rel=1e-12), name
        assert kinds_of(c).bent
        assert either(kinds_of(c), kinds_of(FULL)) == kinds_of(FULL)


def test_the_strips_are_sums_over_the_hull():
    xi = (np.arange(20000) + 0.5) / 20000 - 0.5
    for a in (-0.7, -0.2, -0.05, 0.0, 0.1, 0.15, 0.8):
        for p in (-0.6, -0.3, 0.0, 0.2, 0.5):
            flow = a + xi * p
            assert crossflow(a, p)[0] == pytest.approx(32.0 * np.mean(flow * np.abs(flow) * xi), abs=1e-7)
            assert crossforce(a, p)[0] == pytest.approx(np.mean(flow * np.abs(flow)), abs=1e-7)
            for ours in (crossflow, crossforce):
                assert ours(a, p)[1] == pytest.approx((ours(a + STEP, p)[0] - ours(a - STEP, p)[0]) / (2 * STEP), abs=2e-5)
                assert ours(a, p)[2] == pytest.approx((ours(a, p + STEP)[0] - ours(a, p - STEP)[0]) / (2 * STEP), abs=2e-5)
    assert crossflow(0.0, -0.5)[0] == pytest.approx(-0.25, rel=1e-12)


def test_a_straight_run_has_the_linear_terms_alone():
    cores = np.array([Core(), Core(quadratic=2.0, cross_damping=0.9, cross_rate=-0.4, cross_share=0.5, cross_fin=0.2)])
    np.testing.assert_allclose(straight_slopes(cores).T, [np.zeros(5), [0.0, 0.0, 0.9, -0.2, 0.1]], atol=1e-15)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_settled_rate_balances_the_equations(side):
    core = Core(
        quadratic=1.5, cross_damping=0.5, cross_quadratic=0.8, cross_rate=0.4, strip_moment=3.0, strip_force=4.0, strip_flow=0.9
    )
    push, out = np.array([0.4, 0.0, 0.4]) * side, np.empty(3)
    settled_rates(np.array([core] * 3), np.array([1.2, 1.2, 50.0]), push, push, side, np.zeros(0), np.zeros((1, 0)), out)
    assert np.isnan(out[1])
    balanced = [slope(core, kinds_of(np.array(core)), 1.2, 0.0, push[0], push[0], 1.0, 0.0, out[0], x, 0.0) for x in (-1.0, 1.0)]
    low, high = -1.0, 1.0
    assert balanced[0].cross > 0.0 > balanced[1].cross
    for _ in range(60):
        middle = 0.5 * (low + high)
        now = slope(core, kinds_of(np.array(core)), 1.2, 0.0, push[0], push[0], 1.0, 0.0, out[0], middle, 0.0)
        low, high = (middle, high) if now.cross > 0.0 else (low, middle)
    assert now.rate == pytest.approx(0.0, abs=1e-12)
    assert side * out[0] > side * out[2] > 0.0
