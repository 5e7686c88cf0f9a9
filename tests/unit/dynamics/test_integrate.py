"""The compiled core against a fine-step integration by SciPy, written down a second time; the linear core against itself."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fieldsid.dynamics import integrate
from fieldsid.dynamics.assemble import pieces_for
from fieldsid.dynamics.linear_kernel import accumulate_normal_equations, is_even, linear_motion, linear_sensitivities
from fieldsid.dynamics.nonlinear_kernel import nonlinear_motion, nonlinear_sensitivities
from fieldsid.models.hull import CONSTANTS, DRIVES, MULTIPLIERS, Core, named
from fieldsid.numerics.jit import plain_of

N, H = 80, 0.05
SIZES = (0.8, 0.05, -0.04, 0.2, 0.1, 0.9, 0.3, 1.4, -0.3, 0.03, 0.06, 0.4, 0.7, 0.9, 1.2, 1.1, 0.5)
C = dict(zip(CONSTANTS, np.resize(SIZES, len(CONSTANTS)).tolist(), strict=True))
LINEAR = np.array(Core())
COUNT = len(CONSTANTS)


def NOTHING(count):  # noqa: N802
    """What parameters push that push no drive."""
    return np.ones((1, N - 1)), np.zeros((count, 6), dtype=np.intp), np.zeros((count, 6))


def drive(seed=4):
    rng = np.random.default_rng(seed)
    out = np.zeros((N - 1, 6))
    out[:, 0], out[:, 1] = 1.1 + 0.2 * rng.random(N - 1), 0.3
    level = np.repeat(rng.uniform(-0.3, 0.3, N // 10 + 1), 10)[: N - 1]
    out[:, 2], out[:, 3] = level, level + 0.02
    out[:, 4], out[:, 5] = 1.0 + 0.1 * rng.random(N - 1), 0.1
    return out


def oracle(rows, c, start):
    """Interval by interval with DOP853: inputs are smooth inside each."""
    xi = (np.arange(800) + 0.5) / 800 - 0.5
    path, y = [np.array(start)], np.array(start)
    for i, (a, k, m0, m1, g, d) in enumerate(rows):

        def slope(t, s, i=i, a=a, k=k, m0=m0, m1=m1, g=g, d=d):
            part = t / H
            seen = s[0] - c["heading_turn"] * ((i + part) * H - 0.5 * (N - 1) * H)
            own = c["strip_flow"] * s[2] / g + xi * s[1]
            p = -a * s[1] - k * s[0] + m0 + (m1 - m0) * part + c["cross_share"] * s[2]
            p -= c["strip_moment"] * 32.0 * np.mean(own * np.abs(own) * xi)
            p -= c["quadratic"] * np.sign(s[1]) * 0.2**2 * (abs(s[1]) / 0.2) ** (2.0 + c["beyond_square"])
            p += c["heading_sin"] * np.sin(seen) + c["heading_cos"] * np.cos(seen)
            p += c["heading_sin2"] * np.sin(2.0 * seen) + c["heading_cos2"] * np.cos(2.0 * seen)
            p += c["righting_sin"] * (seen - np.sin(seen)) + c["righting_cos"] * (np.cos(seen) - 1.0)
            held = c["cross_damping"] * g + c["cross_quadratic"] / g * abs(s[2])
            held_back = c["strip_force"] * g * np.mean(own * np.abs(own))
            return [s[1], p, -held * s[2] - c["cross_rate"] * g * g * s[1] - held_back + c["cross_fin"] * d]

        y = solve_ivp(slope, (0.0, H), y, method="DOP853", rtol=1e-9, atol=1e-12).y[:, -1]
        path.append(y)
    return np.array(path)


def test_the_core_is_the_integral_of_its_equation():
    rows, out = drive(), np.empty((N, 3))
    integrate.integrate_motion(np.full(N - 1, H), rows, np.array(list(C.values())), np.array([0.1, -0.05, 0.02]), 2, out)
    np.testing.assert_allclose(out, oracle(rows, C, [0.1, -0.05, 0.02]), atol=4e-6)


def test_the_constants_are_named_in_the_order_of_their_array():
    assert named(np.arange(1.0 * COUNT)) == Core(*range(COUNT))


def test_the_compiled_core_gives_the_numbers_of_its_python_source():
    steps, c, start = np.full(N - 1, H), np.array(list(C.values())), np.array([0.1, -0.05, 0.02])
    fast, slow = np.empty((N, 3)), np.empty((N, 3))
    integrate.integrate_motion(steps, drive(), c, start, 1, fast)
    plain_of(nonlinear_motion)(steps, drive(), c, start, 1, slow)
    np.testing.assert_allclose(fast, slow, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("what", ["a cross state", "none", "without bound"])
def test_the_compiled_tangents_are_those_of_their_python_source(what):
    """Over more steps than are taken at once, on an uneven clock; a motion without bound ends after the first of them."""
    steps, rows, start = np.tile(clock("every")[0], 2), np.tile(drive(), (2, 1)), np.array([0.1, -0.05, 0.02 * (what != "none")])
    c = np.array(Core(*C.values()) if what == "a cross state" else Core(quadratic=0.8 * (what == "none"), heading_sin=0.05))
    rows[100:, 0] -= 60.0 * (what == "without bound")
    columns, places, factors, _ = pushed()
    columns, factors = np.tile(columns, 2), factors + np.eye(4, 6, k=2)
    d_c, d_start, found = np.eye(4, COUNT), np.eye(4, 3), []
    for run in (nonlinear_sensitivities, plain_of(nonlinear_sensitivities)):
        out, sens = np.empty((2 * N - 1, 3)), np.empty((4, 2, 2 * N - 1))
        with np.errstate(over="ignore", invalid="ignore"):
            run(steps, rows, c, start, 3, columns, places, factors, d_c, d_start, out, sens)
        found.append((out, sens))
    gone = np.isnan(found[0][0][:, 1])
    assert gone.any() == (what == "without bound")
    assert (np.isnan(found[0][1]) == gone).all()
    assert not gone[:101].any()
    for fast, slow in zip(*found, strict=True):
        np.testing.assert_allclose(fast, slow, rtol=1e-10, atol=1e-12)


def test_a_motion_without_bound_is_nan_from_there_on():
    rows, out = np.zeros((N - 1, 6)), np.empty((N, 3))
    rows[:, 0], rows[:, 2:4] = -40.0, 1.0
    integrate.integrate_motion(np.full(N - 1, H), rows, LINEAR, np.zeros(3), 8, out)
    first = int(np.argmax(np.isnan(out[:, 1])))
    assert 0 < first < N
    assert np.isnan(out[first:]).all()
    assert np.isfinite(out[:first]).all()


@pytest.mark.parametrize(("a", "k"), [(1.1, 0.0), (2.4, 0.05), (-0.2, 0.0), (9.0, 4.0)])
def test_the_linear_core_leaves_the_residual_of_the_general_one(a, k):
    rng = np.random.default_rng(2)
    steps = np.where(np.arange(N - 1) % 7 == 0, 0.08, H)
    fin, measured = rng.uniform(-0.3, 0.3, (2, N - 1)), rng.standard_normal((2, N))
    weight = np.where(rng.random((2, N)) < 0.9, 3.0, 0.0)
    pieces = pieces_for(0.08, abs(a), k**0.5)
    square = np.zeros((8, 7))
    accumulate_normal_equations(steps, fin, measured, weight, np.array([a, k, -0.8, 0.01, 0.1, 0.05]), pieces, square)
    rows, out = np.zeros((N - 1, 6)), np.empty((N, 3))
    rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 3] = a, k, -0.8 * fin[0] + 0.01, -0.8 * fin[1] + 0.01
    integrate.integrate_motion(steps, rows, LINEAR, np.array([0.1, 0.05, 0.0]), pieces, out)
    left = measured - out[:, :2].T
    assert square[0, 0] == pytest.approx(float(np.sum((weight * left) ** 2)), rel=1e-10)
    np.testing.assert_allclose(square[7, :2], np.sum(np.where(weight > 0, left, 0.0) ** 2, axis=1), rtol=1e-10)


def test_the_tangents_of_every_constant_are_its_central_differences():
    steps, c, start, rows = np.full(N - 1, H), np.array(list(C.values())), np.array([0.1, -0.05, 0.02]), drive()
    count = c.size
    out, sens = np.empty((N, 3)), np.empty((count, 2, N))
    integrate.integrate_with_sensitivities(
        steps, rows, c, start, 2, *NOTHING(count), np.eye(count), np.zeros((count, 3)), out, sens
    )
    for j, name in enumerate(CONSTANTS):
        ends = []
        for side in (1.0, -1.0):
            moved, path = c.copy(), np.empty((N, 3))
            moved[j] += side * 1e-5
            integrate.integrate_motion(steps, rows, moved, start, 2, path)
            ends.append(path[:, :2].T)
        wanted = (ends[0] - ends[1]) / 2e-5
        np.testing.assert_allclose(sens[j], wanted, atol=2e-6 * (1.0 + np.abs(wanted).max()), err_msg=name)


def clock(kind):
    """Steps and damping: alike over all intervals, over many, or over none."""
    steps = {"even": np.full(N - 1, H), "steady": np.where(np.arange(N - 1) < 40, H, 0.08)}
    damping = {"even": np.full(N - 1, 1.1), "steady": np.where(np.arange(N - 1) < 60, 1.1, 1.4)}
    return steps.get(kind, H * (1.0 + 0.2 * np.sin(np.arange(N - 1)))), damping.get(kind, drive()[:, 0])


def pushed():
    """Four parameters that push one drive each: columns (5, n-1), places and factors (4, 6), and the drives (4, n-1, 6)."""
    columns = np.stack([np.ones(N - 1), *(1.0 + 0.1 * np.cos(np.arange(N - 1) * (1 + i)) for i in range(4))])
    places, factors, pushes = np.zeros((4, 6), dtype=np.intp), np.zeros((4, 6)), np.zeros((4, N - 1, 6))
    for i in range(4):
        places[i, i], factors[i, i], pushes[i, :, i] = i + 1, 0.5, 0.5 * columns[i + 1]
    return columns, places, factors, pushes


@pytest.mark.parametrize("kind", ["even", "steady", "every"])
def test_the_tangents_of_the_drives_are_their_central_differences_along_a_linear_motion(kind):
    """Where damping, stiffness and step stay the map is worked out once, but not what goes with the motion."""
    rows, start = drive(), np.array([0.1, -0.05, 0.0])
    steps, rows[:, 0] = clock(kind)
    rows[:, 4], rows[:, 5] = 1.0, 0.0
    columns, places, factors, pushes = pushed()
    out, sens = np.empty((N, 3)), np.empty((4, 2, N))
    none = np.zeros((4, COUNT)), np.zeros((4, 3))
    integrate.integrate_with_sensitivities(steps, rows, LINEAR, start, 2, columns, places, factors, *none, out, sens)
    for place in range(4):
        ends = []
        for side in (1.0, -1.0):
            path = np.empty((N, 3))
            integrate.integrate_motion(steps, rows + side * 1e-5 * pushes[place], LINEAR, start, 2, path)
            ends.append(path[:, :2].T)
        np.testing.assert_allclose(sens[place], (ends[0] - ends[1]) / 2e-5, atol=1e-8, err_msg=DRIVES[place])


@pytest.mark.parametrize("pieces", [1, 3])
@pytest.mark.parametrize("what", ["a straight motion", "one without bound", "a single run's own start"])
def test_the_linear_core_moves_as_the_general_one(pieces, what):
    rows, start, columns, places, factors, _ = drive(), np.array([0.1, -0.05, 0.0]), *pushed()
    steps, rows[:, 0] = np.full(N - 1, H), -9.0 if what == "one without bound" else 1.1
    rows[:, 4], rows[:, 5] = 1.0, 0.0
    d_start = np.eye(4, 3) if what == "a single run's own start" else np.zeros((4, 3))
    d_start[:, 2], none = 0.0, np.zeros((4, COUNT))
    found = []
    for move, with_tangents in (
        (integrate.integrate_motion, integrate.integrate_with_sensitivities),
        (plain_of(linear_motion), plain_of(linear_sensitivities)),
        (nonlinear_motion, nonlinear_sensitivities),
    ):
        path, out, sens = np.empty((N, 3)), np.empty((N, 3)), np.empty((4, 2, N))
        move(steps, rows, LINEAR, start, pieces, path)
        with_tangents(steps, rows, LINEAR, start, pieces, columns, places, factors, none, d_start, out, sens)
        np.testing.assert_allclose(path, out, rtol=1e-12, atol=1e-15)
        found.append((out, sens))
    assert np.isnan(found[0][0]).any() == (what == "one without bound")
    for other in found[1:]:
        for fast, slow in zip(found[0], other, strict=True):
            np.testing.assert_allclose(fast, slow, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", [n for i, n in enumerate(CONSTANTS) if i not in MULTIPLIERS])
def test_a_motion_that_any_constant_bends_is_not_taken_for_a_linear_one(name):
    """Nor are its tangents, where only a parameter's derivative is of the constant."""
    steps, rows, c, start, at = np.full(N - 1, H), drive(), LINEAR.copy(), np.zeros(3), CONSTANTS.index(name)
    rows[:, 0], rows[:, 4], rows[:, 5] = 1.1, 1.0, 0.0
    out, sens = np.empty((N, 3)), np.empty((1, 2, N))
    assert linear_motion(steps, rows, c, start, 1, out)
    d_c, none = np.zeros((1, COUNT)), np.zeros((1, 3))
    assert linear_sensitivities(steps, rows, c, start, 1, *NOTHING(1), d_c, none, out, sens)
    d_c[0, at] = -1e-9
    assert not linear_sensitivities(steps, rows, c, start, 1, *NOTHING(1), d_c, none, out, sens)
    c[at] = -0.1
    assert not linear_motion(steps, rows, c, start, 1, out)


