"""A run's free run with a constant moment of its own: its trim is not quite that of the runs a model was fitted to.

Half a milliradian per second of turning, which no record shows, is two degrees of heading in a minute. So the moment of a
predicted run is a nuisance, as its start and its speed are, with prior N(0, s^2), s the model's own (`Noise.own_moment`), zero
where its runs did not differ. The moment m minimises

    sum over channels |e - r m|^2 / (L s_c^2) + m^2 / s^2,

e the residual and r the response to a unit moment, both free of the run's start, s_c the rms of what is left of e at its best m
and L the correlation length of that, so that the residual of a wrong model has little weight.
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
"""Standard deviations of the prior from which on a moment is told of: a smaller one is what is usual from run to run."""


@dataclass(frozen=True)
class FreeRun:
    """A run's residual (2, n) without a moment of its own, what 1 rad/s^2 of it does (2, n), and the channels' weights (2, 1).

    The response is free of the run's start: with a moment the start moves along.
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
        """What the weighted residual says of the moment, and the information on it, without the prior."""
        shown = self.response * self.weight
        return float(np.vdot(shown, self.residual * self.weight)), float(np.vdot(shown, shown))

    def own_moment(self, std: float) -> float:
        """Return the most probable moment (rad/s^2) under a prior of that standard deviation."""
        said, information = self._information
        return std**2 * said / (1.0 + std**2 * information)

    def squares(self, std: float) -> FloatArray:
        """Return each channel's sum (2,) of squares of the residual with that moment, over the measured samples."""
        moment, (plain, mixed, square) = self.own_moment(std), self._products
        return np.asarray(np.maximum(plain - 2.0 * moment * mixed + moment**2 * square, 0.0))


def free_run(problem: Problem, x: FloatArray, run: int, residual: FloatArray, floor: Noise) -> FreeRun:
    """Return a run's free run at x with its residual (2, n); one that grows without bound has no moment of its own."""
    layout, record = problem.layout, problem.records[run]
    trim = layout.names.index(NAMES[layout.axis].trim)
    starts = [i for i in layout.nuisances_of(run) if layout.parameters[i].name in START_NAMES]
    result = problem.linearise(x, run, [trim, *starts])
    if not np.isfinite(result.stack).all():
        return FreeRun(record, residual, np.zeros_like(residual), np.ones((2, 1)))
    sensitivity = dict(zip(result.columns, result.sensitivity * record.ok, strict=True))
    response, columns = sensitivity[trim] / problem.trim_factor(x, run), np.stack([sensitivity[i] for i in starts])
    scale = channel_weights(record, residual, floor)[:, None]
    flat, shown = (columns * scale).reshape(len(starts), -1), (response * scale).ravel()
    response = response - np.tensordot(solve_normal_equations(flat @ flat.T, flat @ shown), columns, axes=1)
    shown = response * scale
    best = float(np.vdot(shown, residual * scale)) / max(float(np.vdot(shown, shown)), np.finfo(float).tiny)
    return FreeRun(record, residual, response, channel_weights(record, residual - best * response, floor)[:, None])


def with_own_moment(problem: Problem, x: FloatArray, std: float, floor: Noise) -> tuple[FloatArray, float]:
    """Return x of a one-run problem with the run's most probable own moment in its trim, and that moment (rad/s^2)."""
    if not std > 0.0:
        return x, 0.0
    moment = free_run(problem, x, 0, problem.residual(x, 0)[0], floor).own_moment(std)
    moved = x.copy()
    moved[problem.layout.names.index(NAMES[problem.layout.axis].trim)] += moment / problem.trim_factor(x, 0)
    return moved, moment


def moment_note(record: Record, moment: float, std: float) -> Note | None:
    """Return the note on a run that had a moment of its own, None where it is no larger than is usual."""
    if not abs(moment) > MIN_REPORTED_STD * std:
        return None
    return Note(
        "own_moment",
        f"{record.name}: as the motion says, its trim moment was {moment:+.2g} rad/s^2 off that of the model, which differs from "
        f"run to run by {std:.2g} rad/s^2",
        {"run": record.name, "moment_rad_s2": moment, "std_rad_s2": std},
    )
