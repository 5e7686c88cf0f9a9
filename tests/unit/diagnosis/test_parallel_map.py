"""Work that is shared out comes to what it comes to in one process, whatever becomes of the other."""

from __future__ import annotations

import os
import threading
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest

from fieldsid.diagnosis.parallel_map import ParallelMap, with_coefficients
from fieldsid.effects import all_effects
from fieldsid.fitting.jit_warmup import a_record
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.axis import Axis
from fieldsid.models.effect import with_variant
from fieldsid.runtime import worker_pool
from fieldsid.runtime.worker_pool import can_fork

EFFECTS = all_effects(Axis.YAW)
RECORD = a_record()
KNOWN = ParallelMap([RECORD], EFFECTS.values())


def test_values_come_back_in_the_order_of_the_items():
    assert KNOWN.map(lambda i: i * i, range(40)) == [i * i for i in range(40)]


@pytest.mark.forks
def test_two_processes_take_the_items():
    here = threading.Event()

    def slowly(_item):
        here.wait(0.02)
        return os.getpid()

    assert len(set(KNOWN.map(slowly, range(8)))) == 2


@pytest.mark.forks
def test_what_comes_back_refers_to_what_is_known():
    problem = Problem((RECORD,), layout_of((RECORD,), Axis.YAW, (EFFECTS["servo_lag"],)))
    for back in KNOWN.map(lambda _item: problem, range(6)):
        assert back.records[0] is RECORD
        assert back.layout.effects[0] is EFFECTS["servo_lag"]
        assert back.layout.parameters == problem.layout.parameters
        assert isinstance(back.layout.run_nuisances, MappingProxyType)


@pytest.mark.parametrize("effect", [e for e in EFFECTS.values() if e.variants], ids=lambda e: e.name)
def test_every_form_of_an_effect_is_known_by_its_coefficients(effect):
    for form in effect.variants:
        shaped = with_variant(effect, form)
        again = KNOWN.loads(KNOWN.dumps(shaped))
        assert again.coefficients == shaped.coefficients
        assert again.moment is shaped.moment


def test_a_form_that_is_none_of_the_effects_is_not():
    assert with_coefficients(EFFECTS["servo_lag"], ("lag", "nothing")) is None


def test_a_record_that_is_not_known_is_copied():
    other = a_record()
    back = KNOWN.loads(KNOWN.dumps(other))
    assert back is not other
    np.testing.assert_array_equal(back.both, other.both)


@pytest.mark.forks
def test_work_within_work_does_not_wait_for_the_copy_that_waits_for_it():
    pause = threading.Event()

    def within(item):
        pause.wait(0.01)
        return KNOWN.map(lambda i: i + item, range(3)), "x" * 2**20  # more than a pipe holds

    answers = KNOWN.map(within, range(6))
    assert [a for a, _ in answers] == [[i, i + 1, i + 2] for i in range(6)]


@pytest.mark.forks
@pytest.mark.parametrize("how", ["raises", "dies", "cannot be written"])
def test_where_the_copy_comes_to_nothing_its_items_are_done_here(how):
    here = os.getpid()
    pause = threading.Event()

    def value(item):
        pause.wait(0.01)
        if os.getpid() != here:
            if how == "raises":
                raise ValueError("only in the copy")
            if how == "dies":
                os._exit(9)
            return lambda: item
        return item

    assert KNOWN.map(value, range(6)) == list(range(6))


@pytest.mark.forks
def test_where_no_copy_is_to_be_had_all_is_done_here_and_nothing_stays_open(monkeypatch):
    def refused():
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(worker_pool.os, "fork", refused)
    ends = len(list(Path("/proc/self/fd").iterdir()))
    assert KNOWN.map(lambda i: (i, os.getpid()), range(4)) == [(i, os.getpid()) for i in range(4)]
    assert len(list(Path("/proc/self/fd").iterdir())) == ends


def test_an_error_is_raised_as_it_is_and_leaves_no_process_behind():
    def refused(item):
        raise ValueError(f"no {item}")

    children = Path(f"/proc/self/task/{os.getpid()}/children")
    before = set(children.read_text().split())
    with pytest.raises(ValueError, match="no "):
        KNOWN.map(refused, range(4))
    assert set(children.read_text().split()) <= before


@pytest.mark.forks
def test_a_copy_copies_no_more():
    assert [can_fork(), *KNOWN.map(lambda _item: (threading.Event().wait(0.02), can_fork())[1], range(6))].count(False) >= 1
