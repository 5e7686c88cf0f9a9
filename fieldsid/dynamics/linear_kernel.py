"""The compiled core of a linear motion: its free run and tangents, and the base model's normal equations without either.

    y' = p,  p' = -a p - k y + m(t),  m straight from the start of an interval to its end; the base model's is b delta + C
With a and k constant the RK4 map of dynamics/integrate.py over an interval is a matrix: it is computed once for a step
length, with its derivatives by a and k, and applied to every sample. Same numbers as the general core, in a third of the time.
"""

from __future__ import annotations

import numpy as np

from fieldsid.models.hull import DAMPING, STIFFNESS, kinds_of
from fieldsid.numerics.arrays import FloatArray, IntArray
from fieldsid.numerics.jit import inner, jit

LINEAR_PARAMETERS = ("damping", "stiffness", "authority", "trim", "angle0", "rate0")
STEP_TOLERANCE = 1e-9
DIVERGED_RATE_RAD_S = 1e4
"""rad/s from which on a motion counts as one without bound."""
FEWEST_INTERVALS = 16
"""Intervals below which working the map out costs more than it saves."""


@inner
def _slope(a: float, k: float, z: FloatArray, moment: float, out: FloatArray) -> None:
    """Fill out (6,) with the derivative of (y, p) and of its tangents by a and by k."""
    out[0], out[1] = z[1], -a * z[1] - k * z[0] + moment
    out[2], out[3] = z[3], -a * z[3] - k * z[2] - z[1]
    out[4], out[5] = z[5], -a * z[5] - k * z[4] - z[0]


@inner
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


@inner
def _small(value: float) -> float:
    """Return zero for what is too small to matter: numbers below the normal ones cost eightfold."""
    return 0.0 if abs(value) < 1e-150 else value


@inner
def set_diverged(out: FloatArray, first: int) -> None:
    """Set the rows of out (n, p) from `first` on to NaN."""
    for i in range(first, out.shape[0]):
        for l in range(out.shape[1]):
            out[i, l] = np.nan


@inner
def set_all_diverged(sens: FloatArray, first: int) -> None:
    """Set the samples of sens (P, 2, n) from `first` on to NaN."""
    for j in range(sens.shape[0]):
        for i in range(first, sens.shape[2]):
            sens[j, 0, i] = sens[j, 1, i] = np.nan


@inner
def is_linear(steps: FloatArray, drive: FloatArray, c: FloatArray, start: FloatArray) -> bool:
    """Whether a motion is linear in (y, p) alone, and goes by even intervals."""
    return not kinds_of(c).bent and start[2] == 0.0 and is_even(steps, drive)


@inner
def is_even(steps: FloatArray, drive: FloatArray) -> bool:
    """Whether steps (n-1,), damping and stiffness, the first two of the drives (n-1, 6), are alike over many intervals."""
    if steps.shape[0] < FEWEST_INTERVALS:
        return False
    for i in range(steps.shape[0]):
        alike = drive[i, DAMPING] == drive[0, DAMPING] and drive[i, STIFFNESS] == drive[0, STIFFNESS]
        if not alike or abs(steps[i] - steps[0]) > STEP_TOLERANCE * steps[0]:
            return False
    return True


@inner
def _responses(a: float, k: float, h: float, pieces: int, u: FloatArray, room: FloatArray) -> None:
    """Fill u (4, 6) with what units of y, p, and of the moment at both ends become over h, and its tangents by a and k."""
    for unit in range(4):
        _unit_response(a, k, h, pieces, unit, u[unit], room)


@jit
def linear_motion(steps: FloatArray, drive: FloatArray, c: FloatArray, start: FloatArray, pieces: int, out: FloatArray) -> bool:
    """Fill out (n, 3) as `integrate.integrate_motion` does where the motion is linear and even; return whether it is."""
    if not is_linear(steps, drive, c, start):
        return False
    u, room = np.zeros((4, 6)), np.zeros((5, 6))
    _responses(drive[0, 0], drive[0, 1], steps[0], pieces, u, room)
    _move(u, drive, start, out)
    return True


