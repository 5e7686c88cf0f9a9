"""What is compiled ahead is what a fit uses, and a machine that has compiled it makes no copy."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import pytest

from fieldsid.fitting import jit_warmup
from fieldsid.numerics.jit import is_compiled, plain_of
from fieldsid.runtime.worker_pool import can_fork

needs_copies = pytest.mark.skipif(not can_fork(), reason="needs Linux, a second core and no other threads")
EVERY = """
from fieldsid.fitting import jit_warmup
jit_warmup.compile_all()
print(all(door.signatures for door in jit_warmup.WARMUP_KERNELS))
"""

AGAIN = """
from fieldsid.fitting import jit_warmup
import numpy as np
doors = jit_warmup.WARMUP_KERNELS
jit_warmup.compile_all()
known = [d.signatures for d in doors]
from dataclasses import replace
from fieldsid.fitting.fit import fit
from fieldsid.models.axis import Axis
record = jit_warmup.a_record()
long = np.arange(600) * 0.05
fin = np.where(np.sin(long) > 0.0, 0.2, -0.2)
rate = np.zeros(600)
for i in range(599):
    rate[i + 1] = rate[i] + 0.05 * (0.5 * fin[i] - rate[i])
noise = 0.005 * np.random.default_rng(1).standard_normal((2, 600))
angle = np.concatenate([[0.0], np.cumsum(0.05 * rate[:-1])]) + noise[0]
every = np.ones(600, dtype=bool)
log = replace(record, time=long, fin=fin, angle=angle, rate=rate + noise[1], angle_ok=every, rate_ok=every, signals={})
fit([log], Axis.YAW)
print([len(d.signatures) for d in doors] == [len(k) for k in known] == [1] * len(doors))
"""


def test_a_fit_compiles_nothing_more():
    done = subprocess.run([sys.executable, "-c", AGAIN], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "True"


@pytest.mark.parametrize("function", jit_warmup.WARMUP_KERNELS, ids=lambda door: door.__name__)
def test_a_function_counts_as_compiled_once_it_was_called(function):
    jit_warmup.compile_all()
    assert is_compiled(function)
    assert is_compiled(plain_of(function))


def test_what_was_never_called_is_not_compiled(tmp_path, monkeypatch):
    source = tmp_path / "fresh.py"
    source.write_text("from fieldsid.numerics.jit import jit\n\n\n@jit\ndef twice(x):\n    return 2.0 * x\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    import fresh

    assert not is_compiled(fresh.twice)
    assert fresh.twice(1.5) == 3.0
    assert is_compiled(fresh.twice)


@pytest.fixture
def jobs(monkeypatch):
    """Stand-ins for what is compiled: a job's door is open once the job is done, in whichever process."""
    folder: list[Path] = []

    def made(tmp_path: Path, seconds: Sequence[float]) -> list[Path]:
        def job(door: Path, length: float) -> None:
            time.sleep(length)
            door.write_text(str(os.getpid()))

        folder[:] = [tmp_path / str(i) for i in range(len(seconds))]
        monkeypatch.setattr(jit_warmup, "WARMUP_KERNELS", tuple(folder))
        monkeypatch.setattr(jit_warmup, "WARMUP_JOBS", tuple(partial(job, *of) for of in zip(folder, seconds, strict=True)))
        monkeypatch.setattr(jit_warmup, "is_compiled", lambda door: door.exists())
        return folder

    return made


@needs_copies
def test_a_copy_compiles_only_where_something_is_not_compiled_and_ends_with_the_work(jobs, monkeypatch, tmp_path):
    made, told = [], []
    real = jit_warmup.fork_worker
    monkeypatch.setattr(jit_warmup, "fork_worker", lambda work: made.append(real(work)) or made[-1])
    jobs(tmp_path, [])
    with jit_warmup.warming_up(told.append):
        pass
    assert made == told == []
    jobs(tmp_path, [60.0])
    with jit_warmup.warming_up(told.append), jit_warmup.warming_up(told.append):
        (copy,) = made
        assert copy.is_at_work()
    with pytest.raises(ChildProcessError):
        os.waitpid(copy.process, 0)
    (said,) = told
    assert said.startswith("first run")


@needs_copies
def test_what_is_left_is_shared_with_the_copy_until_what_is_asked_for_is_there(jobs, tmp_path):
    doors = jobs(tmp_path, [0.5, 0.0, 0.0])
    with jit_warmup.warming_up() as help_along:
        time.sleep(0.2)  # the copy is at the first
        help_along(doors[1:2])
        assert [door.exists() for door in doors] == [False, True, False]
        help_along(doors[:1])
        assert [door.exists() for door in doors] == [True, True, True]
    assert doors[0].read_text() != doors[1].read_text() == doors[2].read_text() == str(os.getpid())


def test_without_a_copy_all_of_it_is_done_here(jobs, monkeypatch, tmp_path):
    monkeypatch.setattr(jit_warmup, "fork_worker", lambda _work: None)
    doors = jobs(tmp_path, [0.0, 0.0])
    with jit_warmup.warming_up() as help_along:
        assert not any(door.exists() for door in doors)
        help_along(doors)
    assert {door.read_text() for door in doors} == {str(os.getpid())}


def test_what_no_job_compiles_is_not_waited_for(jobs, tmp_path):
    doors = jobs(tmp_path, [0.0])
    with jit_warmup.warming_up() as help_along:
        help_along([*doors, tmp_path / "never"])
    assert doors[0].exists()


def test_every_job_calls_what_it_is_there_for():
    called = subprocess.run([sys.executable, "-c", EVERY], capture_output=True, text=True, check=True)
    assert called.stdout.split() == ["True"]
