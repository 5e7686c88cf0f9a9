"""The robust circle: exact on its own data, in a current, with outliers, with an error that covers; refusals."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.errors import DataError
from fieldsid.logs.run import Run
from fieldsid.turning.measured.circle import fit_circle
from fieldsid.turning.measured.measured_turn import measure_turn


def track(radius=3.0, turns=2.0, n=600, noise=0.0, current=(0.0, 0.0), seed=0, centre=(10.0, -4.0)):
    rng, time = np.random.default_rng(seed), np.linspace(0.0, 40.0, n)
    angle = 0.4 + 2.0 * np.pi * turns * time / time[-1]
    x = centre[0] + radius * np.cos(angle) + current[0] * time + noise * rng.standard_normal(n)
    y = centre[1] + radius * np.sin(angle) + current[1] * time + noise * rng.standard_normal(n)
    return time, x, y


def heading_of(n=600, turns=2.0):
    """The heading of `track`, a quarter turn before the angle at the centre and off by a drift."""
    return 0.4 + 0.5 * np.pi + 0.15 + 2.0 * np.pi * turns * np.linspace(0.0, 1.0, n)


@pytest.mark.parametrize("current", [(0.0, 0.0), (0.05, -0.02), (-0.5, 0.4)])
def test_clean_track_gives_its_circle_whatever_the_current(current):
    circle = fit_circle(*track(current=current), heading_of())
    assert circle.radius == pytest.approx(3.0, rel=1e-6)
    assert circle.centre == pytest.approx((10.0, -4.0), abs=1e-5)
    assert circle.current == pytest.approx(current, abs=1e-6)


@pytest.mark.parametrize("share", [0.02, 0.1])
def test_outliers_hardly_move_it(share):
    time, x, y = track(noise=0.05, seed=3)
    rng = np.random.default_rng(4)
    bad = rng.random(x.size) < share
    x = x + bad * rng.normal(0.0, 4.0, x.size)
    assert fit_circle(time, x, y, heading_of()).radius == pytest.approx(3.0, rel=0.005)


def test_missing_fixes_are_passed_over():
    time, x, y = track(noise=0.02)
    x[100:180] = np.nan
    assert fit_circle(time, x, y, heading_of()).radius == pytest.approx(3.0, rel=0.003)


@pytest.mark.parametrize("coloured", [False, True])
def test_its_95_percent_interval_covers_as_often_as_it_says(coloured):
    hits = 0
    for seed in range(60):
        time, x, y = track(n=300, noise=0.0 if coloured else 0.1)
        if coloured:
            rng = np.random.default_rng(seed)
            noise = np.zeros((2, 300))
            for i in range(1, 300):
                noise[:, i] = 0.9 * noise[:, i - 1] + 0.05 * rng.standard_normal(2)
            x, y = x + noise[0], y + noise[1]
        else:
            time, x, y = track(n=300, noise=0.1, seed=seed)
        low, high = fit_circle(time, x, y, heading_of(n=300)).interval95
        hits += int(low <= 3.0 <= high)
    assert hits >= 52


def test_a_short_arc_a_line_and_too_few_points_are_refused():
    with pytest.raises(DataError, match="too short an arc"):
        fit_circle(*track(turns=0.15, noise=0.01), heading_of(turns=0.15))
    with pytest.raises(DataError, match="too few positions"):
        fit_circle(*(v[:5] for v in track()), heading_of()[:5])
    time = np.linspace(0.0, 10.0, 50)
    with pytest.raises(DataError, match="too short an arc"):
        fit_circle(time, time, 2.0 * time, np.full(50, np.arctan(2.0)))


def test_positions_that_stay_are_no_circle():
    with pytest.raises(DataError, match="does not leave its first position"):
        fit_circle(np.linspace(0.0, 10.0, 50), np.full(50, 4e6), np.full(50, 7.0), np.linspace(0.0, 7.0, 50))


def test_headings_that_are_missing_are_passed_over():
    time, x, y = track()
    heading = heading_of()
    heading[7] = np.nan
    assert fit_circle(time, x, y, heading).radius == pytest.approx(3.0, rel=1e-3)


def turning_run(rate=0.3, run_in=10.0, seed=1, with_surge=True, turns=True):
    """Straight for run_in seconds, then a turn whose rate overshoots and settles, speed falling."""
    rng, time = np.random.default_rng(seed), np.arange(0.0, 60.0, 0.05)
    after = np.maximum(time - run_in, 0.0)
    r = np.where(after > 0, rate * (1.0 + 1.2 * np.exp(-after / 2.0) - 2.2 * np.exp(-after / 0.8)), 0.0) * turns
    surge = 1.5 - 0.4 * np.where(after > 0, 1.0 - np.exp(-after / 1.5), 0.0)
    yaw = np.cumsum(r) * 0.05
    x, y = np.cumsum(surge * np.cos(yaw)) * 0.05 + 0.1 * time, np.cumsum(surge * np.sin(yaw)) * 0.05
    signals = {
        "yaw_rad": yaw, "yaw_rate_rad_s": r + 0.003 * rng.standard_normal(r.size), "x_m": x + 0.05 * rng.standard_normal(r.size),
        "y_m": y + 0.05 * rng.standard_normal(r.size), "rudder_rad": np.where(after > 0, -np.sign(rate) * 0.35, 0.0),
    }  # fmt: skip
    if with_surge:
        signals["surge_m_s"] = surge
    return Run("turn", time, signals)


@pytest.mark.parametrize(("rate", "side"), [(0.3, "starboard"), (-0.3, "port")])
def test_the_settled_part_is_found_and_the_run_in_left_out(rate, side):
    turn = measure_turn(turning_run(rate))
    assert turn.side == side
    assert turn.start_s > 13.0
    assert turn.circle.radius == pytest.approx(1.1 / 0.3, rel=0.01)
    assert turn.circle.current == pytest.approx((0.1, 0.0), abs=0.005)
    assert turn.entry_speed == pytest.approx(1.5, rel=0.02)
    assert turn.fin == pytest.approx(-np.sign(rate) * 0.35)


def test_speed_over_ground_stands_in_for_surge_before_the_turn():
    assert measure_turn(turning_run(with_surge=False)).entry_speed == pytest.approx(1.6, rel=0.03)


def test_a_run_that_does_not_turn_or_has_no_position_is_refused():
    with pytest.raises(DataError, match="does not turn"):
        measure_turn(turning_run(turns=False))
    run = turning_run()
    with pytest.raises(DataError, match="no position"):
        measure_turn(Run("bare", run.time, {k: v for k, v in run.signals.items() if k not in ("x_m", "y_m")}))
