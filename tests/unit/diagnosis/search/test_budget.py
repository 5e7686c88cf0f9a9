"""A search ends by a count of what it has worked out: the same with a copy of the process and without, and it says so."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module

import hidden_lag
import numpy as np
import pytest

from fieldsid.diagnosis.diagnose import diagnose
from fieldsid.diagnosis.parallel_map import ParallelMap
from fieldsid.diagnosis.search import search
from fieldsid.diagnosis.search.budget import Budget
from fieldsid.diagnosis.search.search import Search
from fieldsid.effects import all_effects
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of
from fieldsid.records.keys import body_of
from fieldsid.runtime.evaluation_counter import EvaluationCounter


def allow_nothing(monkeypatch):
    """Leave a search that is not thorough no evaluations."""
    monkeypatch.setattr(search, "Budget", lambda runs, samples, most=0.0: Budget(runs, samples, most, 0.0))


RUNS, UNSEEN = hidden_lag.runs()
EFFECTS = all_effects(Axis.YAW)


def test_what_is_asked_for_beyond_the_allowance_is_left_and_remembered():
    allowance = Budget(2, most=10.0, where_unexplained=15.0)
    allowance.evaluations.add(19)
    assert allowance.remains(lambda: False)
    allowance.evaluations.add()
    assert allowance.remains(lambda: True)
    assert not allowance.is_exhausted
    assert not allowance.remains(lambda: False)
    assert allowance.is_exhausted
    allowance.evaluations.add(10)
    assert not allowance.remains(lambda: True)
    assert Budget(2, most=np.inf).remains(lambda: False)


def test_evaluations_of_long_runs_count_as_many_of_usual_ones_as_take_as_long():
    usual, long = Budget(2, 1000), Budget(2, 3800)
    for allowance in (usual, long):
        allowance.evaluations.add(20)
    assert usual.used == 10.0
    assert long.used == 20.0


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


@pytest.fixture(scope="module")
def searched() -> Search:
    return a_search(thorough=False)


def test_a_search_without_allowance_ends_with_what_the_base_leads_to(monkeypatch):
    allow_nothing(monkeypatch)
    short, thorough = a_search(thorough=False), a_search(thorough=True)
    assert short.tried.expanded == {short.root}
    assert short.budget.is_exhausted
    assert frozenset({"servo_lag"}) in short.tried
    assert not thorough.budget.is_exhausted


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
    monkeypatch, searched, visible, left, share, goes_on, says
):
    monkeypatch.setattr(searched, "budget", replace(searched.budget, most=0.0, is_exhausted=False))
    monkeypatch.setattr(Search, "leaves_visible_error", lambda _self: visible)
    monkeypatch.setattr(search, "compared_error", lambda *_of: left)
    monkeypatch.setattr(search, "compared_share", lambda *_of: share)
    assert (searched.may_go_on(), searched.leaves_unexplained()) == (goes_on, says)


def with_effects(monkeypatch, *names):
    """Leave a diagnosis some of the catalogue's effects."""
    module = import_module("fieldsid.diagnosis.diagnose")
    monkeypatch.setattr(module, "applicable_effects", lambda _all, _records: (tuple(EFFECTS[n] for n in names), {}))


@pytest.mark.parametrize("thorough", [False, True])
def test_a_diagnosis_says_that_not_all_was_tried(monkeypatch, thorough):
    allow_nothing(monkeypatch)
    with_effects(monkeypatch, "quadratic_damping", "stall")
    found = diagnose(RUNS, Axis.YAW, [UNSEEN], thorough=thorough)
    assert [n.code for n in found.notes].count("search_ended") == (not thorough)


def test_a_cause_that_the_catalogue_lacks_is_not_given_a_name(monkeypatch):
    with_effects(monkeypatch, "quadratic_damping", "stall", "gyro_scale")
    found = diagnose(RUNS, Axis.YAW, [UNSEEN])
    assert (found.verdict, found.effects) == ("unexplained", ())
    assert "no effect of the catalogue" in found.says


@pytest.mark.forks
def test_a_copy_changes_neither_the_count_nor_the_answer(monkeypatch):
    """With the whole catalogue: tests/recovery/test_diagnosis.py."""
    with_effects(monkeypatch, "servo_lag", "delay", "quadratic_damping")
    answers, counts = [], []
    for alone in (False, True):
        if alone:
            monkeypatch.setenv("FIELDSID_IS_WORKER", "1")
        answers.append(body_of(diagnose(RUNS, Axis.YAW, [UNSEEN])))
        counts.append(a_search(thorough=False).budget.evaluations.count)
    assert counts[0] == counts[1] > 0
    assert answers[0] == answers[1]
