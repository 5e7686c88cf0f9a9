"""The trim's other law is asked of each hypothesis once, beside another question."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from fieldsid.diagnosis import laws
from fieldsid.diagnosis.beside import Beside
from fieldsid.diagnosis.laws import TURNS, Trims
from fieldsid.models.model import Noise

FLOOR = Noise(0.003, 0.003)


def hypothesis(*names, score):
    return SimpleNamespace(names=names, score=score)


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


def test_a_search_that_has_turned_twice_asks_no_more(asked):
    found = hypothesis("delay", score=100.0)
    tried = {frozenset(): hypothesis(score=99.0), frozenset(("delay",)): found}
    assert Trims(turned=TURNS).asked(found, tried, FLOOR, FLOOR, Beside((), ()), lambda: 7) == (7, None)
    assert asked == []
