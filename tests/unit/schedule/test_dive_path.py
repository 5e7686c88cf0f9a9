"""Where a pitch leads to: heave and buoyancy, flown here by equations of their own, are found in the depths of runs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fieldsid.errors import DataError
from fieldsid.logs.run import Run
from fieldsid.plant.parameter_source import load_parameter_source
from fieldsid.schedule.dive_path import PATH_OF_PITCH, dive_path_of
from fieldsid.schedule.make import design_schedule
from fieldsid.schedule.verify import verify_schedule
from fieldsid.schedule.wish import Wish
from fieldsid.views.verification import VIEW

LENGTH_M, LIFT, BASE = 1.5, -0.06, {"c22": 1.0, "c23": 0.5, "d2": -1.2, "Cb": -0.02}
"""The heave w of a buoyant hull decays at u/LENGTH_M, and level flight takes the pitch LIFT/u^2."""


def dive(speed, sign=1.0, noise=0.02):
    """A run of 60 s of a pitch that swings about level flight: z' = -u sin(theta) + w cos(theta), w a state of its own."""
    time, rng = np.arange(0.0, 60.0, 0.1), np.random.default_rng(round(100 * speed))
    pitch = LIFT / speed**2 + 0.15 * np.sin(0.5 * time) + 0.1 * np.sin(0.17 * time**1.2)

    def slope(t, state):
        angle = np.interp(t, time, pitch)
        incidence = angle - state[0]  # w = u (theta - gamma)
        return speed / LENGTH_M * (incidence - LIFT / speed**2), -speed * np.sin(angle - incidence)

    flown = solve_ivp(slope, (0.0, 60.0), (0.0, 5.0), t_eval=time, max_step=0.05)
    depth = sign * flown.y[1] + noise * rng.standard_normal(time.size)
    return Run(f"dive{speed}", time, {"depth_m": depth, "pitch_rad": pitch, "surge_m_s": np.full(time.size, speed)})


@pytest.fixture
def source(tmp_path):
    """A table of a pitch model at 1 m/s."""
    path = tmp_path / "pitch.csv"
    path.write_text(f"speed_m_s,{','.join(BASE)}\n1.0,{','.join(map(str, BASE.values()))}\n")
    return load_parameter_source([path])


def test_length_and_lift_are_those_of_the_hull_at_every_speed():
    found = dive_path_of([dive(0.8), dive(1.2)])
    assert found.measured
    assert found.length == pytest.approx(LENGTH_M, rel=0.15)
    assert found.lift == pytest.approx(LIFT, rel=0.05)
    assert dive_path_of([]) is PATH_OF_PITCH


def test_a_depth_that_goes_against_its_pitch_has_no_depth_loop(source):
    with pytest.raises(DataError, match="run away"):
        design_schedule(source, 0.3, wish=Wish("pd"), depth=True, runs=[dive(1.0, sign=-1.0)])


def flown(row, to):
    """The depths (n,) m, at every 0.02 s, of 40 s with the depth zero wanted and 60 s with the depth `to`."""
    gains, time = row.gains, np.arange(0.0, 100.0, 0.02)

    def slope(t, state):
        pitch, rate, path, depth = state
        wanted = float(np.clip(row.depth_gain * (depth - (to if t > 40.0 else 0.0)), -0.349, 0.349))
        fin = gains.kp * (wanted - pitch) - gains.kd * rate + row.feed_forward + row.reference_gain * wanted
        moment = -BASE["c22"] * rate - BASE["c23"] * pitch + BASE["d2"] * float(np.clip(fin, -0.3, 0.3)) + BASE["Cb"]
        return rate, moment, (pitch - LIFT - path) / LENGTH_M, -np.sin(path)

    return time, solve_ivp(slope, (0.0, 100.0), (LIFT, 0.0, 0.0, 0.0), t_eval=time, max_step=0.02).y[3]


def test_the_depth_that_is_held_off_and_the_step_are_those_of_the_hull(source):
    runs = [dive(1.0)]
    schedule = design_schedule(source, 0.3, wish=Wish("pd"), depth=True, runs=runs)
    checked = verify_schedule(schedule, source, draws=1, runs=runs)
    (row,), (check,), settled, over = schedule.rows, checked.scheduled, [], []
    for side in (1.0, -1.0):
        time, depth = flown(row, 2.0 * side)
        held = depth[time < 40.0][-1]
        moved = side * (depth[time >= 40.0] - held)
        settled.append(0.02 * np.flatnonzero(np.abs(moved - 2.0) > 0.1)[-1])
        over.append(max(moved.max() - 2.0, 0.0) / 2.0)
    assert held < -0.1
    assert check.depth_error == pytest.approx(held, rel=0.05)
    assert check.depth_settling == pytest.approx(max(settled), rel=0.1)
    assert check.depth_overshoot == pytest.approx(max(over), abs=0.02)
    said = " ".join(str(VIEW.page(checked)).split())
    assert f"a depth is held {-check.depth_error:.2f} m too shallow at 1.00 m/s, where level flight takes a pitch of -3." in said
    alone = " ".join(str(VIEW.page(verify_schedule(schedule, source, draws=1))).split())
    assert "no run has a depth that goes with its pitch and speed: the path is taken as the pitch" in alone
