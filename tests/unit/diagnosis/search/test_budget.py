"""A search ends by a count of what it has worked out: the same with a copy of the process and without, and it says so."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from math import ceil

import hidden_lag
import numpy as np
import pytest

from fieldsid.diagnosis.diagnose import body_of, diagnose
from fieldsid.diagnosis.parallel_map import ParallelMap
from fieldsid.diagnosis.search import search, search_state
from fieldsid.diagnosis.search.budget import Budget
from fieldsid.diagnosis.search.search import Search
from fieldsid.effects import all_effects
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of
from fieldsid.runtime.evaluation_counter import EvaluationCounter


def allow_nothing(monkeypatch):
    """Leave a search that is not thorough no evaluations."""
    monkeypatch.setattr(search_state, "Budget", lambda runs, samples, most=0.0: Budget(runs, samples, most, 0.0))


RUNS, UNSEEN = hidden_lag.runs()
EFFECTS = all_effects(Axis.YAW)


def test_what_is_asked_for_beyond_the_allowance_is_left_and_remembered():
    allowance = Budget(2, most=10.0, where_unexplained=15.0)
    allowance.evaluations.add(19)
    assert allowance.remaining(lambda: False)
    allowance.evaluations.add()
    assert allowance.remaining(lambda: True)
    assert not allowance.is_exhausted
    assert not allowance.remaining(lambda: False)
    assert allowance.is_exhausted
    allowance.evaluations.add(10)
    assert not allowance.remaining(lambda: True)
    assert Budget(2, most=np.inf).remaining(lambda: False)


def test_what_leads_is_not_followed_for_ever(monkeypatch):
    made = a_search(thorough=False)
    made.budget.most = made.budget.where_unexplained = 0.0
    monkeypatch.setattr(Search, "leaves_visible_error", lambda _self: True)
    made.budget.evaluations.count = ceil(made.budget.most_for_leading * made.budget.runs) - 1
    assert made.may_go_on(leading=True)
    made.budget.evaluations.add()
    assert not made.may_go_on(leading=True)


def test_no_expansion_begins_there_that_would_not_end_there():
    allowance = Budget(2, where_unexplained=30.0, in_all=280.0)
    allowance.evaluations.add(2 * 200)
    assert allowance.remains_for_expansion
    allowance.last_expansion = 79.0
    assert allowance.remains_for_expansion
    allowance.last_expansion = 80.0
    assert not allowance.remains_for_expansion
    assert allowance.remains_for_leading


def test_a_search_remembers_what_its_last_expansion_took():
    made = a_search(thorough=False)
    assert 0.0 < made.budget.last_expansion < made.budget.used


def test_long_runs_are_followed_for_as_long_as_usual_ones_and_at_least_as_what_is_unexplained():
    usual, long = (Budget(2, samples, where_unexplained=30.0, in_all=280.0) for samples in (1000, 3800))
    assert usual.most_for_leading == 280.0
    assert long.most_for_leading == 140.0
    assert Budget(2, 1e9, where_unexplained=30.0, in_all=280.0).most_for_leading == 30.0


@pytest.mark.parametrize("visible", [True, False])
def test_beyond_it_only_what_leads_is_expanded_and_only_while_an_error_is_visible(monkeypatch, visible):
    made = a_search(thorough=False)
    made.budget.most = made.budget.where_unexplained = 0.0
    monkeypatch.setattr(Search, "leaves_visible_error", lambda _self: visible)
    assert made.may_go_on(leading=True) == visible
    assert not made.may_go_on()


def test_beyond_it_nothing_begins_again_under_another_kind_of_noise(monkeypatch):
    made, asked = a_search(thorough=False), []
    made.base()
    monkeypatch.setattr(search, "fit_other_noise", lambda *_of: asked.append("other"))
    monkeypatch.setattr(Search, "leaves_visible_error", lambda _self: True)
    made._switch_noise_or_trim()
    assert asked == ["other"]
    made.budget.most = made.budget.where_unexplained = 0.0
    assert made.may_go_on(leading=True)
    assert not made._switch_noise_or_trim()
    assert asked == ["other"]
    made.trim_laws.known.clear()  # nothing was asked yet: once it is, whatever was spent
    made._switch_noise_or_trim()
    assert asked == ["other", "other"]


def test_what_a_copy_has_worked_out_counts():
    counter = EvaluationCounter()
    ParallelMap((), (), counter).map(lambda _item: counter.add(3), range(6))
    assert counter.count == 18


@pytest.mark.forks
def test_a_problem_from_a_worker_counts_on_the_counter_of_the_search():
    record = record_of(UNSEEN, Axis.YAW)
    shared = ParallelMap([record], [])
    problem = Problem((record,), layout_of((record,), Axis.YAW, ()), shared.evaluations)
    for back in shared.map(lambda _item: replace(problem, records=problem.records), range(6)):
        assert back.evaluations is shared.evaluations
    problem.with_effects((EFFECTS["servo_lag"],)).residual(np.append(problem.start(), 0.1), 0)
    assert shared.evaluations.count == 1


def a_search(*, thorough: bool) -> Search:
    learned, unseen = (tuple(record_of(r, Axis.YAW) for r in runs) for runs in (RUNS, [UNSEEN]))
    made = Search(learned, unseen, Axis.YAW, [EFFECTS[n] for n in ("servo_lag", "quadratic_damping")], thorough=thorough)
    made.best()
    return made


def test_a_search_without_allowance_ends_with_what_the_base_leads_to(monkeypatch):
    allow_nothing(monkeypatch)
    short, thorough = a_search(thorough=False), a_search(thorough=True)
    assert short.tried.progress.expanded == {short.root}
    assert short.budget.is_exhausted
    assert frozenset({"servo_lag"}) in short.tried
    assert not thorough.budget.is_exhausted


@pytest.mark.parametrize(
    ("lowest", "goes_on"),
    [
        ([], True),
        ([5.0, 5.0], True),
        ([5.0, 3.0, 3.0], True),
        ([5.0, 3.0, 3.0, 3.0], False),
        ([5.0, 3.0, 2.9, 2.8], False),
        ([5.0, 3.0, 3.0, 2.7], True),
    ],
)
def test_beyond_the_allowance_the_leading_model_grows_only_while_the_error_falls(monkeypatch, lowest, goes_on):
    allow_nothing(monkeypatch)
    made = a_search(thorough=False)
    leading = made._most_evident()
    monkeypatch.setattr(Search, "leaves_visible_error", lambda _self: True)
    monkeypatch.setattr(Search, "_is_expandable", lambda _self, h: h is leading)
    made.tried.lowest_errors[:] = lowest
    assert made._next_to_expand() is (leading if goes_on else None)


def test_a_search_that_begins_again_under_another_noise_goes_on_counting_what_lowered_no_error():
    made = a_search(thorough=False)
    before = list(made.tried.lowest_errors)
    assert before
    made.tried.assumptions = replace(made.tried.assumptions, noise_kind="another")
    assert not made.tried.progress.expanded
    assert made.tried.lowest_errors == before


@pytest.mark.parametrize(
    ("visible", "left", "share", "goes_on", "says"),
    [
        (True, 1.1, 1.0, True, True),
        (False, 1.2, 1.0, True, False),  # the table shows nothing that is left
        (False, 1.1, 0.65, True, True),
        (False, 1.1, 0.75, False, False),
    ],
)
def test_the_longer_allowance_goes_by_the_error_that_is_shown_and_that_the_verdict_counts(
    monkeypatch, visible, left, share, goes_on, says
):
    made = a_search(thorough=False)
    made.budget.most = 0.0
    monkeypatch.setattr(Search, "leaves_visible_error", lambda _self: visible)
    monkeypatch.setattr(search_state, "compared_error", lambda *_of: left)
    monkeypatch.setattr(search_state, "compared_share", lambda *_of: share)
    assert (made.may_go_on(), made.leaves_unexplained()) == (goes_on, says)


@pytest.mark.parametrize("thorough", [False, True])
def test_a_diagnosis_says_that_not_all_was_tried(monkeypatch, thorough):
    allow_nothing(monkeypatch)
    without_lag = [e for name, e in EFFECTS.items() if name in ("quadratic_damping", "stall")]
    monkeypatch.setattr(
        import_module("fieldsid.diagnosis.diagnose"), "applicable_effects", lambda _all, _records: (tuple(without_lag), {})
    )
    found = diagnose(RUNS, Axis.YAW, [UNSEEN], thorough=thorough)
    assert [n.code for n in found.notes].count("search_ended") == (not thorough)


@pytest.mark.forks
def test_a_copy_changes_neither_the_count_nor_the_answer(monkeypatch):
    answers, counts = [], []
    for alone in (False, True):
        if alone:
            monkeypatch.setenv("FIELDSID_IS_WORKER", "1")
        answers.append(body_of(diagnose(RUNS, Axis.YAW, [UNSEEN])))
        counts.append(a_search(thorough=False).budget.evaluations.count)
    assert counts[0] == counts[1] > 0
    assert answers[0] == answers[1]
