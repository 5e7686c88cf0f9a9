"""The first fit on a machine compiles for ten seconds: in a copy of this process and, once it needs the result, in this one."""

from __future__ import annotations

import gc
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from time import sleep

import numpy as np

from fieldsid.dynamics.linear_kernel import accumulate_normal_equations, linear_motion, linear_sensitivities
from fieldsid.dynamics.nonlinear_kernel import nonlinear_motion, nonlinear_sensitivities
from fieldsid.effects import all_effects
from fieldsid.fitting.initial.equation_error import equation_error_start
from fieldsid.fitting.optimise.levenberg_marquardt import levenberg_marquardt
from fieldsid.fitting.problem.parameters import layout_of, speed_groups
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.axis import Axis
from fieldsid.models.effect import effect_named, with_variant
from fieldsid.models.model import Noise
from fieldsid.models.record import ROLES, Record
from fieldsid.noise.fisher_scoring import score_of_innovations
from fieldsid.noise.kalman.disturbance import disturbance_filter
from fieldsid.noise.kalman.full import full_filter
from fieldsid.noise.kalman.full_batched import full_filter_batched
from fieldsid.noise.kalman.sensor_colour import sensor_colour_filter
from fieldsid.noise.maximum_likelihood import estimate_noise
from fieldsid.noise.sandwich_covariance import score_covariance, score_covariance_kernel
from fieldsid.noise.whiten import noise_vector, whiten
from fieldsid.numerics.first_order_lag import first_order_lag
from fieldsid.numerics.jit import is_compiled, is_loaded
from fieldsid.runtime.worker_pool import Worker, fork_worker, job_queue

Kernel = Callable[..., object]
SAMPLES = 60
WHITE = Noise(0.01, 0.01)
DISTURBED = Noise(0.01, 0.01, disturbance=0.01, disturbance_time=1.0)
WARMUP_KERNELS = (
    linear_sensitivities,
    linear_motion,
    accumulate_normal_equations,
    nonlinear_sensitivities,
    nonlinear_motion,
    first_order_lag,
    disturbance_filter,
    sensor_colour_filter,
    full_filter,
    full_filter_batched,
    score_of_innovations,
    score_covariance_kernel,
)
"""What a fit calls; JOBS compile it."""
POLL_INTERVAL_S = 0.01
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
    x = equation_error_start((record,), problem.layout)
    problem.linearise(x, 0)
    problem.residual(x, 0)
    levenberg_marquardt(problem, x, WHITE, max_iterations=1)


def _estimate(noise_kind: str) -> None:
    record = a_record()
    estimate_noise([record], [(1.0, 0.0)], [record.both], noise_kind, DISTURBED)


def _whiten(noise: Noise) -> None:
    record = a_record()
    whiten(record, noise, 1.0, 0.0, record.both[None])


def _lag() -> None:
    record = a_record()
    first_order_lag(record.steps, record.rate, 1.0)


def _sandwich() -> None:
    score_covariance(a_record(), noise_vector(DISTURBED), 1.0, 0.0, np.ones((1, 2, SAMPLES)))


def _nonlinear() -> None:
    problem, _ = _a_problem()
    more = problem.with_effects((effect_named("quadratic_damping"),))
    more.linearise(more.start(), 0)
    more.residual(more.start(), 0)


def _effects() -> None:
    problem, _ = _a_problem()
    effects = all_effects(Axis.YAW).values()
    at_fin = tuple(e for e in effects if e.fin is not None)
    for own in (*((e,) for e in effects), at_fin, *((with_variant(e, f),) for e in at_fin for f in e.variants)):
        more = problem.with_effects(own)
        more.linearise(more.start(), 0)


WARMUP_JOBS: tuple[Callable[[], None], ...] = (
    _linear, lambda: _whiten(DISTURBED), _nonlinear, _lag, lambda: _estimate("disturbance"), lambda: _estimate("coloured"),
    lambda: _whiten(replace(DISTURBED, coloured_rate=0.01)), lambda: _estimate("both"), _sandwich,
)  # fmt: skip
"""Each calls some of DOORS once, what is needed first before the rest."""


def compile_all() -> None:
    """Call everything once that a fit and a search for what is missing use."""
    for job in (*WARMUP_JOBS, _effects):
        job()


def load_compiled() -> None:
    """Load what an earlier process compiled, once; nothing where that must still be done."""
    if not is_loaded(nonlinear_sensitivities) and _are_compiled(WARMUP_KERNELS):
        compile_all()


@dataclass(frozen=True, slots=True)
class Warmup:
    """Compiling under way: the jobs nobody has begun, and the copy of this process that does them one by one."""

    left: int
    copy: Worker | None

    def compile_now(self, doors: Sequence[Kernel] = WARMUP_KERNELS) -> None:
        """Do what nobody has begun until everything asked for is compiled, and wait for what the copy is at."""
        while not _are_compiled(doors):
            number = os.read(self.left, 1)
            if number:
                WARMUP_JOBS[number[0]]()
            elif self.copy is None or not self.copy.is_at_work():
                return
            else:
                sleep(POLL_INTERVAL_S)


_UNDER_WAY: list[Warmup] = []


@contextmanager
def warming_up(
    tell: Callable[[str], None] = lambda _text: None, besides: Sequence[Callable[[], None]] = ()
) -> Iterator[Callable[[Sequence[Kernel]], None]]:
    """Compile what fits need in a copy of this process while what is inside runs, if this machine has not done so yet.

    Yields what is to be called before the first fit, with what is needed of DOORS: it helps, and does all of it where no copy is
    to be had. What effects add is left to the copy, and what is given as `besides`; what is inside compiles itself what it needs
    sooner. The copy is ended with what is inside.
    """
    if _UNDER_WAY or _are_compiled(WARMUP_KERNELS):
        yield _UNDER_WAY[-1].compile_now if _UNDER_WAY else lambda _doors: None
        return
    tell("first run on this machine: compiling, about ten seconds, once")
    left = job_queue(len(WARMUP_JOBS))
    copy = fork_worker(lambda: _compiled(left, besides))
    _UNDER_WAY.append(Warmup(left, copy))
    try:
        yield _UNDER_WAY[-1].compile_now
    finally:
        _UNDER_WAY.pop()
        os.close(left)
        if copy is not None:
            copy.end()


def _compiled(left: int, besides: Sequence[Callable[[], None]]) -> bytes:
    """Compile in a copy, without looking for what could be given back: it makes millions of things, and ends."""
    gc.disable()
    while number := os.read(left, 1):
        WARMUP_JOBS[number[0]]()
    for job in (_effects, *besides):
        job()
    return b""


def _are_compiled(doors: Sequence[Kernel]) -> bool:
    return all(is_compiled(door) for door in doors)
