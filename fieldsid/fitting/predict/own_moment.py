"""The free run of a predicted run with a constant moment, as its trim differs a little from that of the runs fitted to.

A rate offset of half a milliradian per second, which no record shows, adds up to two degrees of heading in a minute. The moment m
of a predicted run is therefore a nuisance parameter, as its initial state and its speed are. Its prior is N(0, s^2) with s from
the model (`Noise.own_moment`), zero where the trims of the fitted runs did not differ. It minimises

    sum over channels |e - r m|^2 / (L s_c^2) + m^2 / s^2,

where e is the residual and r the response to a unit moment, both with the initial state projected out, s_c the rms of e - r m at
the best m and L its correlation length. The residual of a wrong model thus has little weight.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fieldsid.fitting.predict.speed_correction import channel_weights
from fieldsid.fitting.problem.parameters import START_NAMES
from fieldsid.fitting.problem.problem import Problem
from fieldsid.logs.run import Note
from fieldsid.models.axis import NAMES
from fieldsid.models.model import Noise
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.gram_least_squares import solve_normal_equations

MIN_REPORTED_STD = 1.0
"""Standard deviations of the prior from which on a moment is reported: smaller ones are usual from run to run."""


@dataclass(frozen=True)
class FreeRun:
    """A run's residual (2, n) without a moment, the response to a unit moment (2, n), and the channels' weights (2, 1).

    The initial state is projected out of the response, as it is refitted together with the moment.
    """

    record: Record
    residual: FloatArray
    response: FloatArray
    weight: FloatArray

    @cached_property
    def counts(self) -> FloatArray:
        """The number of measured samples of each channel (2,)."""
        return np.asarray(self.record.ok.sum(axis=1), dtype=float)

    @cached_property
    def _products(self) -> FloatArray:
        """Sums (3, 2) over each channel's measured samples: residual squared, residual by response, response squared."""
        e, r = (np.where(self.record.ok, of, 0.0) for of in (self.residual, self.response))
        return np.array([[float(a @ b) for a, b in zip(one, other, strict=True)] for one, other in ((e, e), (e, r), (r, r))])

    @cached_property
    def _information(self) -> tuple[float, float]:
        """Response times residual, both weighted, and the information about the moment, without the prior."""
        weighted = self.response * self.weight
        return float(np.vdot(weighted, self.residual * self.weight)), float(np.vdot(weighted, weighted))

    def own_moment(self, std: float) -> float:
        """Return the most probable moment (rad/s^2) under a prior of that standard deviation."""
        pull, information = self._information
        return std**2 * pull / (1.0 + std**2 * information)

    def squares(self, std: float) -> FloatArray:
        """Return each channel's sum (2,) of squares of the residual with that moment, over the measured samples."""
        moment, (plain, mixed, square) = self.own_moment(std), self._products
        return np.asarray(np.maximum(plain - 2.0 * moment * mixed + moment**2 * square, 0.0))


def free_run(problem: Problem, x: FloatArray, run: int, residual: FloatArray, floor: Noise) -> FreeRun:
    """Return a run's free run at x with its residual (2, n); the response is zero where the motion grows without bound."""
    layout, record = problem.layout, problem.records[run]
    trim = layout.names.index(NAMES[layout.axis].trim)
    starts = [i for i in layout.nuisances_of(run) if layout.parameters[i].name in START_NAMES]
    result = problem.linearise(x, run, [trim, *starts])
    if not np.isfinite(result.stack).all():
        return FreeRun(record, residual, np.zeros_like(residual), np.ones((2, 1)))
    sensitivity = dict(zip(result.columns, result.sensitivity * record.ok, strict=True))
    response, columns = sensitivity[trim] / problem.trim_factor(x, run), np.stack([sensitivity[i] for i in starts])
    scale = channel_weights(record, residual, floor)[:, None]
    flat, weighted = (columns * scale).reshape(len(starts), -1), (response * scale).ravel()
    response = response - np.tensordot(solve_normal_equations(flat @ flat.T, flat @ weighted), columns, axes=1)
    weighted = response * scale
    best = float(np.vdot(weighted, residual * scale)) / max(float(np.vdot(weighted, weighted)), np.finfo(float).tiny)
    return FreeRun(record, residual, response, channel_weights(record, residual - best * response, floor)[:, None])


def with_own_moment(problem: Problem, x: FloatArray, std: float, floor: Noise) -> tuple[FloatArray, float]:
    """Return x of a one-run problem with the run's most probable moment added to its trim, and that moment (rad/s^2)."""
    if not std > 0.0:
        return x, 0.0
    moment = free_run(problem, x, 0, problem.residual(x, 0)[0], floor).own_moment(std)
    moved = x.copy()
    moved[problem.layout.names.index(NAMES[problem.layout.axis].trim)] += moment / problem.trim_factor(x, 0)
    return moved, moment


def moment_note(record: Record, moment: float, std: float) -> Note | None:
    """Return the note on a run whose moment is larger than usual from run to run, else None."""
    if not abs(moment) > MIN_REPORTED_STD * std:
        return None
    return Note(
        "own_moment",
        f"{record.name}: as the motion says, its trim moment was {moment:+.2g} rad/s^2 off that of the model, which differs from "
        f"run to run by {std:.2g} rad/s^2",
        {"run": record.name, "moment_rad_s2": moment, "std_rad_s2": std},
    )
