"""Recursive least squares on the filtered equation of motion, with forgetting: one sample in, the estimate out.

    g = P phi,  d = beta + phi' g,  e = q - phi' Theta,  Theta += g e / d,  P <- (P - g g' / d) / beta
with phi = [-p_f, -y_f, delta_f, 1_f] and q of the filtered equation. Rows are used once the filter has forgotten its initial
state. Without excitation P would grow as beta^-n in some direction: there is no forgetting while P is at its start value. Source:
the paper, estimator 2 (recursive); Ljung 1999, section 11.2.
"""

from __future__ import annotations

import numpy as np

from fieldsid.fitting.regression.state_variable_filter import advance, hold_weights
from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import jit

INITIAL_VARIANCE = 1e6
"""Start value of P (the paper: 100): with filtered rates near 0.1 rad/s a start of 100 biases the estimate by up to 2 %."""
CURVATURE_REFRESH_SAMPLES = 16
"""Samples after which the curvature between samples is computed from the new estimate."""
MAX_VARIANCE_SHARE = 1e-2
"""Share of INITIAL_VARIANCE below which all variances in P must be before the estimate is used for the curvature."""
EQUAL_STEP_SHARE = 1e-9
"""Relative difference of two sampling intervals up to which the same filter weights are used."""
MEMORY = 24
(
    SAMPLES, TIME, FIRST_TIME, ANGLE, RATE, P1, P2, Y1, Y2, D1, D2, DECAY, START,
    H, W0, W1, W2, W3, W4, A, K, B, C, NEXT_REFRESH,
) = range(MEMORY)  # fmt: skip


@jit
def row_of(m: FloatArray, order: int, lam: float, angle: float, rate: float) -> tuple[float, float, float, float, float]:
    """Return phi (damping, stiffness, authority, trim) and the target of the filtered equation."""
    fade, start = m[DECAY], m[START]
    if order == 1:
        target = lam * (rate - lam * m[P1] - start * fade)
        return -lam * m[P1], -lam * m[Y1], lam * m[D1], 1.0 - fade, target
    elapsed, power = m[TIME] - m[FIRST_TIME], lam * lam
    slope = m[Y1] - lam * m[Y2] - start * elapsed * fade
    bend = angle - 2.0 * lam * m[Y1] + power * m[Y2] - start * fade * (1.0 - lam * elapsed)
    return -power * slope, -power * m[Y2], power * m[D2], 1.0 - fade * (1.0 + lam * elapsed), power * bend


@jit
def update(s: FloatArray, row: tuple[float, float, float, float, float], beta: float) -> None:
    """Update Theta and P, packed in s (14,), by one row.

    Written out for four parameters: a loop over matrices takes four times as long. A parameter whose row of P is
    zero stays at zero.
    """
    a, b, c, d, target = row
    p00, p01, p02, p03, p11, p12, p13, p22, p23, p33 = s[4], s[5], s[6], s[7], s[8], s[9], s[10], s[11], s[12], s[13]
    g0 = p00 * a + p01 * b + p02 * c + p03 * d
    g1 = p01 * a + p11 * b + p12 * c + p13 * d
    g2 = p02 * a + p12 * b + p22 * c + p23 * d
    g3 = p03 * a + p13 * b + p23 * c + p33 * d
    share = 1.0 / (beta + a * g0 + b * g1 + c * g2 + d * g3)
    error = target - a * s[0] - b * s[1] - c * s[2] - d * s[3]
    h0, h1, h2, h3 = g0 * share, g1 * share, g2 * share, g3 * share
    s[0] += h0 * error
    s[1] += h1 * error
    s[2] += h2 * error
    s[3] += h3 * error
    p00, p11, p22, p33 = p00 - h0 * g0, p11 - h1 * g1, p22 - h2 * g2, p33 - h3 * g3
    raised = 1.0 / beta if max(p00, p11, p22, p33) < beta * INITIAL_VARIANCE else 1.0
    s[4], s[5], s[6] = p00 * raised, (p01 - h0 * g1) * raised, (p02 - h0 * g2) * raised
    s[7], s[8], s[9] = (p03 - h0 * g3) * raised, p11 * raised, (p12 - h1 * g2) * raised
    s[10], s[11], s[12], s[13] = (p13 - h1 * g3) * raised, p22 * raised, (p23 - h2 * g3) * raised, p33 * raised


