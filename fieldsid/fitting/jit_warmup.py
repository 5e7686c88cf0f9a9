"""The compile warm-up: the first fit on a machine compiles for ten seconds, in this process and a forked worker.

Later processes load the compiled code from numba's cache in 0.04 s. A marker file (`warmup_marker`) says that the cache is
complete.
"""

from __future__ import annotations

import gc
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

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
from fieldsid.noise.kalman.univariate import kalman_filter
from fieldsid.noise.maximum_likelihood import estimate_noise
from fieldsid.noise.moment_response import base_responses
from fieldsid.noise.sandwich_covariance import score_covariance, score_covariance_kernel
from fieldsid.noise.whiten import noise_vector, whiten
from fieldsid.numerics.first_order_lag import first_order_lag, held_first_order_lag
from fieldsid.numerics.jit import is_loaded, warmup_marker
from fieldsid.runtime.worker_pool import fork_worker, job_queue

Kernel = Callable[..., object]
SAMPLES = 60
WHITE = Noise(0.01, 0.01)
DISTURBED = Noise(0.01, 0.01, disturbance=0.01, disturbance_time=1.0)


def a_record() -> Record:
    """Return a record of three seconds with every helper signal, as an argument for the kernels to be compiled."""
    time = np.linspace(0.0, 3.0, SAMPLES)
    fin, every = np.where(np.sin(2.0 * time) > 0.0, 0.1, -0.1), np.ones(SAMPLES, dtype=bool)
    angle, rate = 0.1 * np.sin(time), 0.1 * np.cos(time)
    return Record(
        "none", Axis.YAW, time, fin, fin_is_held=True, fin_is_measured=False, angle=angle, rate=rate, angle_ok=every,
        rate_ok=every, cross=angle, cross_ok=every, signals=dict.fromkeys(ROLES, 1.0 + angle), speed=1.0,
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


def _estimate() -> None:
    record = a_record()
    estimate_noise([record], [(1.0, 0.0)], [record.both], "disturbance", DISTURBED)


def _whiten() -> None:
    record = a_record()
    whiten(record, replace(DISTURBED, own_moment=0.01), 1.0, 0.0, record.both[None])


def _lag() -> None:
    record = a_record()
    first_order_lag(record.steps, record.rate, 1.0)
    held_first_order_lag(record.rate, record.angle, 0.0)


def _sandwich() -> None:
    score_covariance(a_record(), noise_vector(DISTURBED), 1.0, 0.0, np.ones((1, 2, SAMPLES)))


def _nonlinear() -> None:
    problem, _ = _a_problem()
    with_effect = problem.with_effects((effect_named("quadratic_damping"),))
    with_effect.linearise(with_effect.start(), 0)
    with_effect.residual(with_effect.start(), 0)


def _effects() -> None:
    problem, _ = _a_problem()
    effects = all_effects(Axis.YAW).values()
    at_fin = tuple(e for e in effects if e.fin is not None)
    for chosen in (*((e,) for e in effects), at_fin, *((with_variant(e, f),) for e in at_fin for f in e.variants)):
        with_effect = problem.with_effects(chosen)
        with_effect.linearise(with_effect.start(), 0)
        equation_error_start(with_effect.records, with_effect.layout)


@dataclass(frozen=True, slots=True)
class WarmupJob:
    """A function to call, and the kernels that the call compiles."""

    run: Callable[[], None]
    kernels: tuple[Kernel, ...]


WARMUP_JOBS = (
    WarmupJob(_linear, (linear_sensitivities, linear_motion, accumulate_normal_equations)),
    WarmupJob(_whiten, (kalman_filter, base_responses)),
    WarmupJob(_nonlinear, (nonlinear_sensitivities, nonlinear_motion)),
    WarmupJob(_lag, (first_order_lag, held_first_order_lag)),
    WarmupJob(_estimate, (score_of_innovations,)),
    WarmupJob(_sandwich, (score_covariance_kernel,)),
)
"""The jobs that compile all kernels of a fit, in the order in which a fit needs them."""
WARMUP_KERNELS = tuple(kernel for job in WARMUP_JOBS for kernel in job.kernels)


def compile_all() -> None:
    """Call once every kernel that a fit and a search over effects use."""
    for job in WARMUP_JOBS:
        job.run()
    _effects()


def load_compiled() -> None:
    """Load the kernels that an earlier process compiled; do nothing where they are loaded or not yet compiled."""
    if not is_loaded(nonlinear_sensitivities) and warmup_marker(WARMUP_KERNELS).exists():
        compile_all()


class Warmup:
    """Jobs that this process and a forked worker take one by one; the worker then compiles the effects and `extra_jobs`."""

    def __init__(self, jobs: Sequence[WarmupJob], extra_jobs: Sequence[Callable[[], None]] = ()) -> None:
        self._jobs, self._done, self._left = jobs, set[int](), job_queue(len(jobs))
        self._reports, report_pipe = os.pipe()
        self._worker = fork_worker(lambda: _compile_jobs(jobs, self._left, report_pipe, extra_jobs)) if jobs else None
        os.close(report_pipe)

    def compile_now(self, kernels: Sequence[Kernel] | None = None) -> None:
        """Run the jobs not yet begun until these kernels, or all, are compiled; wait for the job that the worker is running."""
        requested = None if kernels is None else {id(k) for k in kernels}
        wanted = {i for i, job in enumerate(self._jobs) if requested is None or any(id(k) in requested for k in job.kernels)}
        while wanted - self._done:
            if number := os.read(self._left, 1):
                self._run(number[0])
            elif reports := os.read(self._reports, len(self._jobs)):
                self._done.update(reports)
            else:  # the worker has ended with a job undone
                for left in sorted(wanted - self._done):
                    self._run(left)

    def _run(self, number: int) -> None:
        self._jobs[number].run()
        self._done.add(number)

    def end(self) -> bool:
        """Stop the worker, even within a job, and return whether all jobs were done."""
        if self._worker is not None:
            self._worker.kill()
        while reports := os.read(self._reports, len(self._jobs) + 1):
            self._done.update(reports)
        os.close(self._reports)
        os.close(self._left)
        return len(self._done) == len(self._jobs)


@contextmanager
def warming_up(
    tell: Callable[[str], None] = lambda _text: None, extra_jobs: Sequence[Callable[[], None]] = ()
) -> Iterator[Warmup]:
    """Compile the kernels of a fit in a forked worker while the context runs, where this machine has not compiled them yet.

    Yields the warm-up, whose `compile_now` is to be called before the first fit: it shares the jobs with the worker, and does all
    of them where this process cannot be forked. Only the worker compiles the effects and `extra_jobs`; code in the context that
    needs one of these sooner compiles it on its first call. The worker ends with the context.
    """
    if all(is_loaded(kernel) for kernel in WARMUP_KERNELS) or (marker := warmup_marker(WARMUP_KERNELS)).exists():
        idle = Warmup(())
        try:
            yield idle
        finally:
            idle.end()
        return
    tell("first run on this machine: compiling, about ten seconds, once")
    warmup, is_complete = Warmup(WARMUP_JOBS, extra_jobs), False
    try:
        yield warmup
    finally:
        is_complete = warmup.end()
    if is_complete:
        marker.parent.mkdir(parents=True, exist_ok=True)
        marker.touch()


def _compile_jobs(jobs: Sequence[WarmupJob], left: int, report_pipe: int, extra_jobs: Sequence[Callable[[], None]]) -> bytes:
    """Run jobs in the worker and report their numbers; garbage collection is off, as the worker soon ends."""
    gc.disable()
    while number := os.read(left, 1):
        jobs[number[0]].run()
        os.write(report_pipe, number)
    for job in (_effects, *extra_jobs):
        job()
    return b""