@pytest.mark.parametrize("what", ["a cross state", "a parameter's cross state"])
def test_a_motion_with_a_cross_state_is_not_taken_for_a_linear_one(what):
    steps, rows, start, (columns, place, factor) = np.full(N - 1, H), drive(), np.zeros(3), NOTHING(1)
    rows[:, 0], rows[:, 4], rows[:, 5] = 1.1, 1.0, 0.0
    d_start = np.zeros((1, 3))
    start[2] = 0.1 * (what == "a cross state")
    d_start[0, 2] = what == "a parameter's cross state"
    out, sens = np.empty((N, 3)), np.empty((1, 2, N))
    assert linear_motion(steps, rows, LINEAR, start, 1, out) == what.startswith("a parameter")
    assert not linear_sensitivities(
        steps, rows, LINEAR, start, 1, columns, place, factor, np.zeros((1, COUNT)), d_start, out, sens
    )


def test_few_intervals_or_unlike_ones_are_not_even():
    rows, steps = np.ones((N - 1, 6)), np.full(N - 1, H)
    assert is_even(steps, rows)
    assert not is_even(steps[:8], rows[:8])
    assert not is_even(np.linspace(H, 1.001 * H, N - 1), rows)
    for place in range(2):
        bent = rows.copy()
        bent[-1, place] = 2.0
        assert not is_even(steps, bent)
