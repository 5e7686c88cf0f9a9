"""Holes in a fin's log: found where a step is usual, cut out where they hide a move, and never where a command waits."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.logs.doctor.holes import hiding, hole_notes, holes_of, unbroken, usual_step
from fieldsid.logs.doctor.signal_findings import signal_findings
from fieldsid.logs.doctor.stated import Stated
from fieldsid.logs.run import Run

TIME = 0.1 * np.arange(600)


def switched(*at):
    """A fin that goes from one side to the other at some times."""
    return 0.2 * (-1.0) ** sum((t <= TIME).astype(int) for t in at)


def without(fin, start, end):
    return np.where((start < TIME) & (end > TIME), np.nan, fin)


def test_a_hole_is_found_with_what_was_before_and_after():
    fin = without(switched(10.0), 9.45, 10.65)
    (hole,) = holes_of(TIME, fin)
    assert (hole.start_s, hole.end_s) == pytest.approx((9.4, 10.7))
    assert (hole.before, hole.after) == (0.2, -0.2)
    assert hiding(TIME, fin) == (hole,)
    assert hiding(TIME, without(switched(10.0), 19.45, 20.65)) == ()


def test_a_clock_that_was_set_under_way_hides_moves_and_a_hole_shorter_than_a_rest_does_not():
    fin = switched(*range(4, 60, 5))
    rows = TIME < 35.45
    late = {gap: Run("log", np.where(rows, TIME, TIME + gap), {"rudder_rad": fin}) for gap in (2.0, 1.7e9)}
    assert unbroken(late[2.0], "rudder_rad") is late[2.0]
    assert unbroken(late[1.7e9], "rudder_rad").time[-1] == pytest.approx(35.4)
    (note,) = hole_notes(late[1.7e9], "rudder_rad")
    assert "longer than it ever rests: when it moved is not in the log" in note.message


def test_a_few_samples_less_are_no_hole():
    assert holes_of(TIME, without(switched(10.0), 9.85, 10.25)) == ()


def test_a_command_that_is_published_when_it_changes_has_no_holes():
    fin = np.full(TIME.size, np.nan)
    fin[[0, 40, 43, 120, 260, 300, 480]] = [0.0, 0.2, -0.2, 0.2, 0.0, 0.1, 0.0]
    assert holes_of(TIME, fin) == ()
    assert usual_step(np.diff(TIME[np.isfinite(fin)])) is None


def test_a_slow_command_on_a_fast_clock_has_no_holes():
    assert holes_of(TIME, np.where(np.arange(600) % 10 == 0, switched(10.0, 20.0), np.nan)) == ()


def test_the_part_in_which_the_fin_moves_most_is_kept():
    run = Run("r", TIME, {"rudder_rad": without(switched(10.0, 20.0, 30.0, 40.0), 19.45, 20.65), "yaw_rad": TIME})
    part = unbroken(run, "rudder_rad")
    assert (part.time[0], part.time[-1]) == pytest.approx((20.7, 59.9))
    (note,) = hole_notes(run, "rudder_rad")
    assert "missing for 1.30 s from 19.40 s and is at 0.2 rad then, not at -0.2" in note.message
    assert "20.70 .. 59.90 s are used" in note.message


def test_a_whole_run_is_returned_as_it_is():
    run = Run("r", TIME, {"rudder_rad": switched(10.0)})
    assert unbroken(run, "rudder_rad") is run
    assert hole_notes(run, "rudder_rad") == ()


def test_nothing_is_missing_of_a_command_that_is_published_when_it_changes():
    fin = np.full(TIME.size, np.nan)
    fin[[0, 30, 60, 90, 120, 180, 240, 270, 300]] = [0.0, 0.2, -0.2, 0.0, 0.2, -0.2, 0.0, -0.2, 0.2]
    assert _codes(fin) == []
    fin = np.where(np.arange(TIME.size) % 3 == 0, np.nan, switched(10.0))
    assert _codes(fin) == ["missing"]


def _codes(fin):
    run = Run("run", TIME, {"yaw_rad": np.sin(TIME), "rudder_rad": fin})
    return [n.code for n in signal_findings(run, "rudder_rad", Stated())]
