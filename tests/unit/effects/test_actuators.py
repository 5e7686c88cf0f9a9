"""Actuator effects against hand-worked cases and against a brute-force fine-step answer that shares no code with them."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np
import pytest

from fieldsid.effects import pick_effect
from fieldsid.models.axis import Axis
from fieldsid.models.fin_path import FinPath
from fieldsid.models.record import Record

FINE = 4000


def record(time, fin, *, held: bool) -> Record:
    n = len(time)
    none = np.zeros(n)
    ok = np.ones(n, bool)
    return Record(
        "made",
        Axis.YAW,
        np.asarray(time, float),
        np.asarray(fin, float),
        held,
        not held,
        none,
        none,
        ok,
        ok,
        none,
        ~ok,
        MappingProxyType({}),
        1.0,
    )


def through(name: str, log: Record, **values: float) -> FinPath:
    return pick_effect(name).fin(log.commanded, values, log)


def bumpy(*, held: bool) -> Record:
    rng = np.random.default_rng(3)
    time = np.cumsum(np.r_[7.0, rng.uniform(0.02, 0.12, 10)])
    return record(time, rng.uniform(-0.4, 0.4, 11), held=held)


def fine_line(values: np.ndarray) -> tuple[float, float]:
    """Mean and least-squares slope (times the length) of a finely sampled path over one interval."""
    s = (np.arange(values.size) + 0.5) / values.size - 0.5
    return float(values.mean()), float(12.0 * np.mean(values * s))


def fine_command(log: Record, i: int) -> np.ndarray:
    path = log.commanded
    s = (np.arange(FINE) + 0.5) / FINE
    return path.start[i] + (path.end[i] - path.start[i]) * s


def brute(log: Record, step) -> list[tuple[float, float]]:
    """Mean and slope per interval of a fin that moves by `step(fin, command, dt)` in FINE small steps."""
    fin, found = float(log.fin[0]), []
    for i, h in enumerate(log.steps):
        values = np.empty(FINE)
        for j, command in enumerate(fine_command(log, i)):
            fin = step(fin, command, h / FINE)
            values[j] = fin
        found.append(fine_line(values))
    return found


def assert_same(path: FinPath, expected: list[tuple[float, float]], tolerance: float) -> None:
    np.testing.assert_allclose(path.mean, [m for m, _ in expected], atol=tolerance)
    np.testing.assert_allclose(path.end - path.start, [s for _, s in expected], atol=10.0 * tolerance)


def test_a_delay_of_one_and_a_half_samples_splits_the_step_between_two_intervals():
    path = through("delay", record(np.arange(6) * 0.1, [0.0, 0.2, 0.2, 0.2, 0.2, 0.2], held=True), delay=0.15)
    np.testing.assert_allclose(path.mean, [0.0, 0.0, 0.1, 0.2, 0.2], atol=1e-15)


def test_a_delayed_ramp_is_the_ramp_later_and_its_first_value_before():
    time = np.arange(0.0, 2.0, 0.1)
    path = through("delay", record(time, time, held=False), delay=0.4)
    np.testing.assert_allclose(path.start, np.maximum(time[:-1] - 0.4, 0.0), atol=1e-12)
    np.testing.assert_allclose(path.end, np.maximum(time[1:] - 0.4, 0.0), atol=1e-12)


@pytest.mark.parametrize("held", [True, False])
@pytest.mark.parametrize("delay", [0.013, 0.1, 0.77])
def test_a_delayed_path_agrees_with_the_cumulative_integral(held, delay):
    log = bumpy(held=held)
    path = through("delay", log, delay=delay)
    for i, h in enumerate(log.steps):
        t = log.time[i] + h * (np.arange(FINE) + 0.5) / FINE - delay
        k = np.clip(np.searchsorted(log.time, t, side="right") - 1, 0, log.steps.size - 1)
        share = np.clip((t - log.time[k]) / log.steps[k], 0.0, 1.0)
        command = log.commanded.start[k] + (log.commanded.end[k] - log.commanded.start[k]) * share
        mean, slope = fine_line(np.where(t < log.time[0], log.fin[0], command))
        assert path.mean[i] == pytest.approx(mean, abs=2e-4)
        assert path.end[i] - path.start[i] == pytest.approx(slope, abs=1e-3)


def test_a_delay_keeps_its_slope_after_a_million_seconds():
    """Two running integrals would lose the slope to cancellation on a long log; window sums do not."""
    time = 1e6 + np.arange(0.0, 100.0, 0.05)
    late = through("delay", record(time, np.sin(time), held=False), delay=0.123)
    early = through("delay", record(time - 1e6, np.sin(time), held=False), delay=0.123)
    np.testing.assert_allclose(late.end, early.end, atol=1e-7)


def test_the_lag_answers_a_step_with_one_minus_the_exponential():
    time = np.arange(0.0, 3.0, 0.05)
    path = through("servo_lag", record(time, np.r_[0.0, np.full(time.size - 1, 0.2)], held=True), lag=0.3)
    t0, t1 = time[1:-1] - 0.05, time[2:] - 0.05
    mean = 0.2 - 0.2 * 0.3 / 0.05 * (np.exp(-t0 / 0.3) - np.exp(-t1 / 0.3))
    np.testing.assert_allclose(path.mean[1:], mean, atol=1e-14)


def test_the_lag_follows_a_ramp_one_lag_behind():
    time = np.arange(0.0, 10.0, 0.1)
    path = through("servo_lag", record(time, 0.05 * time, held=False), lag=0.4)
    np.testing.assert_allclose(path.start[50:], 0.05 * (time[50:-1] - 0.4), atol=1e-7)


@pytest.mark.parametrize("held", [True, False])
@pytest.mark.parametrize("lag", [0.004, 0.2, 2.0])
def test_a_lagged_path_agrees_with_small_steps(held, lag):
    log = bumpy(held=held)
    expected = brute(log, lambda fin, u, dt: fin + (u - fin) * -np.expm1(-dt / lag))
    assert_same(through("servo_lag", log, lag=lag), expected, 3e-4)


def test_the_series_of_the_lag_meets_its_closed_form():
    log = record(np.arange(5) * 0.01, [0.0, 0.3, -0.2, 0.1, 0.1], held=True)
    below, above = through("servo_lag", log, lag=1.000001), through("servo_lag", log, lag=0.999999)
    np.testing.assert_allclose(below.start, above.start, atol=1e-6)
    np.testing.assert_allclose(below.end - below.start, above.end - above.start, rtol=1e-5)


def test_no_lag_and_a_lag_too_small_to_see_give_the_command():
    log = bumpy(held=True)
    np.testing.assert_array_equal(through("servo_lag", log, lag=0.0).start, log.fin[:-1])
    np.testing.assert_allclose(through("servo_lag", log, lag=2e-6).mean, log.fin[:-1], atol=1e-4)


def test_a_rate_limited_step_is_a_ramp_with_the_right_area():
    path = through("rate_limit", record([0.0, 1.0, 2.0, 3.0], [0.0, 0.3, 0.3, 0.3], held=True), max_rate=0.2)
    np.testing.assert_allclose(path.mean, [0.0, 0.1, 0.2 + 0.5 * 0.5 * 0.1 + 0.5 * 0.1], atol=1e-15)
    np.testing.assert_allclose([path.start[1], path.end[1]], [0.0, 0.2], atol=1e-15)


def test_a_fast_fin_is_not_limited_on_a_slow_ramp():
    time = np.arange(0.0, 5.0, 0.1)
    path = through("rate_limit", record(time, 0.1 * time, held=False), max_rate=0.100001)
    np.testing.assert_allclose(path.mean, 0.1 * (time[:-1] + 0.05), atol=1e-12)


@pytest.mark.parametrize("held", [True, False])
@pytest.mark.parametrize("max_rate", [0.5, 3.0, 20.0])
def test_a_rate_limited_path_agrees_with_small_steps(held, max_rate):
    log = bumpy(held=held)
    expected = brute(log, lambda fin, u, dt: fin + float(np.clip(u - fin, -max_rate * dt, max_rate * dt)))
    assert_same(through("rate_limit", log, max_rate=max_rate), expected, 3e-4)


def test_the_play_operator_by_hand():
    log = record(np.arange(7.0), [0.0, 0.04, 0.2, 0.15, 0.05, 0.2, 0.2], held=True)
    np.testing.assert_allclose(through("backlash", log, gap=0.1).mean, [0.0, 0.0, 0.15, 0.15, 0.1, 0.15], atol=1e-15)
    behind = through("backlash", log, gap=0.1, gap_start=-1.0).mean  # as it hangs after the command has risen
    np.testing.assert_allclose(behind, [-0.05, -0.01, 0.15, 0.15, 0.1, 0.15], atol=1e-15)


def test_a_moving_command_takes_the_fin_along_once_the_gap_is_crossed():
    path = through("backlash", record([0.0, 1.0, 2.0], [0.0, 0.2, 0.2], held=False), gap=0.2)
    assert path.mean[0] == pytest.approx(0.5 * 0.5 * 0.1)
    assert path.mean[1] == pytest.approx(0.1)


@pytest.mark.parametrize("held", [True, False])
def test_a_path_behind_a_play_agrees_with_small_steps(held):
    log = bumpy(held=held)
    expected = brute(log, lambda fin, u, _dt: min(max(fin, u - 0.06), u + 0.06))
    assert_same(through("backlash", log, gap=0.12), expected, 3e-4)


@pytest.mark.parametrize(
    ("name", "values", "by_hand"),
    [
        ("deadband", {"width": 0.1}, lambda d: np.where(np.abs(d) <= 0.1, 0.0, d - 0.1 * np.sign(d))),
        ("asymmetric_fin", {"asymmetry": 0.3}, lambda d: np.where(d > 0, 1.3 * d, 0.7 * d)),
        (
            "stall",
            {"stall_angle": 0.15, "slope_after": -0.5},
            lambda d: np.where(np.abs(d) <= 0.15, d, np.sign(d) * (0.225 - 0.5 * np.abs(d))),
        ),
    ],
)
@pytest.mark.parametrize("held", [True, False])
def test_a_static_map_keeps_its_mean_across_its_kinks(name, values, by_hand, held):
    log = bumpy(held=held)
    path = through(name, log, **values)
    means = [by_hand(fine_command(log, i)).mean() for i in range(log.steps.size)]
    np.testing.assert_allclose(path.mean, means, atol=1e-6)
    if held:
        np.testing.assert_allclose(path.start, by_hand(log.fin[:-1]), atol=1e-15)


STEPS = {
    "delay": None,
    "servo_lag": lambda fin, u, dt: fin + (u - fin) * -np.expm1(-dt / 0.06),
    "rate_limit": lambda fin, u, dt: fin + float(np.clip(u - fin, -4.0 * dt, 4.0 * dt)),
    "backlash": lambda fin, u, _dt: min(max(fin, u - 0.03), u + 0.03),
    "deadband": lambda _fin, u, _dt: 0.0 if abs(u) <= 0.08 else u - 0.08 * np.sign(u),
    "stall": lambda _fin, u, _dt: u if abs(u) <= 0.2 else np.sign(u) * (0.2 - 0.3 * (abs(u) - 0.2)),
}
VALUES = {"delay": 0.033, "lag": 0.06, "max_rate": 4.0, "gap": 0.06, "width": 0.08, "stall_angle": 0.2, "slope_after": -0.3}


ORDER = ("delay", "rate_limit", "servo_lag", "backlash", "deadband", "stall")


@pytest.mark.parametrize("names", [(b, a) for i, b in enumerate(ORDER[:4]) for a in ORDER[i + 1 :]], ids="+".join)
def test_two_parts_of_the_gear_one_behind_the_other_agree_with_small_steps(names):
    """A jump inside an interval is a line that passes both its ends: a play or a stall behind it must not see that."""
    fine, time = 500, 5.0 + 0.05 * np.arange(60)
    log = record(time, np.repeat(np.random.default_rng(8).uniform(-0.35, 0.35, 12), 5), held=True)
    path = log.commanded
    for name in names:
        path = pick_effect(name).fin(path, VALUES, log)
    fins, expected = dict.fromkeys(names, float(log.fin[0])), []
    for i, h in enumerate(log.steps):
        values = np.empty(fine)
        for j in range(fine):
            t = log.time[i] + h * (j + 0.5) / fine - (VALUES["delay"] if "delay" in names else 0.0)
            u = float(log.fin[max(int(np.searchsorted(log.time, t, side="right")) - 1, 0)])
            for name in names:
                step = STEPS[name]
                u = fins[name] = u if step is None else step(fins[name], u, h / fine)
            values[j] = u
        expected.append(fine_line(values)[0])
    # what lies between the ends of a lagged step is an exponential, not straight pieces
    tolerance = 1e-3 if names[0] == "servo_lag" else 4e-4
    np.testing.assert_allclose(path.mean, expected, atol=tolerance)
    last = fins[names[-1]]
    assert path.last[-1] == pytest.approx(last, abs=tolerance)


def test_a_path_that_hardly_moves_is_mapped_like_one_that_rests():
    log = record([0.0, 1.0, 2.0], [0.2, 0.2 + 3e-7, 0.2 + 6e-6], held=False)
    path = through("stall", log, stall_angle=0.1, slope_after=0.5)
    np.testing.assert_allclose(path.mean, 0.15 + 0.5 * (log.commanded.mean - 0.2), atol=1e-9)


@pytest.mark.parametrize("shape", [{}, {"inertia_share": 0.12}], ids=("of first order", "with inertia"))
def test_the_equivalent_solution_exchanges_the_poles_of_servo_and_hull(shape):
    """Poles and static gain of b2 / ((inertia lag^2 s^2 + lag s + 1) (s + a22)), by the roots of the polynomials."""
    values = {"a22": 2.0, "b2": -3.0, "lag": 1.4} | shape
    other = values | pick_effect("servo_lag").equivalent_solution(values, Axis.YAW)

    def poles_and_gain(v):
        servo = [v.get("inertia_share", 0.0) * v["lag"] ** 2, v["lag"], 1.0]
        return np.sort(np.roots(np.polymul(np.trim_zeros(servo, "f"), [1.0, v["a22"]]))), v["b2"] / v["a22"]

    assert other["lag"] < values["lag"]
    for before, after in zip(poles_and_gain(values), poles_and_gain(other), strict=True):
        np.testing.assert_allclose(after, before, rtol=1e-12)


@pytest.mark.parametrize("shape", [{}, {"inertia_share": 0.12}], ids=("of first order", "with inertia"))
@pytest.mark.parametrize("rate", [-0.4, 0.3])
def test_the_equivalent_solution_of_a_hull_that_drifts_keeps_its_zero_and_its_slow_pole(shape, rate):
    """Poles, zero and static gain of b2 (s + c) / (servo ((s + a22) (s + c) + c_r)), by the roots of the polynomials."""
    values = {"a22": 2.0, "b2": -3.0, "lag": 1.4, "cross_damping": 0.5, "cross_rate": rate} | shape
    other = values | pick_effect("servo_lag").equivalent_solution(values, Axis.YAW)

    def poles_and_gain(v):
        hull = [1.0, v["a22"] + v["cross_damping"], v["a22"] * v["cross_damping"] + v["cross_rate"]]
        servo = [v.get("inertia_share", 0.0) * v["lag"] ** 2, v["lag"], 1.0]
        return np.sort(np.roots(np.polymul(np.trim_zeros(servo, "f"), hull))), v["b2"] * v["cross_damping"] / hull[-1]

    assert other["lag"] < values["lag"]
    assert other["cross_damping"] == values["cross_damping"]
    for before, after in zip(poles_and_gain(values), poles_and_gain(other), strict=True):
        np.testing.assert_allclose(after, before, rtol=1e-9)


@pytest.mark.parametrize(
    "values", [{"a22": -0.1}, {"lag": 0.0}, {"inertia_share": 0.5}, {"cross_damping": 1.0, "cross_rate": 3.0}]
)
def test_what_has_no_pole_to_exchange_has_no_equivalent_solution(values):
    assert pick_effect("servo_lag").equivalent_solution({"a22": 2.0, "b2": -3.0, "lag": 0.4} | values, Axis.YAW) is None
