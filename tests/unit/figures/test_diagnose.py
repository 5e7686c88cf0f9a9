"""The candidates' bars: errors over the floor, the named one apart, and no scale for what makes things worse."""

from __future__ import annotations

from dataclasses import replace
from math import nan

from matplotlib.colors import to_rgba

from fieldsid.figures import canvas
from fieldsid.figures.diagnose import Bar, draw, words_of

BASE = Bar("model as it is", 3.0, 3.2, "3.20 x", 0.0, None, named=False)
NAMED = Bar("servo_lag", 1.0, 1.1, "1.10 x", 0.98, 0.97, named=True)
WORSE = Bar("clock_offset", 90.0, 95.0, "95.00 x", 0.0, 0.001, named=False, worse=True)


def drawn(*bars):
    ax = canvas.sheet().add_subplot()
    draw(list(bars), ax)
    return ax


def test_the_named_effect_stands_out():
    ax = drawn(BASE, NAMED)
    colours = [p.get_facecolor() for p in ax.patches]
    assert colours == [to_rgba(canvas.QUIET), to_rgba(canvas.SIMULATED)]
    assert [round(p.get_width(), 3) for p in ax.patches] == [3.2, 1.1]


def test_a_candidate_that_makes_things_worse_does_not_set_the_scale():
    assert drawn(BASE, NAMED, WORSE).get_xlim()[1] < 20.0


def test_without_unseen_runs_the_fitted_ones_are_the_bars():
    named = Bar("servo_lag", 1.0, nan, "1.00 x", 0.98, 0.97, named=True)
    ax = drawn(Bar("model as it is", 3.0, nan, "3.00 x", 0.0, None, named=False), named)
    assert [p.get_width() for p in ax.patches] == [3.0, 1.0]
    assert "unseen runs" not in [t.get_text() for t in ax.get_legend().get_texts()]


def test_a_bar_says_error_share_explained_and_probability():
    assert words_of(NAMED) == "1.10 x, 98 % explained, probability 0.970"
    assert words_of(WORSE) == "95.00 x, worse, probability 0.001"
    assert words_of(BASE) == "3.20 x"


def test_without_noise_the_bars_are_over_the_error_of_the_model_as_it_is_and_no_floor_is_drawn():
    ax = canvas.sheet().add_subplot()
    draw([replace(BASE, unseen=1.0, says="0.12 rad and 0.0072 rad/s"), replace(NAMED, unseen=0.3)], ax, noiseless=True)
    assert ax.get_xlabel() == "free-run error over that of the model as it is"
    assert {t.get_text() for t in ax.get_legend().get_texts()} == {"unseen runs", "fitted runs"}
    assert ax.texts[0].get_text() == "0.12 rad and 0.0072 rad/s"
