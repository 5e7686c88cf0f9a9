"""A process beside the first: tasks, answers, errors and its end."""

from __future__ import annotations

import os
import signal
import time

import pytest

from fieldsid.errors import DataError, FieldsidError
from fieldsid.rounding import number, with_error
from fieldsid.runtime.second_process import SecondProcess
from fieldsid.schedule.wish import Wish, check_wish


@pytest.fixture
def second():
    made = SecondProcess()
    yield made
    made.close()


def test_it_answers_one_task_after_the_other_and_hands_back_the_errors_a_user_can_meet(second):
    assert second.answer(wait=True) is None
    for task, answer in (((number, 1.5), "1.500"), ((with_error, 2.0, 0.1), "2.00 +/- 0.10")):
        second.give(*task)
        assert second.is_busy
        assert second.answer(wait=True) == answer
        assert not second.is_busy
    second.give(check_wish, Wish("none"))
    assert isinstance(second.answer(wait=True), FieldsidError)
    assert not isinstance(second.answer(wait=True), DataError)


def test_a_task_that_lasts_is_not_waited_for_and_ends_with_the_first(second):
    second.give(time.sleep, 60.0)
    begin = time.monotonic()
    assert second.answer() is None
    assert time.monotonic() - begin < 5.0
    second.close()
    assert not second.is_busy


def test_one_that_has_ended_by_itself_is_told(second):
    second.give(os.kill, os.getpid(), 0)
    second.answer(wait=True)
    second.give(signal.raise_signal, signal.SIGKILL)
    with pytest.raises(FieldsidError, match="has ended"):
        second.answer(wait=True)
