"""The first fit on a machine compiles for ten seconds: the motion's core in a second process, the noise's filters in this one."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from fieldsid.effects import all_effects
from fieldsid.fitting.descent import descend
from fieldsid.fitting.kalman import filtered
from fieldsid.fitting.layout import layout_of, speed_groups
from fieldsid.fitting.noise import estimate_noise
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.start import start_vector
from fieldsid.fitting.uncertainty import middle
from fieldsid.fitting.whitening import noise_vector
from fieldsid.models.axis import Axis
from fieldsid.models.jit import is_compiled, is_loaded
from fieldsid.models.kernels import tangents
from fieldsid.models.model import Noise
from fieldsid.models.record import ROLES, Record

SAMPLES = 60
WHITE = Noise(0.01, 0.01)
STIRRED = Noise(0.01, 0.01, disturbance=0.01, disturbance_time=1.0)


def a_record() -> Record:
    """Return a few seconds that mean nothing, with every helper, for what is compiled to be called with."""
    time = np.linspace(0.0, 3.0, SAMPLES)
    fin, every = np.where(np.sin(2.0 * time) > 0.0, 0.1, -0.1), np.ones(SAMPLES, dtype=bool)
    angle, rate = 0.1 * np.sin(time), 0.1 * np.cos(time)
    return Record(
        "none", Axis.YAW, time, fin, fin_is_held=True, fin_is_measured=False, angle=angle, rate=rate, angle_ok=every,
        rate_ok=every, signals=dict.fromkeys((*ROLES, "cross"), 1.0 + angle), speed=1.0,
    )  # fmt: skip


def compile_filters() -> None:
    """Call what judges noise once."""
    _estimate("disturbance")


def _estimate(family: str) -> None:
    record = a_record()
    estimate_noise([record], [(1.0, 0.0)], [record.both], family, STIRRED)


def compile_motion() -> None:
    """Call what moves, fits and says how sure it is once, then each effect, and last what few fits need."""
    records = (a_record(),)
    problem = Problem(records, layout_of(records, Axis.YAW, (), speed_groups(records)))
    x = start_vector(records, problem.layout)
    descend(problem, x, WHITE, rounds=1)
    result = problem.linearise(x, 0)
    problem.residual(x, 0)
    middle(records[0], noise_vector(STIRRED), 1.0, 0.0, result.sensitivity)
    effects = all_effects(Axis.YAW).values()
    for own in (*((e,) for e in effects), tuple(e for e in effects if e.fin is not None)):
        more = problem.with_effects(own)
        more.linearise(more.start(), 0)
    _estimate("both")


def load_compiled() -> None:
    """Load what an earlier process compiled, once; nothing where that must still be done."""
    if not is_loaded(tangents) and is_compiled(tangents) and is_compiled(filtered):
        compile_filters()
        compile_motion()


@contextmanager
def compiling_ahead(tell: Callable[[str], None] = lambda _text: None) -> Iterator[None]:
    """Compile what a fit needs, in two processes, before and while what is inside runs, if this machine has not done so yet.

    What is inside compiles itself what it needs sooner; the second process is ended with it.
    """
    if is_compiled(filtered):
        yield
        return
    tell("first run on this machine: compiling, about ten seconds, once")
    command, quiet = [sys.executable, "-P", "-m", __name__], subprocess.DEVNULL
    try:
        other = subprocess.Popen(command, stdin=quiet, stdout=quiet, stderr=quiet)
    except OSError:  # where no second process is to be had, what is inside compiles it all
        yield
        return
    with other:
        try:
            compile_filters()
            yield
        finally:
            other.kill()


if __name__ == "__main__":
    compile_motion()
