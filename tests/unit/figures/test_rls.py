"""Recursive estimates over time: bands, settle times, and a scale that a wild start does not spoil."""

from __future__ import annotations

import numpy as np

from fieldsid.figures import rls
from fieldsid.figures.drawn import rendered
from fieldsid.fitting.problem.estimator import History


def view():
    time = np.arange(0.0, 30.0, 0.05)
    values = np.column_stack([1.5 * (1 - np.exp(-time / 4)), np.where(time < 1, 1e4, -3.0)])
    errors = np.column_stack([0.5 * np.exp(-time / 5) + 0.02, np.where(time < 1, 1e4, 0.05)])
    return History(time + 100.0, ("a22", "b2"), values, errors, {"a22": 17.5, "b2": float("nan")})


def test_each_parameter_has_a_panel_with_its_unit_and_settle_time():
    first, second = rendered(rls.figure(view(), {"a22": "1/s", "b2": "1/s^2"}, "run7")).axes
    assert (first.get_ylabel(), second.get_ylabel()) == ("a22, 1/s", "b2, 1/s^2")
    assert [t.get_text() for t in first.texts] == ["after 17.5 s"]
    assert [line.get_xdata()[0] for line in first.lines if line.get_label() == "settled"] == [117.5]
    assert [t.get_text() for t in second.texts] == ["not settled"]
    assert first.figure.figure.get_suptitle() == "run7: a22 settled after 17.5 s, b2 did not"


def test_a_wild_start_does_not_set_the_scale():
    low, high = rendered(rls.figure(view(), {"a22": "1/s", "b2": "1/s^2"}, "run7")).axes[1].get_ylim()
    assert -5 < low < -3
    assert high < 1
