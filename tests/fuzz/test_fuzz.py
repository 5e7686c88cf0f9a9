"""A short run of the fuzzers over every kind of file; the long one is `python tests/fuzz/fuzzing.py --count 100000`."""

from __future__ import annotations

from operator import attrgetter

import pytest
from fuzz.fuzzing import by_place, fuzz
from fuzz.kinds import KINDS
from fuzz.mutate import spoil_bytes

from fieldsid.logs.reader import PACKAGE
from fieldsid.registry import members

FEW, OF_SLOW = 3, 1


# dbdreader leaves a file open where it does not like what it finds
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("times", [1, pytest.param(8, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", KINDS, ids=attrgetter("name"))
def test_a_spoilt_file_is_answered_or_refused(kind, times, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    crashes = fuzz(kind, range(times * (OF_SLOW if kind.slow else FEW)), tmp_path)
    assert not crashes, "\n".join(by_place(crashes)) + "\n" + crashes[0].trace


def test_an_error_that_is_none_of_ours_counts(tmp_path):
    def door(path):
        raise KeyError(path.name)

    kind = type(KINDS[0])("bad", KINDS[0].make, (spoil_bytes,), (door,))
    (found,) = fuzz(kind, [5], tmp_path)
    assert (found.seed, found.error.partition(":")[0]) == (5, "KeyError")


def test_every_log_format_is_among_the_kinds():
    readers = {"csv_table": "csv", "rosbag": "mcap"}
    assert {readers.get(name, name) for name in members(PACKAGE, "READER")} <= {k.name for k in KINDS}
