"""What is not under way is found and left out; a flight that is all under way is left as it was."""

import numpy as np
import pytest

from fieldsid.errors import LogError
from fieldsid.logs.convert.conditioning import refuse_long_gaps
from fieldsid.logs.run import Run
from fieldsid.logs.several.stretches import stretches_of

TIME = 0.1 * np.arange(3000)


def flown(**more):
    signals = {"yaw_rad": np.sin(0.3 * TIME), "rudder_rad": 0.2 * np.sign(np.sin(0.3 * TIME + 0.1)), **more}
    return Run("run", TIME, signals)


def between(start, end):
    return (start <= TIME) & (end > TIME)


def parts(run):
    return [(round(start), round(end)) for start, end in stretches_of(run)[0]]


@pytest.mark.parametrize("signal", ["surge_m_s", "thrust", "propeller_rpm"])
def test_where_no_way_is_made_is_left_out_and_said(signal):
    run = flown(**{signal: np.where(between(0, 40) | between(120, 180), 0.0, 1.5)})
    assert parts(run) == [(40, 120), (180, 300)]
    (note,) = stretches_of(run)[1]
    assert "100 s are left out" in note.message
    assert "--whole" in note.message


def test_a_motor_that_is_off_on_a_vehicle_that_moves_is_a_way_of_flying():
    run = flown(surge_m_s=np.full(TIME.size, 1.0), thrust=np.where(between(100, 200), 0.0, 20.0))
    assert parts(run) == [(0, 300)]
    assert not stretches_of(run)[1]


def test_the_surface_is_left_out_of_a_log_that_dives_and_kept_of_one_that_does_not():
    assert parts(flown(depth_m=np.where(between(80, 140), 0.05, 4.0))) == [(0, 80), (140, 300)]
    assert parts(flown(depth_m=np.full(TIME.size, 0.05))) == [(0, 300)]


def test_a_tail_in_which_nothing_changes_is_left_out():
    last = between(0, 250)
    run = flown()
    held = {s: np.where(last, v, v[last][-1]) for s, v in run.signals.items()}
    assert parts(Run("run", TIME, held)) == [(0, 250)]


def test_a_gap_of_the_log_makes_two_runs():
    time = np.where(TIME < 150, TIME, TIME + 60)
    assert parts(Run("run", time, flown().signals)) == [(0, 150), (210, 360)]


def test_a_short_stop_is_no_reason_to_cut():
    assert parts(flown(surge_m_s=np.where(between(100, 106), 0.0, 1.5))) == [(0, 300)]


@pytest.mark.parametrize(("step", "missing", "refused"), [(4.5, 3, False), (4.5, 9, True), (0.1, 15, False), (0.1, 30, True)])
def test_a_gap_is_judged_by_the_signals_own_steps(step, missing, refused):
    time = step * np.arange(400)
    yaw = np.sin(0.01 * time)
    yaw[100 : 100 + missing] = np.nan
    if not refused:
        refuse_long_gaps(time, {"yaw_rad": yaw})
        return
    with pytest.raises(LogError, match="`yaw_rad` is missing") as error:
        refuse_long_gaps(time, {"yaw_rad": yaw})
    assert "--to 0.00" not in error.value.hint


def test_no_part_is_offered_that_holds_nothing():
    time, yaw = np.arange(40.0), np.full(40, np.nan)
    yaw[[0, 1, 2, 3, 39]] = 0.1
    with pytest.raises(LogError) as error:
        refuse_long_gaps(time, {"yaw_rad": yaw})
    assert "--from" not in error.value.hint
