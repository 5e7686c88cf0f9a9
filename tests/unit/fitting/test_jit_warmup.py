"""What is compiled ahead is what a fit uses, and a machine that has compiled it makes no copy."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from fieldsid.fitting import jit_warmup
from fieldsid.fitting.jit_warmup import Warmup, WarmupJob
from fieldsid.numerics.jit import is_loaded, jit, plain_of, warmup_marker

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
def test_a_function_counts_as_loaded_once_it_was_called(function):
    jit_warmup.compile_all()
    assert is_loaded(function)
    assert is_loaded(plain_of(function))


def test_the_marker_of_kernels_changes_with_their_source(tmp_path, monkeypatch):
    source = tmp_path / "fresh.py"
    source.write_text("from fieldsid.numerics.jit import jit\n\n\n@jit\ndef twice(x):\n    return 2.0 * x\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    import fresh

    assert not is_loaded(fresh.twice)
    before = warmup_marker([fresh.twice])
    assert warmup_marker([fresh.twice]) == before
    assert warmup_marker([fresh.twice, jit(jit_warmup.first_order_lag.py_func)]) != before
    source.write_text(source.read_text().replace("2.0", "3.00"), encoding="utf-8")
    assert warmup_marker([fresh.twice]) != before


@pytest.fixture
def jobs(monkeypatch, tmp_path):
    """Stand-ins for what is compiled: a job leaves a file that says which process has done it."""

    def made(*seconds: float) -> list[Path]:
        def run(done: Path, length: float) -> None:
            time.sleep(length)
            done.write_text(str(os.getpid()))

        files = [tmp_path / str(i) for i in range(len(seconds))]
        stand_ins = tuple(WarmupJob(partial(run, *of), (of[0],)) for of in zip(files, seconds, strict=True))
        monkeypatch.setattr(jit_warmup, "WARMUP_JOBS", stand_ins)
        monkeypatch.setattr(jit_warmup, "WARMUP_KERNELS", tuple(files))
        monkeypatch.setattr(jit_warmup, "is_loaded", lambda _kernel: False)
        monkeypatch.setattr(jit_warmup, "warmup_marker", lambda _kernels: tmp_path / "cache" / "marker")
        return files

    return made


@pytest.mark.forks
def test_a_worker_compiles_only_where_there_is_no_marker_and_ends_with_the_context(jobs, monkeypatch, tmp_path):
    made, said = [], []
    real = jit_warmup.fork_worker
    monkeypatch.setattr(jit_warmup, "fork_worker", lambda work: made.append(real(work)) or made[-1])
    jobs(60.0)
    with jit_warmup.warming_up(said.append):
        (worker,) = made
        assert worker.is_running()
    with pytest.raises(ChildProcessError):
        os.waitpid(worker.process, 0)
    assert [text.partition(":")[0] for text in said] == ["first run on this machine"]
    assert not (tmp_path / "cache" / "marker").exists()
    (tmp_path / "cache").mkdir()
    (tmp_path / "cache" / "marker").touch()
    with jit_warmup.warming_up(said.append) as warmup:
        warmup.compile_now()
    assert len(made) == len(said) == 1


@pytest.mark.forks
def test_jobs_are_shared_with_the_worker_until_the_kernels_asked_for_are_there(jobs, tmp_path):
    files = jobs(0.5, 0.0, 0.0)
    with jit_warmup.warming_up() as warmup:
        time.sleep(0.2)  # the worker is at the first
        warmup.compile_now(files[1:2])
        assert [file.exists() for file in files] == [False, True, False]
        warmup.compile_now(files[:1])
        assert files[0].exists()
        warmup.compile_now()
        assert all(file.exists() for file in files)
    assert files[0].read_text() != files[1].read_text() == str(os.getpid())
    assert (tmp_path / "cache" / "marker").exists()


def test_without_a_worker_all_of_it_is_done_here(jobs, monkeypatch, tmp_path):
    monkeypatch.setattr(jit_warmup, "fork_worker", lambda _work: None)
    files = jobs(0.0, 0.0)
    with jit_warmup.warming_up() as warmup:
        assert not any(file.exists() for file in files)
        warmup.compile_now()
    assert {file.read_text() for file in files} == {str(os.getpid())}
    assert (tmp_path / "cache" / "marker").exists()


@pytest.mark.forks
def test_what_the_worker_died_of_is_done_here():
    here, done, kernel = os.getpid(), [], plain_of(jit_warmup.first_order_lag)
    warmup = Warmup([WarmupJob(lambda: done.append(1) if os.getpid() == here else os._exit(9), (kernel,))])
    time.sleep(0.2)  # the worker has taken it
    warmup.compile_now([kernel])
    assert done == [1]
    assert warmup.end()


def test_a_kernel_of_no_job_is_not_waited_for(jobs, tmp_path):
    jobs(60.0)
    with jit_warmup.warming_up() as warmup:
        warmup.compile_now([tmp_path / "never"])


def test_every_job_calls_what_it_is_there_for():
    called = subprocess.run([sys.executable, "-c", EVERY], capture_output=True, text=True, check=True)
    assert called.stdout.split() == ["True"]
