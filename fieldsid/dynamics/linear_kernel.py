"""The compiled kernel of a linear motion: its free run with sensitivities, and the normal equations of the base model.

    y' = p,  p' = -a p - k y + m(t),  m linear over an interval; in the base model m = b delta + C
With a and k constant the RK4 map of an interval is a matrix. It is computed once for a step length, with its derivatives by
a and k, and applied to every sample: the numbers of the nonlinear kernel in a third of the time.
"""

from __future__ import annotations

import numpy as np

from fieldsid.models.hull import DAMPING, STIFFNESS, kinds_of
from fieldsid.numerics.arrays import FloatArray, IntArray
from fieldsid.numerics.jit import inner, jit

LINEAR_PARAMETERS = ("damping", "stiffness", "authority", "trim", "angle0", "rate0")
STEP_TOLERANCE = 1e-9
DIVERGED_RATE_RAD_S = 1e4
"""A motion counts as diverged from this rate on."""
FEWEST_INTERVALS = 16
"""Number of intervals below which computing the matrix takes more time than it saves."""


@inner
def _slope(a: float, k: float, z: FloatArray, moment: float, out: FloatArray) -> None:
    """Fill out (6,) with the time derivatives of (y, p) and of its sensitivities to a and k."""
    out[0], out[1] = z[1], -a * z[1] - k * z[0] + moment
    out[2], out[3] = z[3], -a * z[3] - k * z[2] - z[1]
    out[4], out[5] = z[5], -a * z[5] - k * z[4] - z[0]


@inner
def _unit_response(a: float, k: float, h: float, pieces: int, unit: int, z: FloatArray, work: FloatArray) -> None:
    """Fill z (6,) with (y, p) and its sensitivities to a and k after h s, from one unit of input.

    `unit` selects the input: y (0) or p (1) at the start, or the moment at the start (2) or the end (3). work (5, 6) is scratch.
    """
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
                work[4, l] = z[l] + (reach * s * work[stage - 1, l] if stage > 0 else 0.0)
            _slope(a, k, work[4], m0 + (m1 - m0) * part, work[stage])
        for l in range(6):
            z[l] += s / 6.0 * (work[0, l] + 2.0 * work[1, l] + 2.0 * work[2, l] + work[3, l])


@inner
def _small(value: float) -> float:
    """Return the value, zero where it is negligible: arithmetic with subnormal numbers takes eight times as long."""
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
    """Whether a motion is linear with y and p as its only states, at equal intervals."""
    return not kinds_of(c).bent and start[2] == 0.0 and is_even(steps, drive)


@inner
def is_even(steps: FloatArray, drive: FloatArray) -> bool:
    """Whether steps (n-1,) and the damping and stiffness of drive (n-1, 6) are constant over FEWEST_INTERVALS or more."""
    if steps.shape[0] < FEWEST_INTERVALS:
        return False
    for i in range(steps.shape[0]):
        equal = drive[i, DAMPING] == drive[0, DAMPING] and drive[i, STIFFNESS] == drive[0, STIFFNESS]
        if not equal or abs(steps[i] - steps[0]) > STEP_TOLERANCE * steps[0]:
            return False
    return True


@inner
def _responses(a: float, k: float, h: float, pieces: int, u: FloatArray, work: FloatArray) -> None:
    """Fill u (4, 6) with the four responses of `_unit_response`: to y, p, and the moment at the start and the end."""
    for unit in range(4):
        _unit_response(a, k, h, pieces, unit, u[unit], work)


@jit
def linear_motion(steps: FloatArray, drive: FloatArray, c: FloatArray, start: FloatArray, pieces: int, out: FloatArray) -> bool:
    """Fill out (n, 3) as `integrate.integrate_motion` does if the motion is linear at equal steps; return whether it is."""
    if not is_linear(steps, drive, c, start):
        return False
    u, work = np.zeros((4, 6)), np.zeros((5, 6))
    _responses(drive[0, 0], drive[0, 1], steps[0], pieces, u, work)
    _move(u, drive, start, out)
    return True


@inner
def _move(u: FloatArray, drive: FloatArray, start: FloatArray, out: FloatArray) -> int:
    """Fill out (n, 3) by the responses u (4, 6) of an interval; return the number of samples before the motion diverges."""
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
    """Fill out (n, 3) and sens (P, 2, n) as `integrate.integrate_with_sensitivities` does, for a linear motion at equal steps.

    Return whether the motion is linear, has equal steps, and no parameter moves a constant or the initial cross state.
    """
    bent = 0.0
    for j in range(d_c.shape[0]):
        bent += abs(d_start[j, 2])
        for l in range(d_c.shape[1]):
            bent += abs(d_c[j, l])
    if bent != 0.0 or not is_linear(steps, drive, c, start):
        return False
    u, work = np.zeros((4, 6)), np.zeros((5, 6))
    _responses(drive[0, 0], drive[0, 1], steps[0], pieces, u, work)
    samples = _move(u, drive, start, out)
    for j in range(place.shape[0]):
        y, p = d_start[j, 0], d_start[j, 1]
        f_a, f_k, f_0, f_1 = factor[j, 0], factor[j, 1], factor[j, 2], factor[j, 3]
        of_a, of_k, of_0, of_1 = columns[place[j, 0]], columns[place[j, 1]], columns[place[j, 2]], columns[place[j, 3]]
        moves_a_or_k, moves_moment = f_a != 0.0 or f_k != 0.0, f_0 != 0.0 or f_1 != 0.0
        sens[j, 0, 0], sens[j, 1, 0] = y, p
        for i in range(samples - 1):
            to_y, to_p = u[0, 0] * y + u[1, 0] * p, u[0, 1] * y + u[1, 1] * p
            if moves_moment:
                m0, m1 = f_0 * of_0[i], f_1 * of_1[i]
                to_y += u[2, 0] * m0 + u[3, 0] * m1
                to_p += u[2, 1] * m0 + u[3, 1] * m1
            if moves_a_or_k:
                a, k, at_y, at_p, m0, m1 = f_a * of_a[i], f_k * of_k[i], out[i, 0], out[i, 1], drive[i, 2], drive[i, 3]
                to_y += a * (u[0, 2] * at_y + u[1, 2] * at_p + u[2, 2] * m0 + u[3, 2] * m1)
                to_p += a * (u[0, 3] * at_y + u[1, 3] * at_p + u[2, 3] * m0 + u[3, 3] * m1)
                to_y += k * (u[0, 4] * at_y + u[1, 4] * at_p + u[2, 4] * m0 + u[3, 4] * m1)
                to_p += k * (u[0, 5] * at_y + u[1, 5] * at_p + u[2, 5] * m0 + u[3, 5] * m1)
            y, p = _small(to_y), _small(to_p)
            sens[j, 0, i + 1], sens[j, 1, i + 1] = y, p
    set_all_diverged(sens, samples)
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
    """Add the normal equations of a run to square (8, 7): products of the weighted residual and its six sensitivities.

    fin (2, n-1) is the fin angle at the start and end of each interval, measured (2, n) angle and rate, weight (2, n) one over
    their noise, zero where not measured; base (6,) is in the order of LINEAR_PARAMETERS. Row 0 and column 0 are the residual;
    square[7, :2] are the unweighted sums of squares of angle and rate.
    """
    n = steps.shape[0] + 1
    a, k, b, c, y, p = base[0], base[1], base[2], base[3], base[4], base[5]
    u, work = np.zeros((4, 6)), np.zeros((5, 6))
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
            _responses(a, k, h, pieces, u, work)
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
