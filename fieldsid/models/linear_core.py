"""The compiled core of the base model alone: normal equations of its free run, without keeping a trajectory.

    y' = p,  p' = -a p - k y + b delta + C
With a and k constant the RK4 map of models/kernels.py over an interval is a matrix: it is worked out once for a step
length, with its derivatives by a and k, and applied to every sample. Same numbers as the general core, in one pass.
"""

from __future__ import annotations

import numpy as np

from fieldsid.logs.run import FloatArray
from fieldsid.models.jit import jit

PARAMETERS = ("damping", "stiffness", "authority", "trim", "angle0", "rate0")
STEP_TOLERANCE = 1e-9


@jit
def _slope(a: float, k: float, z: FloatArray, moment: float, out: FloatArray) -> None:
    """Fill out (6,) with the derivative of (y, p) and of its tangents by a and by k."""
    out[0], out[1] = z[1], -a * z[1] - k * z[0] + moment
    out[2], out[3] = z[3], -a * z[3] - k * z[2] - z[1]
    out[4], out[5] = z[5], -a * z[5] - k * z[4] - z[0]


@jit
def _unit_response(a: float, k: float, h: float, pieces: int, unit: int, z: FloatArray, room: FloatArray) -> None:
    """Fill z (6,) with what a unit of y (0), p (1), or of the moment at the start (2) or end (3) becomes over h."""
    z[:] = 0.0
    if unit < 2:
        z[unit] = 1.0
    m0, m1 = (1.0 if unit == 2 else 0.0), (1.0 if unit == 3 else 0.0)
    s = h / pieces
    for piece in range(pieces):
        for stage in range(4):
            reach = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
            part = (piece + reach) / pieces
            for l in range(6):
                room[4, l] = z[l] + (reach * s * room[stage - 1, l] if stage > 0 else 0.0)
            _slope(a, k, room[4], m0 + (m1 - m0) * part, room[stage])
        for l in range(6):
            z[l] += s / 6.0 * (room[0, l] + 2.0 * room[1, l] + 2.0 * room[2, l] + room[3, l])


@jit
def _small(value: float) -> float:
    """Return zero for what is too small to matter: numbers below the normal ones cost eightfold."""
    return 0.0 if abs(value) < 1e-150 else value


@jit
def accumulate(  # noqa: C901  (one loop over the samples: a call in it would double its time)
    steps: FloatArray,
    fin: FloatArray,
    measured: FloatArray,
    weight: FloatArray,
    base: FloatArray,
    pieces: int,
    square: FloatArray,
) -> None:
    """Add products of the weighted residual and its six sensitivities to square (8, 7).

    fin (2, n-1) holds the fin at both ends of each interval, measured (2, n) angle and rate, weight (2, n) one over
    their noise, zero where not measured; base (6,) is in the order of PARAMETERS. Row 0 and column 0 are the residual;
    square[7, :2] takes the unweighted sums of squares of both channels.
    """
    n = steps.shape[0] + 1
    a, k, b, c, y, p = base[0], base[1], base[2], base[3], base[4], base[5]
    u, room = np.zeros((4, 6)), np.zeros((5, 6))
    s = np.zeros((6, 2))
    s[4, 0] = s[5, 1] = 1.0
    row = np.zeros(7)
    last = -1.0
    for i in range(n):
        for ch in range(2):
            w = weight[ch, i]
            if w == 0.0:
                continue
            e = measured[ch, i] - (y if ch == 0 else p)
            square[7, ch] += e * e
            row[0] = w * e
            for j in range(6):
                row[j + 1] = w * s[j, ch]
            for j in range(7):
                for l in range(j + 1):
                    square[j, l] += row[j] * row[l]
        if i == n - 1:
            break
        h = steps[i]
        if abs(h - last) > STEP_TOLERANCE * h:
            last = h
            for unit in range(4):
                _unit_response(a, k, h, pieces, unit, u[unit], room)
        d0, d1 = fin[0, i], fin[1, i]
        m0, m1 = b * d0 + c, b * d1 + c
        for j in range(6):
            s0, s1 = s[j, 0], s[j, 1]
            s[j, 0] = _small(u[0, 0] * s0 + u[1, 0] * s1)
            s[j, 1] = _small(u[0, 1] * s0 + u[1, 1] * s1)
        for l in range(2):
            s[0, l] += u[0, 2 + l] * y + u[1, 2 + l] * p + u[2, 2 + l] * m0 + u[3, 2 + l] * m1
            s[1, l] += u[0, 4 + l] * y + u[1, 4 + l] * p + u[2, 4 + l] * m0 + u[3, 4 + l] * m1
            s[2, l] += u[2, l] * d0 + u[3, l] * d1
            s[3, l] += u[2, l] + u[3, l]
        y, p = u[0, 0] * y + u[1, 0] * p + u[2, 0] * m0 + u[3, 0] * m1, u[0, 1] * y + u[1, 1] * p + u[2, 1] * m0 + u[3, 1] * m1
