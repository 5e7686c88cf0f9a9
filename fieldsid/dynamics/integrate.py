"""A vehicle's motion and its tangents: by the linear core where the motion is linear on an even clock, else by the general one.

The equations, drives and constants are those of models/hull.py.
"""

from __future__ import annotations

from fieldsid.dynamics.linear_kernel import linear_motion, linear_sensitivities
from fieldsid.dynamics.nonlinear_kernel import nonlinear_motion, nonlinear_sensitivities
from fieldsid.numerics.arrays import FloatArray, IntArray


def integrate_motion(
    steps: FloatArray, drive: FloatArray, c: FloatArray, start: FloatArray, pieces: int, out: FloatArray
) -> None:
    """Fill out (n, 3) with angle, rate and cross state; a diverged motion is NaN from there on.

    steps (n-1,) s, drive (n-1, 6) in the order of DRIVES, c (C,) in that of CONSTANTS (models/hull.py), start (3,).
    """
    if not linear_motion(steps, drive, c, start, pieces, out):
        nonlinear_motion(steps, drive, c, start, pieces, out)


def integrate_with_sensitivities(
    steps: FloatArray,
    drive: FloatArray,
    c: FloatArray,
    start: FloatArray,
    pieces: int,
    columns: FloatArray,
    place: IntArray,
    factor: FloatArray,
    d_c: FloatArray,
    d_start: FloatArray,
    out: FloatArray,
    sens: FloatArray,
) -> None:
    """Fill out (n, 3) and sens (P, 2, n): derivatives of angle and rate by P parameters.

    A parameter's derivative of a drive is factor (P, 6) times the row of columns (C, n-1) that place (P, 6) says.
    d_c (P, C) are those of the constants, d_start (P, 3) those of the initial state.
    """
    if not linear_sensitivities(steps, drive, c, start, pieces, columns, place, factor, d_c, d_start, out, sens):
        nonlinear_sensitivities(steps, drive, c, start, pieces, columns, place, factor, d_c, d_start, out, sens)
