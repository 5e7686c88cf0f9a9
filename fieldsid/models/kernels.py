"""The compiled core: angle, rate and one cross state by RK4 over each interval, with exact tangents of that map.

    y' = p
    p' = -a p - k y + m(t) - Q p|p| (|p|/0.2)^o - X F(w/L, p) + hs sin y + hc cos y + rs (y - sin y) + rc (cos y - 1) + x
    x' = -e g x - (D/g) x|x| - f g^2 p + q
    F(alpha, p) = 32 int_{-1/2}^{1/2} (alpha + xi p) |alpha + xi p| xi dxi        (F(0, p) = p |p|)
a, k, q and the cross factor g (speed over the run's speed) are held over an interval; m and w run straight from its
start to its end. The tangents are the
derivatives of the discrete map itself, so a least-squares step has no truncation error of its own.
"""

from __future__ import annotations

import numpy as np

from fieldsid.logs.run import FloatArray
from fieldsid.models.effect import ORDINARY, STILL
from fieldsid.models.jit import jit

DRIVES = ("damping", "stiffness", "moment_start", "moment_end", "cross_factor", "cross_push", "flow_start", "flow_end")
CONSTANTS = (
    "quadratic", "crossflow", "length", "heading_sin", "heading_cos", "righting_sin", "righting_cos",
    "cross_damping", "cross_rate", "cross_quadratic", "beyond_square",
)  # fmt: skip
DIVERGED = 1e4
SLOWEST = 0.01
"""Speed over the run's speed below which the cross state's quadratic drag grows no more: at rest the state means nothing."""


@jit
def crossflow(alpha: float, p: float) -> tuple[float, float, float]:
    """Return F(alpha, p) and its derivatives by alpha and by p, from the closed form of the integral."""
    if abs(alpha) >= 0.5 * abs(p):
        s = 1.0 if alpha >= 0.0 else -1.0
        return 16.0 / 3.0 * abs(alpha) * p, 16.0 / 3.0 * s * p, 16.0 / 3.0 * abs(alpha)
    s = 1.0 if p >= 0.0 else -1.0
    ratio = alpha / p
    value = s * (p * p + 8.0 * alpha * alpha - 16.0 / 3.0 * alpha * alpha * ratio * ratio)
    by_alpha = s * (16.0 * alpha - 64.0 / 3.0 * alpha * ratio * ratio)
    by_p = s * (2.0 * p + 32.0 / 3.0 * alpha * ratio * ratio * ratio)
    return value, by_alpha, by_p


@jit
def power_drag(p: float, beyond: float) -> tuple[float, float]:
    """Return p|p| (|p|/ORDINARY)^beyond and its logarithmic derivative by `beyond`; both are nil at rest."""
    if abs(p) < STILL:
        return 0.0, 0.0
    log = np.log(abs(p) / ORDINARY)
    return p * abs(p) * np.exp(beyond * log), log


@jit
def _any(values: FloatArray, first: int, last: int) -> bool:
    """Whether any of values[first:last] is not zero; loops compile in a fraction of what array expressions take."""
    found = False
    for l in range(first, last):
        found = found or values[l] != 0.0
    return found


@jit
def _spoil(out: FloatArray, first: int) -> None:
    """Set the rows of out (n, p) from `first` on to NaN."""
    for i in range(first, out.shape[0]):
        for l in range(out.shape[1]):
            out[i, l] = np.nan


@jit
def _weight(stage: int) -> float:
    """Return the weight of a stage of the RK4 rule, times six."""
    return 1.0 + (stage % 3 != 0)


@jit
def _reach(stage: int) -> float:
    """Return the part of a step at which a stage is taken."""
    return 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)


