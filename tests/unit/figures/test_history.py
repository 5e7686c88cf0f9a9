"""The falling error: in degrees, one line per addition, channels that were not measured left out."""

from __future__ import annotations

from math import degrees, nan
from pathlib import Path

import pytest

from fieldsid.diagnosis.records import Errors, Pair
from fieldsid.extension.extend import Gain
from fieldsid.extension.lineage import INTACT, Generation, Step
from fieldsid.figures.history import falls_of, figure, summary
from fieldsid.models.model import Noise


def gain(before, after, *, angle=True):
    pairs = [Pair(Errors(e if angle else nan, e), Errors(1.2 * e if angle else nan, 1.2 * e)) for e in (before, after)]
    return Gain(("servo_lag",), *pairs, Noise(0.004, 0.004), unseen=True, learned_on=("a",), judged_on=("b",))


def line(*gains):
    steps = [None, *(Step(g, "unseen") for g in gains)]
    return [Generation(Path(f"{i}.yaml"), (), INTACT, s) for i, s in enumerate(steps)]


def test_errors_are_shown_in_degrees_on_unseen_and_fitted_runs():
    (fall,) = falls_of([gain(0.02, 0.005)], "rate")
    assert fall.unseen == pytest.approx((degrees(0.024), degrees(0.006)))
    assert fall.fitted == pytest.approx((degrees(0.02), degrees(0.005)))
    assert fall.floor == pytest.approx(degrees(0.004))


def test_a_channel_that_was_not_measured_has_no_panel():
    assert falls_of([gain(0.02, 0.005, angle=False)], "angle") == []
    assert len(figure(line(gain(0.02, 0.005, angle=False)), "m.yaml").axes) == 1
    assert len(figure(line(gain(0.02, 0.005)), "m.yaml").axes) == 2


def test_every_addition_is_a_place_on_the_axis_and_the_floor_is_drawn():
    (ax, _) = figure(line(gain(0.02, 0.01), gain(0.01, 0.005)), "m.yaml").axes
    assert [t.get_text() for t in ax.get_xticklabels()] == ["plain model", "+servo_lag", "+servo_lag"]
    assert ax.get_ylim()[0] == 0.0
    assert ax.collections[0].get_segments()[0][0][1] == pytest.approx(degrees(0.004))


def test_the_whole_fall_is_told_in_words():
    assert summary([gain(0.02, 0.01), gain(0.01, 0.005)]) == "error on unseen runs from 6.00 to 1.50 x the noise floor"
