"""The Kalman filter of one residual under eight noises at once, all with a disturbance and coloured sensor noise.

The recursion of full.py is computed in lanes of one loop, which the processor vectorises. Sensor noise correlated over half a
minute keeps the gains from becoming constant within a run, so that a test for it would gain nothing.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldsid.noise.kalman.transition import transition
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit

LANES = 8
_COV, _STATE, _SIZES, _KEPT, _OUT = 0, 15 * LANES, 20 * LANES, 25 * LANES, 27 * LANES
_ROOM = 31 * LANES


@jit
def full_filter_batched(
    steps: FloatArray, ok: npt.NDArray[np.bool_], a: float, k: float, noises: FloatArray, residual: FloatArray,
    errors: FloatArray, spreads: FloatArray,
) -> None:  # fmt: skip
    """Fill errors (8, 2, n) with the standardised innovations of a residual (2, n), and spreads with their deviations.

    noises is (8, 7) in the order of NOISE_FIELDS, no standard deviation nil. Samples not measured give zero and one.
    """
    n = steps.shape[0] + 1
    # one flat array of rows of eight at known places: only so is the compiler sure that no lane writes what another reads
    room = np.zeros(_ROOM)
    for l in range(LANES):
        room[_SIZES + l], room[_SIZES + 8 + l], room[_SIZES + 16 + l] = noises[l, 0] ** 2, noises[l, 1] ** 2, noises[l, 2] ** 2
        room[_SIZES + 24 + l], room[_SIZES + 32 + l] = noises[l, 4] ** 2, noises[l, 5] ** 2
        room[_COV + 72 + l], room[_COV + 96 + l], room[_COV + 112 + l] = (
            room[_SIZES + 16 + l], room[_SIZES + 24 + l], room[_SIZES + 32 + l]
        )  # fmt: skip
    last_h = -1.0
    yy, yp, py, pp, yw, pw = 1.0, 0.0, 0.0, 1.0, 0.0, 0.0
    for i in range(n):
        if i < n - 1 and abs(steps[i] - last_h) > 1e-7 * steps[i]:
            last_h = steps[i]
            yy, yp, py, pp, yw, pw = transition(a, k, last_h)
            for l in range(LANES):
                room[_KEPT + l], room[_KEPT + 8 + l] = np.exp(-last_h / noises[l, 3]), np.exp(-last_h / noises[l, 6])
        angle, rate, seen, felt = residual[0, i], residual[1, i], 1.0 * ok[0, i], 1.0 * ok[1, i]
        for l in range(LANES):
            c00, c01, c02, c03, c04 = room[l], room[8 + l], room[16 + l], room[24 + l], room[32 + l]
            c11, c12, c13, c14, c22 = room[40 + l], room[48 + l], room[56 + l], room[64 + l], room[72 + l]
            c23, c24, c33, c34, c44 = room[80 + l], room[88 + l], room[96 + l], room[104 + l], room[112 + l]
            y, p, w = room[_STATE + l], room[_STATE + 8 + l], room[_STATE + 16 + l]
            m, q = room[_STATE + 24 + l], room[_STATE + 32 + l]

            r0, r1, r2, r3, r4 = c00 + c03, c01 + c13, c02 + c23, c03 + c33, c04 + c34
            share = seen / (r0 + r3 + room[_SIZES + l])
            root, e = np.sqrt(share), angle - y - m
            room[_OUT + l], room[_OUT + 8 + l] = e * root, root
            g0, g1, g2, g3, g4 = r0 * share, r1 * share, r2 * share, r3 * share, r4 * share
            y, p, w, m, q = y + g0 * e, p + g1 * e, w + g2 * e, m + g3 * e, q + g4 * e
            c00, c01, c02, c03, c04 = c00 - g0 * r0, c01 - g0 * r1, c02 - g0 * r2, c03 - g0 * r3, c04 - g0 * r4
            c11, c12, c13, c14, c22 = c11 - g1 * r1, c12 - g1 * r2, c13 - g1 * r3, c14 - g1 * r4, c22 - g2 * r2
            c23, c24, c33, c34, c44 = c23 - g2 * r3, c24 - g2 * r4, c33 - g3 * r3, c34 - g3 * r4, c44 - g4 * r4

            r0, r1, r2, r3, r4 = c01 + c04, c11 + c14, c12 + c24, c13 + c34, c14 + c44
            share = felt / (r1 + r4 + room[_SIZES + 8 + l])
            root, e = np.sqrt(share), rate - p - q
            room[_OUT + 16 + l], room[_OUT + 24 + l] = e * root, root
            g0, g1, g2, g3, g4 = r0 * share, r1 * share, r2 * share, r3 * share, r4 * share
            y, p, w, m, q = y + g0 * e, p + g1 * e, w + g2 * e, m + g3 * e, q + g4 * e
            c00, c01, c02, c03, c04 = c00 - g0 * r0, c01 - g0 * r1, c02 - g0 * r2, c03 - g0 * r3, c04 - g0 * r4
            c11, c12, c13, c14, c22 = c11 - g1 * r1, c12 - g1 * r2, c13 - g1 * r3, c14 - g1 * r4, c22 - g2 * r2
            c23, c24, c33, c34, c44 = c23 - g2 * r3, c24 - g2 * r4, c33 - g3 * r3, c34 - g3 * r4, c44 - g4 * r4

            ww, mm = room[_KEPT + l], room[_KEPT + 8 + l]
            u0, u1, u2 = yy * c00 + yp * c01 + yw * c02, yy * c01 + yp * c11 + yw * c12, yy * c02 + yp * c12 + yw * c22
            v0, v1, v2 = py * c00 + pp * c01 + pw * c02, py * c01 + pp * c11 + pw * c12, py * c02 + pp * c12 + pw * c22
            room[l], room[8 + l], room[16 + l] = u0 * yy + u1 * yp + u2 * yw, u0 * py + u1 * pp + u2 * pw, u2 * ww
            room[24 + l], room[32 + l] = (yy * c03 + yp * c13 + yw * c23) * mm, (yy * c04 + yp * c14 + yw * c24) * mm
            room[40 + l], room[48 + l] = v0 * py + v1 * pp + v2 * pw, v2 * ww
            room[56 + l], room[64 + l] = (py * c03 + pp * c13 + pw * c23) * mm, (py * c04 + pp * c14 + pw * c24) * mm
            room[72 + l] = c22 * ww * ww + room[_SIZES + 16 + l] * (1.0 - ww * ww)
            room[80 + l], room[88 + l], room[104 + l] = c23 * ww * mm, c24 * ww * mm, c34 * mm * mm
            room[96 + l] = c33 * mm * mm + room[_SIZES + 24 + l] * (1.0 - mm * mm)
            room[112 + l] = c44 * mm * mm + room[_SIZES + 32 + l] * (1.0 - mm * mm)
            room[_STATE + l], room[_STATE + 8 + l] = yy * y + yp * p + yw * w, py * y + pp * p + pw * w
            room[_STATE + 16 + l], room[_STATE + 24 + l], room[_STATE + 32 + l] = ww * w, mm * m, mm * q
        for l in range(LANES):
            errors[l, 0, i], errors[l, 1, i] = room[_OUT + l], room[_OUT + 16 + l]
            spreads[l, 0, i] = 1.0 / room[_OUT + 8 + l] if ok[0, i] else 1.0
            spreads[l, 1, i] = 1.0 / room[_OUT + 24 + l] if ok[1, i] else 1.0
