"""Bars of models: errors over the floor, the named one apart, and no scale for what makes things worse."""

from __future__ import annotations

from math import nan
from types import SimpleNamespace

from matplotlib.colors import to_rgba

from fieldsid.diagnosis.records import Errors, Pair
from fieldsid.figures import canvas
from fieldsid.figures.bars import errors
from fieldsid.figures.diagnose import words_of
from fieldsid.figures.drawn import draw_bars
from fieldsid.models.model import Noise

FLOOR = Noise(0.01, 0.01)


def model(name, fitted, unseen, says=""):
    return name, Pair(*(Errors(0.01 * e, 0.01 * e) for e in (fitted, unseen))), FLOOR, says


BASE, NAMED, WORSE = model("model as it is", 3.0, 3.2), model("servo_lag", 1.0, 1.1, ", sure"), model("clock_offset", 90.0, 95.0)


def drawn(*models, noiseless=False):
    ax = canvas.sheet(9.0, 7.0).add_subplot()
    draw_bars(errors(models, "servo_lag", noiseless=noiseless), ax)
    return ax


def test_the_named_effect_stands_out():
    ax = drawn(BASE, NAMED)
    assert [p.get_facecolor() for p in ax.patches] == [to_rgba(canvas.QUIET), to_rgba(canvas.SIMULATED)]
    assert [round(p.get_width(), 3) for p in ax.patches] == [3.2, 1.1]
    assert [t.get_text() for t in ax.texts] == ["3.20 x", "1.10 x, sure"]


def test_a_candidate_that_makes_things_worse_does_not_set_the_scale():
    assert drawn(BASE, NAMED, WORSE).get_xlim()[1] < 20.0


def test_without_unseen_runs_the_fitted_ones_are_the_bars():
    bars = errors([model("model as it is", 3.0, nan), model("servo_lag", 1.0, nan)], "servo_lag", noiseless=False)
    assert [round(b.value, 3) for b in bars.rows] == [3.0, 1.0]
    assert (bars.name, bars.ring_name) == ("fitted runs", "")


def test_the_words_of_a_candidate_say_the_share_explained_and_its_probability():
    assert words_of(SimpleNamespace(worse=False, explained=0.98, probability=0.97)) == ", 98 % explained, probability 0.970"
    assert words_of(SimpleNamespace(worse=True, explained=0.0, probability=0.001)) == ", worse, probability 0.001"


def test_without_noise_the_bars_are_over_the_error_of_the_model_as_it_is_and_no_floor_is_drawn():
    ax = drawn(BASE, NAMED, noiseless=True)
    assert ax.get_xlabel() == "free-run error over that of the model as it is"
    assert set(ax.get_legend_handles_labels()[1]) == {"unseen runs", "fitted runs"}
    assert [round(p.get_width(), 3) for p in ax.patches] == [1.0, round(1.1 / 3.2, 3)]
    assert ax.texts[0].get_text() == "1.8 deg and 1.8 deg/s"
