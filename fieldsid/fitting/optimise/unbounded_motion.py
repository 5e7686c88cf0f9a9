"""Refuse a fit whose free run grows without bound on one of the runs fitted, with the name of the run."""

from __future__ import annotations

import numpy as np

from fieldsid.errors import DivergenceError
from fieldsid.fitting.problem.problem import Problem
from fieldsid.numerics.arrays import FloatArray


def refuse_unbounded_motion(problem: Problem, x: FloatArray, method: str, *, instead: str) -> None:
    """Raise DivergenceError where the free run at x (N,) grows without bound; `instead` is a remedy other than another log."""
    for run, record in enumerate(problem.records):
        rate = problem.simulate(x, run)[0].rate
        if np.isfinite(rate).all():
            continue
        values = ", ".join(f"{n} = {v:.3g}" for n, v in zip(problem.layout.names, x.tolist(), strict=False))
        raise DivergenceError(
            f"the fit of `{method}` grows without bound when it is simulated on run {record.name!r}",
            found=f"{values}; diverged at t = {record.time[np.argmin(np.isfinite(rate))]:.2f} s",
            hint=f"{instead}; an angle, a rate or a fin of the wrong sign makes a vehicle look unstable: `sysid inspect LOG`",
        )
