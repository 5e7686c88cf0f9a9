"""The part of a run worth fitting is found by the fin alone."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldsid.errors import DataError, UsageError
from fieldsid.logs import Run, load_run, segment
from fieldsid.logs.segments import excited_axis, may_show

TIME = 0.05 * np.arange(1200)


def pulses(*, at=20.0, until=30.0, size=0.2, trim=0.0):
    inside = (at <= TIME) & (until > TIME)
    return trim + np.where(inside, size * np.sign(np.sin(np.pi * (TIME - at) / 2 + 1e-6)), 0.0)


def run(fin, **more):
    return Run("r", TIME, {"rudder_rad": fin, **more})


@pytest.mark.parametrize("trim", [0.0, 0.05, -0.1])
def test_pulses_are_taken_with_two_seconds_before_and_ten_after(trim):
    found = segment(run(pulses(trim=trim)), "yaw")
    assert found.start_s == pytest.approx(18.0)
    assert found.end_s == pytest.approx(39.95)
    assert "rudder_rad" in found.why


def test_the_small_work_of_a_controller_is_no_excitation():
    rng = np.random.default_rng(2)
    busy = pulses() + np.where(TIME > 35, 0.02 * np.sin(3 * TIME), 0.0) + 0.004 * rng.normal(size=TIME.size)
    found = segment(run(busy), "yaw")
    assert found.start_s == pytest.approx(18.0, abs=0.1)
    assert found.end_s == pytest.approx(39.95, abs=0.1)


def test_times_are_clipped_to_the_run():
    found = segment(run(pulses(at=1.2, until=55.0)), "yaw")
    assert (found.start_s, found.end_s) == (0.0, TIME[-1])


def test_a_zig_zag_is_taken_whole():
    found = segment(run(0.2 * np.sign(np.sin(0.4 * TIME + 1e-6))), "yaw")
    assert (found.start_s, found.end_s) == (0.0, TIME[-1])
    assert "whole run" in found.why


def test_the_measured_fin_stands_in_for_a_missing_command():
    only = Run("r", TIME, {"elevator_measured_rad": pulses()})
    assert segment(only, "pitch").start_s == pytest.approx(18.0)


def test_no_fin_and_a_constant_fin_are_errors_that_say_what_was_found():
    with pytest.raises(DataError, match="no fin signal for pitch") as error:
        segment(run(pulses()), "pitch")
    assert "--axis yaw" in error.value.hint
    with pytest.raises(DataError, match="no fin signal for yaw") as error:
        segment(Run("r", TIME, {"yaw_rad": TIME, "elevator_rad": np.full(TIME.size, np.nan)}), "yaw")
    assert error.value.hint == "map `rudder_rad` on import"
    with pytest.raises(DataError, match="never leaves its trim") as error:
        segment(run(np.full(TIME.size, 0.1)), "yaw")
    assert "5.73" in error.value.found


def test_a_run_that_excites_one_axis_alone_may_show_nothing_of_the_other():
    still = np.full(TIME.size, 0.1)
    assert not may_show(run(still, elevator_rad=pulses()), "yaw")
    for fins in ((pulses(), still), (still, still), (pulses(), pulses())):
        assert may_show(run(fins[0], elevator_rad=fins[1]), "yaw")


def test_a_segment_cuts_its_run():
    whole = run(pulses())
    found = segment(whole, "yaw")
    part = found.of(whole)
    assert part.time[0] >= found.start_s - 1e-9
    assert part.time[-1] <= found.end_s + 1e-9


@given(st.floats(5, 30), st.floats(2, 20), st.floats(0.05, 0.5), st.floats(-0.2, 0.2), st.sampled_from([-1, 1]))
def test_every_pulse_lies_inside_its_segment(at, length, size, trim, side):
    fin = np.where((at <= TIME) & (at + length > TIME), trim + side * size, trim)
    found = segment(run(fin), "yaw")
    assert found.start_s <= at
    assert found.end_s >= min(at + length, TIME[-1]) - 0.06


@pytest.mark.parametrize("axis", ["yaw", "pitch"])
def test_the_axis_that_runs_excite_is_that_whose_fin_leaves_its_trim(axis):
    moved = {"yaw": "rudder_rad", "pitch": "elevator_rad"}
    fins = {fin: pulses() if of == axis else 0.004 * np.sin(3 * TIME) for of, fin in moved.items()}
    assert excited_axis([Run("r", TIME, fins), run(0.0 * TIME)], written="") == axis


@pytest.mark.parametrize(
    ("signals", "error", "found"),
    [
        ({"rudder_rad": pulses(), "elevator_rad": pulses()}, UsageError, "yaw in 1 of 1, pitch in 1 of 1"),
        ({"rudder_rad": 0.0 * TIME, "elevator_rad": 0.0 * TIME}, UsageError, "yaw in 0 of 1, pitch in 0 of 1"),
        ({"elevator_rad": 0.0 * TIME}, UsageError, "no fin for yaw (`rudder_rad`), pitch in 0 of 1"),
        ({"yaw_rad": pulses()}, DataError, "yaw_rad"),
    ],
    ids=["both", "neither", "one missing", "no fin"],
)
def test_no_axis_is_guessed(signals, error, found):
    with pytest.raises(error) as raised:
        excited_axis([Run("r", TIME, signals)], written="`{axis}`")
    assert found in raised.value.found
    assert ("write `" in str(raised.value.hint)) is (error is UsageError)
    assert ("`yaw`" in str(raised.value.hint)) is ("rudder_rad" in signals)
    assert ("map `rudder_rad`" in str(raised.value.hint)) is ("rudder_rad" not in signals)


def test_the_error_of_a_missing_fin_names_the_columns_that_are_not_used(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("time_s,yaw_rad,yaw_rate_rad_s,elevator_rad,servo1\n" + "".join(f"{t},0,0,0,{t}\n" for t in range(9)))
    with pytest.raises(DataError, match="no fin signal for yaw") as error:
        segment(load_run(log), "yaw")
    assert "map `rudder_rad` on import: not used of the log are `servo1`, or take the other axis" in error.value.hint
