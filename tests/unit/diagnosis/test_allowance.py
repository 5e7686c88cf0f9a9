"""A search ends by a count of what it has worked out: the same with a copy of the process and without, and it says so."""

from __future__ import annotations

from importlib import import_module

import hidden_lag
import numpy as np
import pytest

from fieldsid.copies import can_copy
from fieldsid.diagnosis import search as module
from fieldsid.diagnosis.allowance import Allowance
from fieldsid.diagnosis.beside import Beside
from fieldsid.diagnosis.diagnose import body_of, diagnose
from fieldsid.diagnosis.search import Search
from fieldsid.effects import all_effects
from fieldsid.fitting import effort
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of

RUNS, UNSEEN = hidden_lag.runs()
EFFECTS = all_effects(Axis.YAW)


def test_what_is_asked_for_beyond_the_allowance_is_left_and_remembered():
    allowance = Allowance(2, 10.0)
    effort.count(19)
    assert allowance.lasts()
    assert not allowance.ended
    effort.count()
    assert not allowance.lasts()
    assert allowance.ended
    assert Allowance(2, np.inf).lasts()


def test_what_a_copy_has_worked_out_counts():
    before = effort.done()
    Beside((), ()).each(lambda _item: effort.count(3), range(6))
    assert effort.done() - before == 18


def a_search(*, thorough: bool) -> Search:
    learned, unseen = (tuple(record_of(r, Axis.YAW) for r in runs) for runs in (RUNS, [UNSEEN]))
    made = Search(learned, unseen, Axis.YAW, [EFFECTS[n] for n in ("servo_lag", "quadratic_damping")], thorough=thorough)
    made.best()
    return made


def test_a_search_without_allowance_ends_with_what_the_base_leads_to(monkeypatch):
    monkeypatch.setattr(module, "MOST", 0)
    short, thorough = a_search(thorough=False), a_search(thorough=True)
    assert short.grown_from == {short.root}
    assert short.allowance.ended
    assert frozenset({"servo_lag"}) in short.tried
    assert not thorough.allowance.ended


@pytest.mark.parametrize("thorough", [False, True])
def test_a_diagnosis_says_that_not_all_was_tried(monkeypatch, thorough):
    monkeypatch.setattr(module, "MOST", 0)
    without_lag = [e for name, e in EFFECTS.items() if name in ("quadratic_damping", "stall")]
    monkeypatch.setattr(import_module("fieldsid.diagnosis.diagnose"), "usable", lambda _all, _records: (tuple(without_lag), {}))
    found = diagnose(RUNS, Axis.YAW, [UNSEEN], thorough=thorough)
    assert [n.code for n in found.notes].count("search_ended") == (not thorough)


@pytest.mark.skipif(not can_copy(), reason="needs Linux, a second core and no other threads")
def test_a_copy_changes_neither_the_count_nor_the_answer(monkeypatch):
    answers, counts = [], []
    for alone in (False, True):
        if alone:
            monkeypatch.setenv("FIELDSID_IS_COPY", "1")
        before = effort.done()
        answers.append(body_of(diagnose(RUNS, Axis.YAW, [UNSEEN])))
        counts.append(effort.done() - before)
    assert counts[0] == counts[1]
    assert answers[0] == answers[1]
