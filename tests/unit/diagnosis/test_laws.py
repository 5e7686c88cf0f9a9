"""The trim's other law is asked of each hypothesis once, beside another question."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from fieldsid.diagnosis import laws
from fieldsid.diagnosis.beside import Beside
from fieldsid.diagnosis.laws import TURNS, Trims
from fieldsid.models.model import Noise

FLOOR = Noise(0.003, 0.003)


def hypothesis(*names, score, fitted=0.0, error=1.0):
    """A hypothesis of some evidence, on all runs and on those fitted to, and its error on unseen ones."""
    errors = SimpleNamespace(mean=error)
    return SimpleNamespace(names=names, score=score, by_run=np.array([fitted]), cost=0.0, judging=errors)


@pytest.fixture
def asked(monkeypatch):
    """The names of the hypotheses that were judged under the other law, whose evidence is 5 more there."""
    names = []

    def better(h, _told):
        names.append(h.names)
        return hypothesis(*h.names, score=h.score + 5.0)

    monkeypatch.setattr(laws, "better_trim", better)
    monkeypatch.setattr(laws, "asks_for_more", lambda _h, _floor: True)
    monkeypatch.setenv("FIELDSID_IS_COPY", "1")  # all in this process, where the calls are counted
    return names


def test_a_hypothesis_is_judged_under_the_other_law_once(asked):
    trims, beside = Trims(), Beside((), ())
    found = hypothesis("delay", score=100.0)
    tried = {frozenset(h.names): h for h in (hypothesis(score=0.0), found, hypothesis("current", score=98.0))}
    for _ in range(2):
        answer, again = trims.asked(found, tried, FLOOR, FLOOR, beside, lambda: "first")
        assert answer == "first"
        assert (again.names, again.score) == (("delay",), 105.0)
    assert sorted(asked) == [(), ("delay",)]
    better = hypothesis("delay", score=101.0)
    assert trims.asked(better, tried | {frozenset(("delay",)): better}, FLOOR, FLOOR, beside, str)[1].score == 106.0
    assert asked.count(("delay",)) == 2


def test_what_has_less_evidence_than_what_was_found_does_not_turn_the_law(asked):
    found = hypothesis("delay", score=100.0)
    tried = {frozenset(): hypothesis(score=90.0), frozenset(("delay",)): found}
    trims = Trims()
    trims.known[("delay",), 100.0] = None
    assert trims.asked(found, tried, FLOOR, FLOOR, Beside((), ()), str)[1] is None
    assert asked == [()]


def test_what_fits_best_is_asked_too_for_the_law_may_hide_it_on_unseen_runs(asked):
    found = hypothesis(score=100.0, fitted=10.0)
    tried = {frozenset(): found, frozenset(("stall",)): hypothesis("stall", score=97.0, fitted=90.0)}
    tried[frozenset(("delay",))] = hypothesis("delay", score=99.0, fitted=20.0)
    assert Trims().asked(found, tried, FLOOR, FLOOR, Beside((), ()), str)[1].names == ()
    assert sorted(asked) == [(), ("stall",)]


@pytest.mark.parametrize(("error", "turns"), [(1.2, True), (3.0, False)])
def test_the_law_is_not_turned_to_where_it_predicts_far_worse(monkeypatch, asked, error, turns):
    monkeypatch.setattr(laws, "better_trim", lambda h, _told: hypothesis(*h.names, score=h.score + 30.0, error=error))
    found = hypothesis("delay", score=100.0)
    tried = {frozenset(): hypothesis(score=0.0), frozenset(("delay",)): found}
    assert (Trims().asked(found, tried, FLOOR, FLOOR, Beside((), ()), str)[1] is not None) == turns


def test_a_search_that_has_turned_twice_asks_no_more(asked):
    found = hypothesis("delay", score=100.0)
    tried = {frozenset(): hypothesis(score=99.0), frozenset(("delay",)): found}
    assert Trims(turned=TURNS).asked(found, tried, FLOOR, FLOOR, Beside((), ()), lambda: 7) == (7, None)
    assert asked == []


def test_a_search_that_comes_back_to_a_law_finds_what_it_had_tried():
    trims, first = Trims(), ({}, {frozenset(): 1.0}, set(), {}, set())
    second = trims.turn("disturbance", first, law=False, other=True)
    assert second == ({}, {}, set(), {}, set())
    assert trims.turn("disturbance", second, law=True, other=False) is first
    assert trims.turn("both", first, law=False, other=True) == ({}, {}, set(), {}, set())
    assert trims.turned == 3
