"""The falling error: a bar for each addition, channels that were not measured left out."""

from __future__ import annotations

from math import nan
from pathlib import Path

import pytest

from fieldsid.diagnosis.records import Errors, Pair
from fieldsid.extension.extend import Gain
from fieldsid.extension.lineage import INTACT, Generation, Step
from fieldsid.figures.bars import fall
from fieldsid.figures.history import figure
from fieldsid.models.model import Noise


def gain(before, after, *, angle=True):
    pairs = [Pair(Errors(e if angle else nan, e), Errors(1.2 * e if angle else nan, 1.2 * e)) for e in (before, after)]
    return Gain(("servo_lag",), *pairs, Noise(0.004, 0.004), unseen=True, learned_on=("a",), judged_on=("b",))


def line(*gains):
    steps = [None, *(Step(g, "unseen") for g in gains)]
    return [Generation(Path(f"{i}.yaml"), (), INTACT, s) for i, s in enumerate(steps)]


def test_every_addition_is_a_bar_over_the_noise_on_unseen_runs_with_a_ring_for_the_fitted_ones():
    ((bars,),) = figure(line(gain(0.02, 0.01), gain(0.01, 0.005)), "m.yaml").columns
    assert [b.name for b in bars.rows] == ["plain model", "+ servo_lag", "+ servo_lag"]
    assert [b.value for b in bars.rows] == pytest.approx([6.0, 3.0, 1.5])
    assert [b.ring for b in bars.rows] == pytest.approx([5.0, 2.5, 1.25])
    assert bars.mark == "noise floor"


def test_a_channel_that_was_not_measured_counts_for_nothing():
    ((bars,),) = figure(line(gain(0.02, 0.005, angle=False)), "m.yaml").columns
    assert [b.value for b in bars.rows] == pytest.approx([6.0, 1.5])


def test_the_whole_fall_is_told_in_words():
    gains = [gain(0.02, 0.01), gain(0.01, 0.005)]
    assert fall(gains) == "the error on unseen data goes from 6.00 to 1.50 x the noise floor"
    assert fall([gain(20.0, 0.01)]) == "the error on unseen data goes from 24 rad and 24 rad/s to 0.012 rad and 0.012 rad/s"