@jit
def refresh_curvature(m: FloatArray, s: FloatArray) -> None:
    """Use the present estimate for the curvature between samples, where all variances in P are small enough."""
    m[NEXT_REFRESH] = m[SAMPLES] + CURVATURE_REFRESH_SAMPLES
    if max(s[4], s[8], s[11], s[13]) <= MAX_VARIANCE_SHARE * INITIAL_VARIANCE:
        m[A], m[K], m[B], m[C] = s[0], s[1], s[2], s[3]


@jit
def curvatures(m: FloatArray, order: int, h: float, angle: float, rate: float, start: float, end: float) -> tuple[float, float]:
    """Return the curvature of angle and rate over an interval by the last estimate taken over, zero before there is one."""
    per = 1.0 / h
    slope = (angle - m[ANGLE]) * per
    if order == 1:
        turn = (rate - m[RATE]) * per
        return turn, -m[A] * turn - m[K] * slope + m[B] * (end - start) * per
    return -m[A] * slope - 0.5 * m[K] * (angle + m[ANGLE]) + 0.5 * m[B] * (start + end) + m[C], 0.0


@jit
def step(
    m: FloatArray, s: FloatArray, lam: float, beta: float, order: int, samples: FloatArray, rows: FloatArray, i: int
) -> bool:
    """Take sample i of [time, fin at the interval's start, at its end, angle, rate, is used]; return whether a row was used.

    m is the filter's memory, s Theta and packed P; row i of rows (n, 5) receives phi and target.
    """
    time, angle, rate = samples[i, 0], samples[i, 3], samples[i, 4]
    if m[SAMPLES] == 0.0:
        m[SAMPLES], m[TIME], m[FIRST_TIME], m[DECAY] = 1.0, time, time, 1.0
        m[ANGLE], m[RATE] = angle, rate
        m[START] = rate if order == 1 else angle
        return False
    h = time - m[TIME]
    if abs(h - m[H]) > EQUAL_STEP_SHARE * h:
        m[H] = h
        m[W0], m[W1], m[W2], m[W3], m[W4] = hold_weights(lam, h)
    weights = (m[W0], m[W1], m[W2], m[W3], m[W4])
    start, end = samples[i, 1], samples[i, 2]
    bow_y, bow_p = curvatures(m, order, h, angle, rate, start, end)
    m[P1], m[P2] = advance(m[P1], m[P2], m[RATE], rate, bow_p, h, weights)
    m[Y1], m[Y2] = advance(m[Y1], m[Y2], m[ANGLE], angle, bow_y, h, weights)
    m[D1], m[D2] = advance(m[D1], m[D2], start, end, 0.0, h, weights)
    # set to zero before it becomes a denormal number, which would make every later product several times slower
    m[DECAY] = m[DECAY] * m[W0] if m[DECAY] > 1e-30 else 0.0
    m[SAMPLES] += 1.0
    m[TIME], m[ANGLE], m[RATE] = time, angle, rate
    if samples[i, 5] == 0.0 or lam * (time - m[FIRST_TIME]) < 3.0 * order:
        return False
    phi = row_of(m, order, lam, angle, rate)
    rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3], rows[i, 4] = phi
    update(s, phi, beta)
    if m[SAMPLES] >= m[NEXT_REFRESH]:
        refresh_curvature(m, s)
    return True


def initial_memory(*, stiff: bool) -> FloatArray:
    """Return Theta = 0 and P = INITIAL_VARIANCE I, packed (14,); without a stiffness its row of P and its value stay zero."""
    s = np.zeros(14)
    s[[4, 8, 11, 13]] = INITIAL_VARIANCE
    s[8] *= stiff
    return s


def forget_filter(m: FloatArray) -> None:
    """Restart the filter at the next sample, as after a gap; the estimate, its weight and its errors are kept."""
    m[:H] = 0.0
    m[[H, NEXT_REFRESH]] = 0.0
