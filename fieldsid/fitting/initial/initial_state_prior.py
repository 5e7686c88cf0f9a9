"""The prior of a free run's initial state, from the first second of its measurement, with its standard error."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.fitting.optimise.levenberg_marquardt import GaussianPrior
from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.model import Noise
from fieldsid.numerics.arrays import FloatArray

PRIOR_SPAN_S = 1.0
FEWEST_SAMPLES = 5


def initial_state_prior(problem: Problem, run: int, floor: Noise) -> GaussianPrior | None:
    """Return the prior of a run's angle0 and rate0; None where the model has a sensor effect between motion and log.

    rate0 is the initial value of a line through the first second of the rate. angle0 is that of a line through the angle less the
    integral of the rate. `floor` is the least noise of both.
    """
    if any(e.measure is not None for e in problem.layout.effects):
        return None
    record, size = problem.records[run], len(problem.layout.parameters)
    early = record.time - record.time[0] <= PRIOR_SPAN_S
    centre, precision = np.zeros(size), np.zeros(size)
    turned = np.zeros(len(record))
    if record.rate_ok.all():
        turned[1:] = np.cumsum(0.5 * (record.rate[1:] + record.rate[:-1]) * record.steps)
    channels = (
        ("angle0", record.angle - turned, record.angle_ok, floor.angle),
        ("rate0", record.rate, record.rate_ok, floor.rate),
    )
    for name, values, ok, noise in channels:
        slot = next(i for i in problem.layout.nuisances_of(run) if problem.layout.parameters[i].name == name)
        known = line_start(record.time[early & ok] - record.time[0], values[early & ok], noise)
        if known is not None:
            centre[slot], precision[slot] = known[0], 1.0 / known[1] ** 2
    return GaussianPrior(centre, np.diag(precision))


def line_start(time: FloatArray, values: npt.NDArray[np.float64], noise: float) -> tuple[float, float] | None:
    """Return the value at time 0 of a line through samples (m,), and its standard error; None for too few of them."""
    if time.size < FEWEST_SAMPLES:
        return None
    middle = float(time.mean())
    off = time - middle
    square = float(off @ off)
    mean, slope = float(values.mean()), float(off @ values) / square
    left = values - mean - slope * off
    spread = max(float(np.sqrt(left @ left / (time.size - 2))), noise)
    return mean - slope * middle, spread * float(np.sqrt(1.0 / time.size + middle**2 / square))
