"""A vehicle's motion and its sensitivities: by the linear kernel for a linear motion at equal steps, else by the nonlinear one.

The equations, drives and constants are those of models/hull.py.
"""

from __future__ import annotations

from fieldsid.dynamics.linear_kernel import linear_motion, linear_sensitivities
from fieldsid.dynamics.nonlinear_kernel import nonlinear_motion, nonlinear_sensitivities
from fieldsid.numerics.arrays import FloatArray, IntArray


def integrate_motion(
    steps: FloatArray, drive: FloatArray, c: FloatArray, start: FloatArray, pieces: int, out: FloatArray
) -> None:
    """Fill out (n, 3) with angle, rate and cross state; from the sample at which the motion diverges on they are NaN.

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
    """Fill out (n, 3) with the motion and sens (P, 2, n) with the derivatives of angle and rate by P parameters.

    The derivative of drive l by parameter j is factor[j, l] times the row place[j, l] of columns (K, n-1); factor and place are
    (P, 6). d_c (P, C) are the derivatives of the constants, d_start (P, 3) those of the initial state.
    """
    if not linear_sensitivities(steps, drive, c, start, pieces, columns, place, factor, d_c, d_start, out, sens):
        nonlinear_sensitivities(steps, drive, c, start, pieces, columns, place, factor, d_c, d_start, out, sens)
