"""What is compiled ahead is what a fit uses, and a machine that has compiled it starts no second process."""

from __future__ import annotations

import subprocess
import sys

import pytest

from fieldsid.fitting import ahead, kalman, uncertainty
from fieldsid.models import kernels, linear_core
from fieldsid.models.jit import is_compiled, plain_of

USED = "filtered _middle simulate tangents accumulate"

AGAIN = """
from fieldsid.fitting import ahead, kalman, uncertainty
from fieldsid.models import kernels, linear_core
import numpy as np
doors = (kalman.filtered, uncertainty._middle, kernels.simulate, kernels.tangents, linear_core.accumulate)
ahead.compile_filters()
ahead.compile_motion()
known = [d.signatures for d in doors]
from dataclasses import replace
from fieldsid.fitting.fit import fit
from fieldsid.models.axis import Axis
record = ahead.a_record()
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


@pytest.mark.parametrize(
    "function",
    [kalman.filtered, uncertainty._middle, kernels.simulate, kernels.tangents, linear_core.accumulate],
    ids=USED.split(),
)
def test_a_function_counts_as_compiled_once_it_was_called(function):
    ahead.compile_filters()
    ahead.compile_motion()
    assert is_compiled(function)
    assert is_compiled(plain_of(function))


def test_what_was_never_called_is_not_compiled(tmp_path, monkeypatch):
    source = tmp_path / "fresh.py"
    source.write_text("from fieldsid.models.jit import jit\n\n\n@jit\ndef twice(x):\n    return 2.0 * x\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    import fresh

    assert not is_compiled(fresh.twice)
    assert fresh.twice(1.5) == 3.0
    assert is_compiled(fresh.twice)


def test_the_second_process_runs_only_where_nothing_is_compiled_and_ends_with_the_work(monkeypatch):
    begun, told = [], []
    real = subprocess.Popen

    def started(*args, **kwargs):
        begun.append(real([sys.executable, "-c", "import time; time.sleep(60)"], **kwargs))
        return begun[-1]

    monkeypatch.setattr(ahead.subprocess, "Popen", started)
    with ahead.compiling_ahead(told.append):
        pass
    ahead.compile_filters()
    assert len(begun) == len(told) <= 1
    monkeypatch.setattr(ahead, "is_compiled", lambda _function: False)
    with ahead.compiling_ahead(told.append):
        assert begun[-1].poll() is None
    assert begun[-1].poll() is not None
    assert told[-1].startswith("first run")


def test_without_a_second_process_the_work_goes_on(monkeypatch):
    def refused(*_args, **_kwargs):
        raise PermissionError

    monkeypatch.setattr(ahead, "is_compiled", lambda _function: False)
    monkeypatch.setattr(ahead.subprocess, "Popen", refused)
    done = []
    with ahead.compiling_ahead():
        done.append(True)
    assert done