@jit
def simulate(steps: FloatArray, drive: FloatArray, c: FloatArray, start: FloatArray, pieces: int, out: FloatArray) -> None:
    """Fill out (n, 3) with angle, rate and cross state; a diverged motion is NaN from there on."""
    n = steps.shape[0] + 1
    y, p, x = start[0], start[1], start[2]
    out[0, 0], out[0, 1], out[0, 2] = y, p, x
    turning = _any(c, 3, 7)
    for i in range(n - 1):
        h = steps[i] / pieces
        a, k = drive[i, 0], drive[i, 1]
        e, f_cross, hold, q = c[7] * drive[i, 4], c[8] * drive[i, 4] ** 2, c[9] / max(drive[i, 4], SLOWEST), drive[i, 5]
        for piece in range(pieces):
            ky, kp, kx = 0.0, 0.0, 0.0
            ty, tp, tx = 0.0, 0.0, 0.0
            for stage in range(4):
                g = _reach(stage) * h
                part = (piece + _reach(stage)) / pieces
                ys, ps, xs = y + g * ky, p + g * kp, x + g * kx
                m = drive[i, 2] + (drive[i, 3] - drive[i, 2]) * part
                drag = ps * abs(ps) if c[10] == 0.0 else power_drag(ps, c[10])[0]
                f = -a * ps - k * ys + m - c[0] * drag + xs
                if c[1] != 0.0:
                    w = drive[i, 6] + (drive[i, 7] - drive[i, 6]) * part
                    f -= c[1] * crossflow(w / c[2], ps)[0]
                if turning:
                    sin, cos = np.sin(ys), np.cos(ys)
                    f += c[3] * sin + c[4] * cos + c[5] * (ys - sin) + c[6] * (cos - 1.0)
                ky, kp, kx = ps, f, -(e + hold * abs(xs)) * xs - f_cross * ps + q
                ty += _weight(stage) * ky
                tp += _weight(stage) * kp
                tx += _weight(stage) * kx
            y += h / 6.0 * ty
            p += h / 6.0 * tp
            x += h / 6.0 * tx
        if not abs(p) < DIVERGED:
            _spoil(out, i + 1)
            return
        out[i + 1, 0], out[i + 1, 1], out[i + 1, 2] = y, p, x


