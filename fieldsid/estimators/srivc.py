"""Refined instrumental variables for logs with an angle and no rate: the filter is one over the model's denominator.

All signals are filtered by 1/A(s), A = s^2 + a s + k of the last estimate, so that the residual is the output error. The
instruments are the same signals of the noise-free simulation, which sensor noise does not bias:
    Theta = (Z' Phi)^-1 Z' Q,   Phi = [-y'_f, -y_f, delta_f, 1_f, start terms],   Q = y''_f,   Z as Phi of the simulation.
The filter is the compiled simulation core: it treats the command as a zero-order hold and allows unequal steps. Between samples
the measurement is interpolated with the shape of the simulation. Source: Young and Jakeman 1980; Garnier and Wang 2008, chapter
4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldsid.errors import DataError
from fieldsid.estimators.svf_ls import base_slots, feedback_notes, finished, median_step, parameters_of, regress
from fieldsid.fitting.problem.estimator import Estimator, Options, Solution
from fieldsid.fitting.problem.problem import Problem
from fieldsid.fitting.regression.instruments import (
    MIN_FILTER_DAMPING,
    instrumental_variables,
    refuse_unbounded_instruments,
    through,
)
from fieldsid.fitting.regression.noise_transfer import Transfer
from fieldsid.fitting.regression.residual_colour_covariance import Series, coloured_covariance
from fieldsid.fitting.regression.svf_equation import RegressionParameters, measured_signals
from fieldsid.logs.run import Note
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray

MAX_SRIVC_ITERATIONS = 30
CONVERGED_RELATIVE_CHANGE = 1e-7
MAX_SIMULATION_STEP_S = 0.0125
"""Longest step of the simulation between samples."""


@dataclass(frozen=True, slots=True)
class Rows:
    """Regression rows: columns (n, 4 + 2) of damping, stiffness, authority, trim and start terms; target (n,)."""

    columns: FloatArray
    target: FloatArray


def solve(problem: Problem, options: Options) -> Solution:
    """Return the instrumental-variable solution of one run.

    Raises DataError where no angle was measured, DivergenceError where the instruments grow without bound.
    """
    record = problem.records[0]
    if not record.angle_ok.any():
        raise DataError(
            f"run {record.name!r} has no measured angle, which `srivc` works on",
            found="a rate only",
            hint="use `--method output_error`",
        )
    x = regress(problem, options.bandwidth).x
    slots = list(base_slots(problem).values())
    keep = [0, 1, 2, 3, 4, 5] if len(slots) == 4 else [0, 2, 3, 4, 5]
    use = measured_signals(record, options.bandwidth).use & record.angle_ok
    state = np.array([problem.state_of(x, 0)[0], 0.0])
    moved, rounds = np.inf, 0
    while moved > CONVERGED_RELATIVE_CHANGE and rounds < MAX_SRIVC_ITERATIONS:
        theta, rounds = parameters_of(problem, x, 0), rounds + 1
        rows, instruments = filtered_rows(record, theta, state)
        phi, z = rows.columns[use][:, keep], instruments.columns[use][:, keep]
        refuse_unbounded_instruments(record, theta, z, phi)
        found, inverse = instrumental_variables(z, phi, rows.target[use])
        moved = float(np.max(np.abs(found[: len(slots)] - x[slots]) / (np.abs(x[slots]) + 1e-3)))
        x[slots] = found[: len(slots)]
        damping = max(theta.damping, MIN_FILTER_DAMPING)
        # the start terms are y0 of f' and y'(0) + a y0 of f, with f the filter's impulse response
        state = np.array([found[-1], found[-2] - damping * found[-1]])
    residual = rows.target[use] - phi @ found
    series = Series(z, residual, Transfer(np.ones(1), np.ones(1)), median_step(record))
    notes = (*feedback_notes(problem, [series]), *notes_of(rounds, moved))
    return finished(problem, x, coloured_covariance([series], inverse), ESTIMATOR.name, notes)


def filtered_rows(record: Record, theta: RegressionParameters, state: FloatArray) -> tuple[Rows, Rows]:
    """Return the rows of the measurement and those of the noise-free simulation from a state (angle, rate)."""
    measured, path = measured_signals(record, 4.0).angle, record.commanded
    pieces = max(1, int(np.ceil(float(np.max(record.steps)) / MAX_SIMULATION_STEP_S)))
    fine = np.repeat(record.steps / pieces, pieces)
    part = np.tile(np.arange(pieces) / pieces, record.steps.size)
    start, change = np.repeat(path.start, pieces), np.repeat(path.end - path.start, pieces)
    fin = start + change * part, start + change * (part + 1.0 / pieces)
    a, k = max(theta.damping, MIN_FILTER_DAMPING), max(theta.stiffness, 0.0)
    moment = [theta.authority * f + theta.trim for f in fin]
    motion = through(fine, a, k, moment[0], moment[1], state)[:, 0]
    every = slice(None, None, pieces)
    smooth = through(fine, a, k, motion[:-1], motion[1:])[every]
    deviation = measured - motion[every]
    rough = smooth + through(record.steps, a, k, deviation[:-1], deviation[1:])
    inputs = [through(fine, a, k, *fin)[every, 0], through(fine, a, k, np.ones(fine.size), np.ones(fine.size))[every, 0]]
    impulse = through(record.steps, a, k, np.zeros(record.steps.size), np.zeros(record.steps.size), np.array([0.0, 1.0]))
    return _rows(measured, rough, inputs, impulse, a, k), _rows(motion[every], smooth, inputs, impulse, a, k)


def _rows(angle: FloatArray, out: FloatArray, inputs: list[FloatArray], impulse: FloatArray, a: float, k: float) -> Rows:
    columns = np.column_stack([-out[:, 1], -out[:, 0], *inputs, impulse[:, 0], impulse[:, 1]])
    return Rows(columns, angle - a * out[:, 1] - k * out[:, 0])


def notes_of(rounds: int, moved: float) -> tuple[Note, ...]:
    """Return the note on iterations that did not converge."""
    if moved <= 1e-3:
        return ()
    message = f"the instrumental variables did not settle in {rounds} rounds (last change {100 * moved:.2g} %)"
    return (Note("not_converged", message, {"rounds": rounds, "change": moved, "limit": 1e-3}),)


ESTIMATOR = Estimator(
    name="srivc",
    says="refined instrumental variables on the angle alone: no bias by sensor noise, for logs without a rate",
    source="Young and Jakeman 1980, Int. J. Control 31; Garnier and Wang 2008, chapter 4",
    solve=solve,
    takes_effects=False,
    joint=False,
)
