"""The trim's other law is asked of each hypothesis once, beside another question."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from fieldsid.diagnosis.parallel_map import ParallelMap
from fieldsid.diagnosis.search import speed_law_search
from fieldsid.diagnosis.search.speed_law_search import MAX_TRIM_SWITCHES, TrimLawSearch
from fieldsid.models.model import Noise

FLOOR = Noise(0.003, 0.003)


def hypothesis(*names, score, fitted=0.0, error=1.0):
    """A hypothesis of some evidence, on all runs and on those fitted to, and its error on unseen ones."""
    errors = SimpleNamespace(mean=error)
    return SimpleNamespace(
        names=names,
        log_evidence=score,
        training_evidence=fitted,
        selection_errors=errors,
        unseen_errors=(errors,),
    )


@pytest.fixture
def asked(monkeypatch):
    """The names of the hypotheses that were judged under the other law, whose evidence is 5 more there."""
    names = []

    def better(h, _told):
        names.append(h.names)
        return hypothesis(*h.names, score=h.log_evidence + 5.0)

    monkeypatch.setattr(speed_law_search, "other_trim_law", better)
    monkeypatch.setattr(speed_law_search, "_prior_log_odds", lambda _h: 0.0)
    monkeypatch.setattr(speed_law_search, "leaves_error", lambda _h, _floor: True)
    monkeypatch.setenv("FIELDSID_IS_WORKER", "1")  # all in this process, where the calls are counted
    return names


def test_a_hypothesis_is_judged_under_the_other_law_once(asked):
    trims, beside = TrimLawSearch(), ParallelMap((), ())
    found = hypothesis("delay", score=100.0)
    tried = {frozenset(h.names): h for h in (hypothesis(score=0.0), found, hypothesis("current", score=98.0))}
    for _ in range(2):
        answer, again = trims.best_alternative(found, tried, FLOOR, FLOOR, beside, lambda: "first")
        assert answer == "first"
        assert (again.names, again.log_evidence) == (("delay",), 105.0)
    assert sorted(asked) == [(), ("current",), ("delay",)]
    better = hypothesis("delay", score=101.0)
    assert (
        trims.best_alternative(better, tried | {frozenset(("delay",)): better}, FLOOR, FLOOR, beside, str)[1].log_evidence
        == 106.0
    )
    assert asked.count(("delay",)) == 2


def test_what_has_less_evidence_than_what_was_found_does_not_turn_the_law(asked):
    found = hypothesis("delay", score=100.0)
    tried = {frozenset(): hypothesis(score=90.0), frozenset(("delay",)): found}
    trims = TrimLawSearch()
    trims.known[("delay",), 100.0] = None
    assert trims.best_alternative(found, tried, FLOOR, FLOOR, ParallelMap((), ()), str)[1] is None
    assert asked == [()]


def test_what_fits_best_is_asked_too_for_the_law_may_hide_it_on_unseen_runs(asked):
    found = hypothesis(score=100.0, fitted=10.0)
    tried = {frozenset(): found, frozenset(("stall",)): hypothesis("stall", score=97.0, fitted=90.0)}
    tried[frozenset(("delay",))] = hypothesis("delay", score=99.0, fitted=20.0)
    assert TrimLawSearch().best_alternative(found, tried, FLOOR, FLOOR, ParallelMap((), ()), str)[1].names == ()
    assert sorted(asked) == [(), ("delay",), ("stall",)]


@pytest.mark.parametrize(("error", "turns"), [(1.2, True), (3.0, False)])
def test_the_law_is_not_turned_to_where_it_predicts_far_worse(monkeypatch, asked, error, turns):
    monkeypatch.setattr(
        speed_law_search, "other_trim_law", lambda h, _told: hypothesis(*h.names, score=h.log_evidence + 30.0, error=error)
    )
    monkeypatch.setattr(speed_law_search, "_prior_log_odds", lambda _h: 0.0)
    found = hypothesis("delay", score=100.0)
    tried = {frozenset(): hypothesis(score=0.0), frozenset(("delay",)): found}
    assert (TrimLawSearch().best_alternative(found, tried, FLOOR, FLOOR, ParallelMap((), ()), str)[1] is not None) == turns


def test_a_search_that_has_turned_twice_asks_no_more(asked):
    found = hypothesis("delay", score=100.0)
    tried = {frozenset(): hypothesis(score=99.0), frozenset(("delay",)): found}
    assert TrimLawSearch(switches=MAX_TRIM_SWITCHES).best_alternative(
        found, tried, FLOOR, FLOOR, ParallelMap((), ()), lambda: 7
    ) == (7, None)
    assert asked == []


def test_a_search_does_not_turn_to_an_unusual_law_for_less_than_its_prior_odds(monkeypatch, asked):
    monkeypatch.setattr(speed_law_search, "_prior_log_odds", lambda _h: 6.0)
    found = hypothesis("delay", score=100.0)
    tried = {frozenset(): hypothesis(score=97.0), frozenset(("delay",)): found}
    trims = TrimLawSearch()
    assert trims.best_alternative(found, tried, FLOOR, FLOOR, ParallelMap((), ()), str)[1] is None
    (without,) = trims.without_an_effect(found, tried)
    assert (without.names, without.log_evidence) == ((), 102.0)
