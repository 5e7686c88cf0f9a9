"""Shapes of records: what is looked through, and that what the tool itself knows of controllers and axes is what they know."""

from __future__ import annotations

import pytest

from fieldsid.models.axis import Axis
from fieldsid.records.check import (
    AXES,
    ShapeError,
    above_zero,
    at_least_one,
    check,
    each,
    flag,
    maybe,
    number,
    one_of,
    text,
    times,
    whole_number,
)
from fieldsid.records.schedule import CONTROLLERS
from fieldsid.schedule.controller import KINDS

SHAPE = {"axis": one_of(AXES), "rows": at_least_one({"u": above_zero(50.0), "ok": flag, "gain?": maybe(number(-1.0, 1.0))})}


def body(**changes):
    return {"axis": "yaw", "rows": [{"u": 1.0, "ok": True, "gain": None, "more": object()}], **changes}


def test_a_record_of_the_shape_is_taken_with_what_it_holds_besides():
    check(body(more=1), SHAPE)
    check(body(rows=[{"u": 1, "ok": False}]), SHAPE)


@pytest.mark.parametrize(
    ("value", "shape", "says"),
    [
        (body(axis="roll"), SHAPE, "`axis` is 'roll', not one of yaw, pitch"),
        (body(axis=[]), SHAPE, "`axis` is []"),
        ({"rows": []}, SHAPE, "`axis` is missing"),
        (body(rows=[]), SHAPE, "`rows` is [], not a list with anything in it"),
        (body(rows={}), SHAPE, "`rows` is {}, not a list"),
        (body(rows=[{"u": 0.0, "ok": True}]), SHAPE, "`rows[0].u` is 0.0, which is not above zero"),
        (body(rows=[{"u": 51.0, "ok": True}]), SHAPE, "must be within"),
        (body(rows=[{"u": "1.0", "ok": True}]), SHAPE, "`rows[0].u` is '1.0', not a finite number"),
        (body(rows=[{"u": float("nan"), "ok": True}]), SHAPE, "not a finite number"),
        (body(rows=[{"u": True, "ok": True}]), SHAPE, "`rows[0].u` is True, not a finite number"),
        (body(rows=[{"u": 1.0, "ok": "no"}]), SHAPE, "`rows[0].ok` is 'no', not true or false"),
        (body(rows=[{"u": 1.0, "ok": True, "gain": -2.0}]), SHAPE, "`rows[0].gain` is -2"),
        (None, SHAPE, "`the record` is None, not keys with values"),
        ({"a": 1e300}, each(number()), "`a` is 1e+300"),
        ([], each(number()), "not keys with values"),
        ([1.0], times(2, number()), "not a list of 2"),
        (-1, whole_number, "not a whole number"),
        (1.0, whole_number, "not a whole number"),
        (b"", text, "not text"),
    ],
)
def test_what_is_wrong_is_told_with_its_place(value, shape, says):
    with pytest.raises(ShapeError) as error:
        check(value, shape)
    assert says in str(error.value)


def test_a_long_value_is_cut_where_it_is_quoted():
    with pytest.raises(ShapeError) as error:
        check({"a": [["x" * 10_000] * 100] * 100}, {"a": flag})
    assert len(str(error.value)) < 2000


def test_the_words_of_records_are_those_of_the_code():
    assert tuple(KINDS) == CONTROLLERS
    assert tuple(a.value for a in Axis) == AXES
