"""The first fit on a machine compiles for ten seconds: in a copy of this process and, once it needs the result, in this one."""

from __future__ import annotations

import gc
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from time import sleep

import numpy as np

from fieldsid.copies import Copy, copied, numbered
from fieldsid.effects import all_effects
from fieldsid.fitting.descent import descend
from fieldsid.fitting.kalman_abreast import abreast
from fieldsid.fitting.kalman_both import both
from fieldsid.fitting.kalman_sea import sea
from fieldsid.fitting.kalman_sensors import sensors
from fieldsid.fitting.layout import layout_of, speed_groups
from fieldsid.fitting.noise import estimate_noise
from fieldsid.fitting.problem import Problem
from fieldsid.fitting.scoring import slopes_of
from fieldsid.fitting.start import start_vector
from fieldsid.fitting.uncertainty import middle, middle_of
from fieldsid.fitting.whitening import noise_vector, whiten
from fieldsid.models.axis import Axis
from fieldsid.models.bent_core import bent_motion, bent_tangents
from fieldsid.models.effect import effect_named, in_form
from fieldsid.models.jit import is_compiled, is_loaded
from fieldsid.models.lag import behind
from fieldsid.models.linear_core import accumulate, linear_motion, linear_tangents
from fieldsid.models.model import Noise
from fieldsid.models.record import ROLES, Record

Door = Callable[..., object]
SAMPLES = 60
WHITE = Noise(0.01, 0.01)
STIRRED = Noise(0.01, 0.01, disturbance=0.01, disturbance_time=1.0)
DOORS = (
    linear_tangents, linear_motion, accumulate, bent_tangents, bent_motion, behind, sea, sensors, both, abreast, slopes_of,
    middle_of,
)  # fmt: skip
"""What a fit calls; JOBS compile it."""
LOOK = 0.01
"""Seconds from one look at what the other process has compiled to the next."""


def a_record() -> Record:
    """Return a few seconds that mean nothing, with every helper, for what is compiled to be called with."""
    time = np.linspace(0.0, 3.0, SAMPLES)
    fin, every = np.where(np.sin(2.0 * time) > 0.0, 0.1, -0.1), np.ones(SAMPLES, dtype=bool)
    angle, rate = 0.1 * np.sin(time), 0.1 * np.cos(time)
    return Record(
        "none", Axis.YAW, time, fin, fin_is_held=True, fin_is_measured=False, angle=angle, rate=rate, angle_ok=every,
        rate_ok=every, signals=dict.fromkeys((*ROLES, "cross"), 1.0 + angle), speed=1.0,
    )  # fmt: skip


def _a_problem() -> tuple[Problem, Record]:
    record = a_record()
    return Problem((record,), layout_of((record,), Axis.YAW, (), speed_groups((record,)))), record


def _linear() -> None:
    problem, record = _a_problem()
    x = start_vector((record,), problem.layout)
    problem.linearise(x, 0)
    problem.residual(x, 0)
    descend(problem, x, WHITE, rounds=1)


def _estimate(family: str) -> None:
    record = a_record()
    estimate_noise([record], [(1.0, 0.0)], [record.both], family, STIRRED)


def _whiten(noise: Noise) -> None:
    record = a_record()
    whiten(record, noise, 1.0, 0.0, record.both[None])


def _lag() -> None:
    record = a_record()
    behind(record.steps, record.rate, 1.0)


def _sure() -> None:
    middle(a_record(), noise_vector(STIRRED), 1.0, 0.0, np.ones((1, 2, SAMPLES)))


def _bent() -> None:
    problem, _ = _a_problem()
    more = problem.with_effects((effect_named("quadratic_damping"),))
    more.linearise(more.start(), 0)
    more.residual(more.start(), 0)


def _effects() -> None:
    problem, _ = _a_problem()
    effects = all_effects(Axis.YAW).values()
    at_fin = tuple(e for e in effects if e.fin is not None)
    for own in (*((e,) for e in effects), at_fin, *((in_form(e, f),) for e in at_fin for f in e.forms)):
        more = problem.with_effects(own)
        more.linearise(more.start(), 0)


JOBS: tuple[Callable[[], None], ...] = (
    _linear, lambda: _whiten(STIRRED), _bent, _lag, lambda: _estimate("disturbance"), lambda: _estimate("coloured"),
    lambda: _whiten(replace(STIRRED, coloured_rate=0.01)), lambda: _estimate("both"), _sure,
)  # fmt: skip
"""Each calls some of DOORS once, what is needed first before the rest."""


def compile_all() -> None:
    """Call everything once that a fit and a search for what is missing use."""
    for job in (*JOBS, _effects):
        job()


def load_compiled() -> None:
    """Load what an earlier process compiled, once; nothing where that must still be done."""
    if not is_loaded(bent_tangents) and _are_compiled(DOORS):
        compile_all()


@dataclass(frozen=True, slots=True)
class Ahead:
    """Compiling under way: the jobs nobody has begun, and the copy of this process that does them one by one."""

    left: int
    copy: Copy | None

    def help_along(self, doors: Sequence[Door] = DOORS) -> None:
        """Do what nobody has begun until everything asked for is compiled, and wait for what the copy is at."""
        while not _are_compiled(doors):
            number = os.read(self.left, 1)
            if number:
                JOBS[number[0]]()
            elif self.copy is None or not self.copy.is_at_work():
                return
            else:
                sleep(LOOK)


_UNDER_WAY: list[Ahead] = []


@contextmanager
def compiling_ahead(
    tell: Callable[[str], None] = lambda _text: None, besides: Sequence[Callable[[], None]] = ()
) -> Iterator[Callable[[Sequence[Door]], None]]:
    """Compile what fits need in a copy of this process while what is inside runs, if this machine has not done so yet.

    Yields what is to be called before the first fit, with what is needed of DOORS: it helps, and does all of it where no copy is
    to be had. What effects add is left to the copy, and what is given as `besides`; what is inside compiles itself what it needs
    sooner. The copy is ended with what is inside.
    """
    if _UNDER_WAY or _are_compiled(DOORS):
        yield _UNDER_WAY[-1].help_along if _UNDER_WAY else lambda _doors: None
        return
    tell("first run on this machine: compiling, about ten seconds, once")
    left = numbered(len(JOBS))
    copy = copied(lambda: _compiled(left, besides))
    _UNDER_WAY.append(Ahead(left, copy))
    try:
        yield _UNDER_WAY[-1].help_along
    finally:
        _UNDER_WAY.pop()
        os.close(left)
        if copy is not None:
            copy.end()


def _compiled(left: int, besides: Sequence[Callable[[], None]]) -> bytes:
    """Compile in a copy, without looking for what could be given back: it makes millions of things, and ends."""
    gc.disable()
    while number := os.read(left, 1):
        JOBS[number[0]]()
    for job in (_effects, *besides):
        job()
    return b""


def _are_compiled(doors: Sequence[Door]) -> bool:
    return all(is_compiled(door) for door in doors)
