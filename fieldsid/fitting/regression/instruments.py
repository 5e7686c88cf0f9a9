"""Instrumental variables for the filtered equation of motion: its columns as the fin alone would make them.

A disturbance of the hull is in the residual of q = phi' Theta, and, through the hull's motion, in the columns phi as well; so is
the noise of the sensors: least squares is biased by both. The instruments z are phi of the motion that the fin gives to a hull
with the present estimate. They know neither, and Theta = (Z' Phi)^-1 Z' q has the bias of neither, except where a controller
moves the fin by what it measures. Source: Soederstroem and Stoica 1983, Instrumental Variable Methods for System Identification.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldsid.dynamics import integrate
from fieldsid.dynamics.assemble import pieces_for
from fieldsid.errors import DivergenceError
from fieldsid.fitting.regression.svf_equation import Measured, RegressionParameters
from fieldsid.models.hull import CONSTANTS, DAMPING, DRIVES, MOMENT_END, MOMENT_START, STIFFNESS
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray

MIN_FILTER_DAMPING = 0.05
"""Least damping (1/s) of the filter: an unstable estimate must not become an unstable filter."""


def through(
    steps: FloatArray, a: float, k: float, start: FloatArray, end: FloatArray, state: FloatArray | None = None
) -> FloatArray:
    """Return a signal, linear over each interval, filtered by 1/(s^2 + a s + k), and its derivative: (n, 2)."""
    drive = np.zeros((steps.size, len(DRIVES)))
    drive[:, DAMPING], drive[:, STIFFNESS], drive[:, MOMENT_START], drive[:, MOMENT_END] = a, k, start, end
    first = np.zeros(3) if state is None else np.array([state[0], state[1], 0.0])
    out = np.empty((steps.size + 1, 3))
    pieces = pieces_for(float(steps.max()), a, k**0.5)
    integrate.integrate_motion(steps, drive, np.zeros(len(CONSTANTS)), first, pieces, out)
    return out[:, :2]


def moved_by_fin(record: Record, signals: Measured, theta: RegressionParameters) -> Measured:
    """Return the signals (n,) of a record as the fin alone makes them of a hull with parameters theta, from rest.

    Raises DivergenceError where they grow without bound.
    """
    path, first = record.commanded, np.array([signals.angle[0], 0.0])
    start, end = (theta.authority * fin + theta.trim for fin in (path.start, path.end))
    motion = through(record.steps, max(theta.damping, MIN_FILTER_DAMPING), max(theta.stiffness, 0.0), start, end, first)
    refuse_unbounded_instruments(record, theta, motion)
    return replace(signals, angle=motion[:, 0], rate=motion[:, 1])


def refuse_unbounded_instruments(record: Record, theta: RegressionParameters, *signals: FloatArray) -> None:
    """Raise DivergenceError where signals that parameters theta make are not finite."""
    if not all(np.isfinite(s).all() for s in signals):
        raise DivergenceError(
            f"the instrumental variables of run {record.name!r} grow without bound",
            found=f"damping {theta.damping:.3g}, stiffness {theta.stiffness:.3g}, authority {theta.authority:.3g}",
            hint="use `--method output_error`, which keeps to motions that stay bounded",
        )


def instrumental_variables(instruments: FloatArray, columns: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return Theta (p,) of rows (n, p) and target (n,), and the inverse (p, p) of Phi' Z, zero in directions without signal."""
    size = np.linalg.norm(instruments, axis=0)
    scale = np.where(size > 0.0, 1.0 / np.maximum(size, 1e-300), 0.0)
    z = instruments * scale
    inverse = np.linalg.pinv(z.T @ (columns * scale), rcond=1e-13)
    return np.asarray(scale * (inverse @ (z.T @ target))), np.asarray(scale[:, None] * inverse.T * scale)
