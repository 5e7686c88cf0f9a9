"""A moment that goes with the compass is looked for only where enough of it was flown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldsid.diagnosis.data.heading_span import heading_span, shown_by_headings
from fieldsid.dynamics.free_run import command_record
from fieldsid.effects import all_effects
from fieldsid.models.axis import Axis

EFFECTS = tuple(all_effects(Axis.YAW).values())


def run(*headings_deg: float, measured: bool = True):
    """A run that keeps some headings."""
    angle = np.radians(headings_deg)
    made = command_record(Axis.YAW, 0.1 * np.arange(angle.size), np.zeros(angle.size), speed=1.5)
    return replace(made, angle=angle, angle_ok=np.full(angle.size, measured))


@pytest.mark.parametrize(
    ("headings", "span"),
    [
        ((-20.0, 0.0, 25.0), 45.0),
        ((350.0, 10.0, 375.0), 25.0),
        ((170.0, -170.0), 20.0),
        ((0.0, 90.0, 180.0, 270.0), 270.0),
    ],
)
def test_the_span_is_the_least_arc_that_holds_all(headings, span):
    assert heading_span([run(*headings)]) == pytest.approx(np.radians(span))


@given(st.lists(st.floats(-720.0, 720.0), min_size=2, max_size=8), st.floats(-360.0, 360.0))
def test_where_north_lies_changes_nothing(headings, turned):
    here, there = (heading_span([run(*np.add(headings, by))]) for by in (0.0, turned))
    assert here == pytest.approx(there, abs=1e-9)


def test_runs_along_one_course_show_no_current():
    kept, left = shown_by_headings(EFFECTS, [run(-20.0, 20.0), run(-5.0, 25.0)], known=())
    assert {e.name for e in EFFECTS} - {e.name for e in kept} == {"current"} == set(left)
    assert left["current"].endswith("at least 90 deg apart, and the runs keep within 45 deg")


def test_runs_on_two_courses_may_show_one():
    kept, left = shown_by_headings(EFFECTS, [run(-20.0, 20.0), run(80.0, 110.0)], known=())
    assert (kept, left) == (EFFECTS, {})


def test_one_that_the_model_has_stays():
    kept, left = shown_by_headings(EFFECTS, [run(-20.0, 20.0)], known=("current",))
    assert (kept, left) == (EFFECTS, {})


def test_without_a_heading_there_is_none_to_show():
    _, left = shown_by_headings(EFFECTS, [run(0.0, 180.0, measured=False)], known=())
    assert left["current"].endswith("none is measured")
