"""How fast output error is: against SciPy's curve_fit with odeint on the same log, and on a million samples.

    python tests/benchmarks/estimation_speed.py [--long 1000000]

The answers are compared first. Times of the short log are wall time, the best of many, so that another process costs
nothing; of the long log processor time. Memory is the process's largest resident set.
"""

from __future__ import annotations

import argparse
import os
import resource
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np  # noqa: E402
from scipy.integrate import odeint  # noqa: E402
from scipy.optimize import curve_fit  # noqa: E402
from truth.paper import YAW, paper_run  # noqa: E402

from fieldsid.dynamics.assemble import Base, assemble, integrate_record  # noqa: E402
from fieldsid.dynamics.free_run import command_record  # noqa: E402
from fieldsid.estimators.output_error import found_minimum  # noqa: E402
from fieldsid.fitting.fit import fit  # noqa: E402
from fieldsid.fitting.initial.equation_error import equation_error_start  # noqa: E402
from fieldsid.fitting.optimise.levenberg_marquardt import levenberg_marquardt  # noqa: E402
from fieldsid.fitting.problem.parameters import layout_of  # noqa: E402
from fieldsid.fitting.problem.problem import Problem  # noqa: E402
from fieldsid.logs.run import Run  # noqa: E402
from fieldsid.models.axis import Axis  # noqa: E402
from fieldsid.models.effect import effect_named  # noqa: E402
from fieldsid.models.record import Record, record_of  # noqa: E402
from fieldsid.noise.white_floor import white_noise_floor  # noqa: E402

NOISE = 0.005
TARGET_MS, TARGET_RATIO, TARGET_LINEAR_S, TARGET_NONLINEAR_S, TARGET_GIB = 0.5, 100.0, 0.5, 1.0, 1.0


def short_record() -> Record:
    """The paper's experiment: 660 samples."""
    log = paper_run(YAW[1], angle_noise=NOISE, rate_noise=NOISE, seed=1)
    return record_of(Run("paper", log.pop("time_s"), log), Axis.YAW)


def by_odeint(record: Record, x0: np.ndarray) -> np.ndarray:
    """Output error as one writes it with SciPy: angle and rate by odeint, least squares by curve_fit."""
    t, measured = record.time, np.concatenate([record.angle, record.rate])

    fin, step, last = record.fin.tolist(), float(record.steps[0]), len(record) - 1

    def slope(y: np.ndarray, now: float, a: float, b: float, c: float) -> tuple[float, float]:
        return y[1], -a * y[1] + b * fin[min(int(now / step + 1e-9), last)] + c

    def model(_: np.ndarray, a: float, b: float, c: float, angle0: float, rate0: float) -> np.ndarray:
        path = odeint(slope, [angle0, rate0], t, args=(a, b, c), hmax=0.5)
        return np.concatenate([path[:, 0], path[:, 1]])

    return curve_fit(model, np.concatenate([t, t]), measured, p0=x0, epsfcn=1e-8)[0]


def best(call: Callable[[], object], times: int) -> float:
    """Return the shortest wall time of a call in s."""
    found = []
    for _ in range(times):
        start = time.perf_counter()
        call()
        found.append(time.perf_counter() - start)
    return min(found)


def long_record(count: int, effects: tuple[str, ...]) -> Problem:
    """Random 2 s pulses for `count` samples, white noise on both sensors."""
    rng, parts = np.random.default_rng(1), tuple(effect_named(e) for e in effects)
    fin = 0.26 * np.repeat(rng.integers(-1, 2, count // 40 + 1), 40)[:count].astype(float)
    record = command_record(Axis.YAW, np.arange(count) * 0.05, fin, speed=1.4)
    truth = Base(1.1, 0.0, -0.86, 0.002)
    path = integrate_record(record, assemble(record, parts, truth, {"quadratic": 2.0}, 1.0), np.zeros(3))
    ok, noise = np.ones(count, dtype=bool), NOISE * rng.standard_normal((2, count))
    record = replace(record, angle=path[:, 0] + noise[0], rate=path[:, 1] + noise[1], angle_ok=ok, rate_ok=ok)
    return Problem((record,), layout_of([record], Axis.YAW, parts))


def long_fit(count: int, effects: tuple[str, ...]) -> tuple[float, float]:
    """Return processor time in s and the largest error in standard errors."""
    problem = long_record(count, effects)
    found_minimum(Problem((long_record(50_000, effects).records[0],), problem.layout))  # compile
    taken = []
    for _ in range(2):
        start = time.process_time()
        found, _ = found_minimum(problem)
        taken.append(time.process_time() - start)
    truth = np.array([1.1, -0.86, 0.002, 2.0])[: len(problem.layout.names)]
    spread = np.sqrt(np.diag(np.linalg.inv(found.normal)))[: truth.size]
    return min(taken), float(np.max(np.abs(found.x[: truth.size] - truth) / spread))


def main() -> int:
    """Print the table and return 0 when every target is met."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--long", type=int, default=1_000_000)
    count = parser.parse_args().long
    record = short_record()
    problem = Problem((record,), layout_of([record], Axis.YAW, ()))
    floor, start = white_noise_floor([record]), equation_error_start([record], problem.layout)
    found = levenberg_marquardt(problem, start, floor)
    np.testing.assert_allclose(by_odeint(record, start)[:3], found.x[:3], rtol=5e-3)
    ours, path = best(lambda: levenberg_marquardt(problem, start, floor), 200), best(lambda: found_minimum(problem), 100)
    whole = best(lambda: fit([record], Axis.YAW, method="output_error"), 20)
    theirs = best(lambda: by_odeint(record, start), 2)
    print(f"660 samples, descent            {1e3 * ours:8.2f} ms   target <= {TARGET_MS}")
    print(f"  with start and reweighting    {1e3 * path:8.2f} ms")
    print(f"  with errors, notes, judgement {1e3 * whole:8.2f} ms")
    print(f"curve_fit with odeint           {1e3 * theirs:8.1f} ms")
    print(f"ratio                           {theirs / ours:8.0f}      target >= {TARGET_RATIO:.0f}")
    print(f"  with start and reweighting    {theirs / path:8.0f}      target >= {TARGET_RATIO:.0f}")
    linear, off = long_fit(count, ())
    print(f"{count:.0e} samples, linear        {linear:8.2f} s    target <= {TARGET_LINEAR_S}   error {off:.1f} sigma")
    bent, bent_off = long_fit(count, ("quadratic_damping",))
    print(f"{count:.0e} samples, quadratic     {bent:8.2f} s    target <= {TARGET_NONLINEAR_S}   error {bent_off:.1f} sigma")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(f"largest memory                  {peak:8.2f} GiB  target <= {TARGET_GIB}")
    met = ours <= TARGET_MS * 1e-3, theirs / path >= TARGET_RATIO, linear <= TARGET_LINEAR_S, bent <= TARGET_NONLINEAR_S
    return 0 if all(met) and peak <= TARGET_GIB and max(off, bent_off) < 5.0 else 1


if __name__ == "__main__":
    sys.exit(main())