@jit
def tangents(
    steps: FloatArray,
    drive: FloatArray,
    c: FloatArray,
    start: FloatArray,
    pieces: int,
    d_drive: FloatArray,
    which: FloatArray,
    d_c: FloatArray,
    d_start: FloatArray,
    out: FloatArray,
    sens: FloatArray,
) -> None:
    """Fill out (n, 3) and sens (P, 2, n): derivatives of angle and rate by P parameters.

    d_drive (K, n-1, 8) holds derivatives of the drives; which (P,) is the row of each parameter in it, -1 for
    none; d_c (P, 11) those of the constants; d_start (P, 3) those of the initial state.
    """
    n = steps.shape[0] + 1
    count = d_c.shape[0]
    s = d_start.copy()
    kt = np.zeros((count, 3))
    acc = np.zeros((count, 3))
    has_c = np.zeros(count, dtype=np.bool_)
    turning, flowing, raised = _any(c, 3, 7), c[1] != 0.0, c[10] != 0.0
    for j in range(count):
        sens[j, 0, 0], sens[j, 1, 0] = s[j, 0], s[j, 1]
        has_c[j] = _any(d_c[j], 0, d_c.shape[1])
        turning, flowing = turning or _any(d_c[j], 3, 7), flowing or d_c[j, 1] != 0.0
        raised = raised or d_c[j, 10] != 0.0
    y, p, x = start[0], start[1], start[2]
    out[0, 0], out[0, 1], out[0, 2] = y, p, x
    for i in range(n - 1):
        h = steps[i] / pieces
        a, k = drive[i, 0], drive[i, 1]
        fast = drive[i, 4]
        floored = max(fast, SLOWEST)
        damp, turn, hold, q = c[7] * fast, c[8] * fast * fast, c[9] / floored, drive[i, 5]
        for piece in range(pieces):
            ky, kp, kx = 0.0, 0.0, 0.0
            ty, tp, tx = 0.0, 0.0, 0.0
            for j in range(count):
                for l in range(3):
                    acc[j, l] = kt[j, l] = 0.0
            for stage in range(4):
                g = _reach(stage) * h
                part = (piece + _reach(stage)) / pieces
                wt = _weight(stage)
                ys, ps, xs = y + g * ky, p + g * kp, x + g * kx
                m = drive[i, 2] + (drive[i, 3] - drive[i, 2]) * part
                drag, log = ps * abs(ps), 0.0
                by_p = -a - 2.0 * c[0] * abs(ps)
                if raised:
                    drag, log = power_drag(ps, c[10])
                    by_p = -a - (2.0 + c[10]) * c[0] * drag / (ps if abs(ps) > STILL else 1.0)
                f = -a * ps - k * ys + m - c[0] * drag + xs
                by_y = -k
                flow, flow_a, flow_p, alpha = 0.0, 0.0, 0.0, 0.0
                if flowing:
                    alpha = (drive[i, 6] + (drive[i, 7] - drive[i, 6]) * part) / c[2]
                    flow, flow_a, flow_p = crossflow(alpha, ps)
                    f -= c[1] * flow
                    by_p -= c[1] * flow_p
                sin, cos = 0.0, 1.0
                if turning:
                    sin, cos = np.sin(ys), np.cos(ys)
                    f += c[3] * sin + c[4] * cos + c[5] * (ys - sin) + c[6] * (cos - 1.0)
                    by_y += c[3] * cos - c[4] * sin + c[5] * (1.0 - cos) - c[6] * sin
                square = xs * abs(xs)
                by_x = damp + 2.0 * hold * abs(xs)
                for j in range(count):
                    dy = s[j, 0] + g * kt[j, 0]
                    dp = s[j, 1] + g * kt[j, 1]
                    dx = s[j, 2] + g * kt[j, 2]
                    e = by_y * dy + by_p * dp + dx
                    z = -by_x * dx - turn * dp
                    r = int(which[j])
                    if r >= 0:
                        d0, d1 = d_drive[r, i, 2], d_drive[r, i, 3]
                        e += d0 + (d1 - d0) * part - d_drive[r, i, 0] * ps - d_drive[r, i, 1] * ys
                        z += d_drive[r, i, 5] - d_drive[r, i, 4] * (c[7] * xs + 2.0 * fast * c[8] * ps - hold / floored * square)
                    if has_c[j]:
                        e -= (d_c[j, 0] + c[0] * log * d_c[j, 10]) * drag
                        e -= d_c[j, 1] * flow - c[1] * flow_a * alpha / c[2] * d_c[j, 2]
                        e += d_c[j, 3] * sin + d_c[j, 4] * cos + d_c[j, 5] * (ys - sin) + d_c[j, 6] * (cos - 1.0)
                        z -= d_c[j, 7] * fast * xs + d_c[j, 8] * fast * fast * ps + d_c[j, 9] / floored * square
                    kt[j, 0], kt[j, 1], kt[j, 2] = dp, e, z
                    acc[j, 0] += wt * dp
                    acc[j, 1] += wt * e
                    acc[j, 2] += wt * z
                ky, kp, kx = ps, f, -damp * xs - hold * square - turn * ps + q
                ty += wt * ky
                tp += wt * kp
                tx += wt * kx
            y += h / 6.0 * ty
            p += h / 6.0 * tp
            x += h / 6.0 * tx
            for j in range(count):
                for l in range(3):
                    s[j, l] += h / 6.0 * acc[j, l]
                    # a start's influence dies out; below the normal numbers it would only cost time, eightfold
                    if abs(s[j, l]) < 1e-150:
                        s[j, l] = 0.0
        if not abs(p) < DIVERGED:
            _spoil(out, i + 1)
            for j in range(count):
                _spoil(sens[j].T, i + 1)
            return
        out[i + 1, 0], out[i + 1, 1], out[i + 1, 2] = y, p, x
        for j in range(count):
            sens[j, 0, i + 1], sens[j, 1, i + 1] = s[j, 0], s[j, 1]