@inner
def _move(u: FloatArray, drive: FloatArray, start: FloatArray, out: FloatArray) -> int:
    """Fill out (n, 3) by the responses of an interval; return the samples before the motion diverges."""
    y, p = start[0], start[1]
    out[0, 0], out[0, 1], out[0, 2] = y, p, 0.0
    for i in range(drive.shape[0]):
        m0, m1 = drive[i, 2], drive[i, 3]
        y, p = u[0, 0] * y + u[1, 0] * p + u[2, 0] * m0 + u[3, 0] * m1, u[0, 1] * y + u[1, 1] * p + u[2, 1] * m0 + u[3, 1] * m1
        if not abs(p) < DIVERGED_RATE_RAD_S:
            set_diverged(out, i + 1)
            return i + 1
        out[i + 1, 0], out[i + 1, 1], out[i + 1, 2] = y, p, 0.0
    return int(drive.shape[0] + 1)


@jit
def linear_sensitivities(
    steps: FloatArray, drive: FloatArray, c: FloatArray, start: FloatArray, pieces: int, columns: FloatArray, place: IntArray,
    factor: FloatArray, d_c: FloatArray, d_start: FloatArray, out: FloatArray, sens: FloatArray,
) -> bool:  # fmt: skip
    """Fill out (n, 3) and sens (P, 2, n) as `integrate.integrate_with_sensitivities` does where all is linear and even.

    Return whether it is.
    """
    bent = 0.0
    for j in range(d_c.shape[0]):
        bent += abs(d_start[j, 2])
        for l in range(d_c.shape[1]):
            bent += abs(d_c[j, l])
    if bent != 0.0 or not is_linear(steps, drive, c, start):
        return False
    u, room = np.zeros((4, 6)), np.zeros((5, 6))
    _responses(drive[0, 0], drive[0, 1], steps[0], pieces, u, room)
    whole = _move(u, drive, start, out)
    for j in range(place.shape[0]):
        y, p = d_start[j, 0], d_start[j, 1]
        f_a, f_k, f_0, f_1 = factor[j, 0], factor[j, 1], factor[j, 2], factor[j, 3]
        of_a, of_k, of_0, of_1 = columns[place[j, 0]], columns[place[j, 1]], columns[place[j, 2]], columns[place[j, 3]]
        turned, pushed = f_a != 0.0 or f_k != 0.0, f_0 != 0.0 or f_1 != 0.0
        sens[j, 0, 0], sens[j, 1, 0] = y, p
        for i in range(whole - 1):
            to_y, to_p = u[0, 0] * y + u[1, 0] * p, u[0, 1] * y + u[1, 1] * p
            if pushed:
                m0, m1 = f_0 * of_0[i], f_1 * of_1[i]
                to_y += u[2, 0] * m0 + u[3, 0] * m1
                to_p += u[2, 1] * m0 + u[3, 1] * m1
            if turned:
                a, k, at_y, at_p, m0, m1 = f_a * of_a[i], f_k * of_k[i], out[i, 0], out[i, 1], drive[i, 2], drive[i, 3]
                to_y += a * (u[0, 2] * at_y + u[1, 2] * at_p + u[2, 2] * m0 + u[3, 2] * m1)
                to_p += a * (u[0, 3] * at_y + u[1, 3] * at_p + u[2, 3] * m0 + u[3, 3] * m1)
                to_y += k * (u[0, 4] * at_y + u[1, 4] * at_p + u[2, 4] * m0 + u[3, 4] * m1)
                to_p += k * (u[0, 5] * at_y + u[1, 5] * at_p + u[2, 5] * m0 + u[3, 5] * m1)
            y, p = _small(to_y), _small(to_p)
            sens[j, 0, i + 1], sens[j, 1, i + 1] = y, p
    set_all_diverged(sens, whole)
    return True


@jit
def accumulate_normal_equations(  # noqa: C901  (one loop over the samples: a call in it would double its time)
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
            _responses(a, k, h, pieces, u, room)
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
