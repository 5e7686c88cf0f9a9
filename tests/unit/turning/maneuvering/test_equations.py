"""The maneuvering equations: hand-worked balances, symmetry, the compiled twin, and the ensemble's own hulls."""

from __future__ import annotations

import numpy as np
import pytest
from truth.maneuvering.hulls import draw_hull
from truth.maneuvering.motion import true_turn
from truth.radius_prior import reduced

from fieldsid.numerics.jit import plain_of
from fieldsid.turning.maneuvering.equations import (
    HEIGHTS,
    NAMES,
    STATIONS,
    coefficients,
    crossflow,
    growth_rate,
    settle,
    simulate,
)
from fieldsid.turning.maneuvering.prior import prior


def hull(**changed):
    p = coefficients(prior(2.0).mean)
    p[[NAMES.index(n) for n in NAMES if n.endswith("_viscous")]] = 0.0
    for name, value in changed.items():
        p[NAMES.index(name)] = value
    return p


def run(p, fin, seconds=20.0, step=0.1, simulated=simulate):
    time = np.arange(0.0, seconds, step)
    path = np.full((time.size - 1, 2), fin)
    first = np.array([[1.5, 0.0, 0.0]])
    return simulated(p, 1.5, first, np.zeros(1, dtype=np.int64), time, path, np.ones(time.size), 0.05)


def test_a_straight_run_stays_straight_and_keeps_its_speed():
    motion = run(hull(rudder_offset=0.0), 0.0)
    np.testing.assert_allclose(motion[0], 1.5, rtol=1e-12)
    np.testing.assert_allclose(motion[1:], 0.0, atol=1e-14)


def test_port_and_starboard_mirror_each_other():
    p = hull(rudder_offset=0.0)
    port, starboard = run(p, 0.3), run(p, -0.3)
    np.testing.assert_allclose(port[0], starboard[0], rtol=1e-12)
    np.testing.assert_allclose(port[1:], -starboard[1:], atol=1e-12)
    assert port[2, -1] < 0.0 < port[1, -1]


def test_the_settled_circle_is_where_the_simulation_ends():
    p = hull(rudder_offset=0.0, lag=0.05)
    np.testing.assert_allclose(run(p, -0.3, seconds=300.0)[:3, -1], settle(p, 1.5, -0.3), rtol=1e-3)


def test_the_compiled_equations_are_the_plain_ones():
    p = hull()
    np.testing.assert_allclose(run(p, 0.2, seconds=3.0), run(p, 0.2, seconds=3.0, simulated=plain_of(simulate)), rtol=1e-10)


@pytest.mark.parametrize(
    ("v", "w"), [(0.3, 0.0), (-0.3, 0.0), (0.0, 0.7), (0.1, 0.6), (0.1, -0.6), (-0.2, 0.9), (2.0, 0.1), (0.0, 0.0)]
)
def test_the_strips_are_summed_as_they_stand(v, w):
    across = v + STATIONS * w
    found = crossflow(v, w)
    for power in (0, 1):
        assert found[power] == pytest.approx(float(np.sum(HEIGHTS * across * np.abs(across) * STATIONS**power)), abs=1e-15)


def test_without_viscous_damping_the_circle_is_the_same_at_every_speed():
    p = hull(rudder_offset=0.0)
    radii = [np.hypot(u, v) / abs(r) for u, v, r in (settle(p, s, -0.3) for s in (0.7, 1.5, 3.0))]
    np.testing.assert_allclose(radii, radii[0], rtol=1e-3)


def test_a_hull_that_swings_for_ever_has_no_settled_circle():
    assert np.isnan(settle(hull(yaw_rate=-5.0, cross_drag=1e-9, stall=50.0), 1.5, -0.3)).all()


def test_growth_is_that_of_a_small_disturbance():
    p = hull(rudder_offset=0.0, yaw_lift=0.4, lag=0.01)
    growth = growth_rate(p, 1.5)
    assert growth > 0.0
    time = np.arange(0.0, 6.0, 0.05)
    first = np.array([[1.5, 0.0, 1e-9]])
    path = np.zeros((time.size - 1, 2))
    rate = simulate(p, 1.5, first, np.zeros(1, dtype=np.int64), time, path, np.ones(time.size), 0.05)[2]
    assert np.log(rate[-1] / rate[-21]) == pytest.approx(growth, rel=0.02)


@pytest.mark.parametrize("number", range(7))
def test_the_equations_turn_as_hulls_of_every_kind_do(number):
    """The ensemble has a coupling of sway and yaw, its own profiles, and an integral of its own."""
    drawn = draw_hull(number, 3)
    p = coefficients(np.concatenate([[np.log(drawn.of.length)], reduced(drawn.of), np.zeros(len(NAMES) - 17)]))
    p[[NAMES.index(n) for n in NAMES if n.endswith("_viscous")]] = 0.0  # the ensemble has none
    u, v, r = settle(p, drawn.speeds[2], -drawn.rudder_limit)
    assert np.hypot(u, v) / r == pytest.approx(true_turn(drawn, drawn.speeds[2], 1.0)[0], rel=0.05)
