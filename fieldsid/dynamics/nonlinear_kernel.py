"""The compiled core of any motion: angle, rate and one cross state by RK4 over each interval, with exact tangents of that map.

    y' = p
    p' = -a p - k y + m(t) - Q p|p| (|p|/0.2)^o - N F(s x/g, p) + c x
         + hs sin z + hc cos z + hs2 sin 2z + hc2 cos 2z + rs (z - sin z) + rc (cos z - 1)
    z = y - ht (t - the middle of the run)
    x' = -e g x - (D/g) x|x| - f g^2 p - Y g G(s x/g, p) + q
    F(alpha, p) = 32 int_{-1/2}^{1/2} (alpha + xi p) |alpha + xi p| xi dxi        (F(0, p) = p |p|)
    G(alpha, p) = int_{-1/2}^{1/2} (alpha + xi p) |alpha + xi p| dxi              (G(alpha, 0) = alpha |alpha|)
a, k, q and the cross factor g (speed over the run's speed) are held over an interval; m runs straight from its start to its
end. The tangents are the derivatives of the discrete map itself, so a least-squares step has no truncation error of its own.
"""

from __future__ import annotations

import numpy as np

from fieldsid.dynamics.drag_laws import crossflow, crossforce, power_drag
from fieldsid.dynamics.linear_kernel import (
    DIVERGED_RATE_RAD_S,
    crosses_limit,
    crosses_limit_by,
    of_strips,
    reverses,
    set_all_diverged,
    set_diverged,
)
from fieldsid.dynamics.places import (
    BEYOND_SQUARE,
    CROSS_DAMPING,
    CROSS_QUADRATIC,
    CROSS_RATE,
    CROSS_SHARE,
    HEADING_COS,
    HEADING_COS2,
    HEADING_SIN,
    HEADING_SIN2,
    HEADING_TURN,
    QUADRATIC,
    RIGHTING_COS,
    RIGHTING_SIN,
    STRIP_FLOW,
    STRIP_FORCE,
    STRIP_MOMENT,
)  # fmt: skip
from fieldsid.models.effect import ZERO_RATE_RAD_S
from fieldsid.numerics.arrays import FloatArray, IntArray
from fieldsid.numerics.jit import inner, jit

SMALLEST_SPEED_RATIO = 0.01
"""Speed over the run's speed below which the cross state's quadratic drag grows no more: at rest the state means nothing."""
SMALLEST_WEIGHT = 1e-150
AT_Y, AT_P, AT_X, PART, BY_Y, BY_P, BY_X, BY_FACTOR, DRAG, BY_POWER, SIN, COS, ARC, BY_TURN = range(14)
OF_X, OF_FACTOR, X_BY_P, AT_MOMENT, AT_FORCE, MOMENT_BY_FLOW, FORCE_BY_FLOW = range(14, 21)
"""What is kept of each stage of a step: the state and the share of the interval; the derivatives of p' by y and by p, of -x'
by x and by the cross factor; what the derivatives of the constants multiply; the derivatives of p' by x and by the cross
factor, of -x' by p; and, of the flow that the cross state makes, F, G/g and their derivatives by s."""
STAGE_COLUMNS = 21


@inner
def _weight(stage: int) -> float:
    """Return the weight of a stage of the RK4 rule, times six."""
    return 1.0 + (stage % 3 != 0)


@inner
def _reach(stage: int) -> float:
    """Return the part of a step at which a stage is taken."""
    return 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)


@inner
def _total(steps: FloatArray) -> float:
    """Return the sum of steps; a loop compiles in a fraction of what an array's method takes."""
    total = 0.0
    for i in range(steps.shape[0]):
        total += steps[i]
    return total


@jit
def nonlinear_motion(
    steps: FloatArray, drive: FloatArray, c: FloatArray, start: FloatArray, pieces: int, out: FloatArray
) -> None:
    """Fill out (n, 3) as `integrate.integrate_motion` does, whatever the motion and the clock."""
    n = steps.shape[0] + 1
    y, p, x = start[0], start[1], start[2]
    out[0, 0], out[0, 1], out[0, 2] = y, p, x
    turning, stripped, late = reverses(c), of_strips(c), -0.5 * _total(steps)
    for i in range(n - 1):
        h = steps[i] / pieces
        a, k = drive[i, 0], drive[i, 1]
        fast = drive[i, 4]
        floored = max(fast, SMALLEST_SPEED_RATIO)
        e, f_cross, hold, q = c[CROSS_DAMPING] * fast, c[CROSS_RATE] * fast**2, c[CROSS_QUADRATIC] / floored, drive[i, 5]
        for piece in range(pieces):
            ky, kp, kx = 0.0, 0.0, 0.0
            ty, tp, tx = 0.0, 0.0, 0.0
            for stage in range(4):
                g = _reach(stage) * h
                part = (piece + _reach(stage)) / pieces
                ys, ps, xs = y + g * ky, p + g * kp, x + g * kx
                m = drive[i, 2] + (drive[i, 3] - drive[i, 2]) * part
                drag = ps * abs(ps) if c[BEYOND_SQUARE] == 0.0 else power_drag(ps, c[BEYOND_SQUARE])[0]
                f = -a * ps - k * ys + m - c[QUADRATIC] * drag + c[CROSS_SHARE] * xs
                slower = (e + hold * abs(xs)) * xs + f_cross * ps - q
                if stripped:
                    alpha = c[STRIP_FLOW] * xs / floored
                    f -= c[STRIP_MOMENT] * crossflow(alpha, ps)[0]
                    slower += c[STRIP_FORCE] * fast * crossforce(alpha, ps)[0]
                if turning:
                    seen = ys - c[HEADING_TURN] * (late + part * steps[i])
                    sin, cos = np.sin(seen), np.cos(seen)
                    f += c[HEADING_SIN] * sin + c[HEADING_COS] * cos
                    f += c[RIGHTING_SIN] * (seen - sin) + c[RIGHTING_COS] * (cos - 1.0)
                    f += 2.0 * c[HEADING_SIN2] * sin * cos + c[HEADING_COS2] * (1.0 - 2.0 * sin * sin)
                ky, kp, kx = ps, f, -slower
                ty += _weight(stage) * ky
                tp += _weight(stage) * kp
                tx += _weight(stage) * kx
            y += h / 6.0 * ty
            p += h / 6.0 * tp
            x += h / 6.0 * tx
        if not abs(p) < DIVERGED_RATE_RAD_S:
            set_diverged(out, i + 1)
            return
        out[i + 1, 0], out[i + 1, 1], out[i + 1, 2] = y, p, x
        late += steps[i]


@inner
def _map_row(row: int, h: float, stages: FloatArray, rows: FloatArray, push: FloatArray, pull: FloatArray) -> None:
    """Fill one row of a step's linear map: rows (3, 9) of the state and of what enters, push and pull (3, 4) of each stage.

    A tangent obeys s' = A_l s + b u_l at stage l of the step, so that s -> s + sum_l W_l (A_l s + b u_l) with
    W_4 = h/6, W_3 = h/3 + h W_4 A_4, W_2 = h/3 + h/2 W_3 A_3, W_1 = h/6 + h/2 W_2 A_2: the same for every parameter.
    """
    in_y, in_p, in_x = 1.0 * (row == 0), 1.0 * (row == 1), 1.0 * (row == 2)
    of_y, of_p, of_x = in_y, in_p, in_x
    v_y, v_p, v_x, part = 0.0, 0.0, 0.0, 0.0
    one, of_cross, by_factor = 0.0, 0.0, 0.0
    for back in range(4):
        l = 3 - back
        whole = _weight(l) * h / 6.0
        w_y, w_p, w_x = part * v_y + whole * in_y, part * v_p + whole * in_p, part * v_x + whole * in_x
        v_y, v_p = w_p * stages[BY_Y, l], w_y + w_p * stages[BY_P, l] - w_x * stages[X_BY_P, l]
        v_x = w_p * stages[OF_X, l] - w_x * stages[BY_X, l]
        of_y, of_p, of_x = of_y + v_y, of_p + v_p, of_x + v_x
        one, of_cross = one + w_p, of_cross + w_x
        by_factor += w_p * stages[OF_FACTOR, l] - w_x * stages[BY_FACTOR, l]
        push[row, l], pull[row, l] = w_p, w_x
        part = _reach(l) * h
    rows[row, 0], rows[row, 1], rows[row, 2], rows[row, 3] = of_y, of_p, of_x, one
    rows[row, 7], rows[row, 8] = of_cross, by_factor


@inner
def _map_rates(row: int, stages: FloatArray, push: FloatArray, rows: FloatArray) -> None:
    """Fill what changes from step to step, and from piece to piece of one, in a row of the linear map of a linear motion."""
    rising, by_a, by_k = 0.0, 0.0, 0.0
    for l in range(4):
        rising += push[row, l] * stages[PART, l]
        by_a, by_k = by_a - push[row, l] * stages[AT_P, l], by_k - push[row, l] * stages[AT_Y, l]
    rows[row, 4], rows[row, 5], rows[row, 6] = rising, by_a, by_k


@inner
def _of_constant(l: int, stages: FloatArray, stage: int, fast: float, floored: float) -> tuple[float, float]:
    """Return the derivatives of p' and of -x' at a stage of a step by the constant at place l, the state as it is."""
    ps, xs = stages[AT_P, stage], stages[AT_X, stage]
    sin, cos = stages[SIN, stage], stages[COS, stage]
    of_p, of_x = 0.0, 0.0
    if l == QUADRATIC:
        of_p = -stages[DRAG, stage]
    elif l == HEADING_SIN:
        of_p = sin
    elif l == HEADING_COS:
        of_p = cos
    elif l == RIGHTING_SIN:
        of_p = stages[ARC, stage]
    elif l == RIGHTING_COS:
        of_p = cos - 1.0
    elif l == CROSS_DAMPING:
        of_x = fast * xs
    elif l == CROSS_RATE:
        of_x = fast * fast * ps
    elif l == CROSS_QUADRATIC:
        of_x = xs * abs(xs) / floored
    elif l == BEYOND_SQUARE:
        of_p = -stages[BY_POWER, stage]
    elif l == HEADING_SIN2:
        of_p = 2.0 * sin * cos
    elif l == HEADING_COS2:
        of_p = 1.0 - 2.0 * sin * sin
    elif l == HEADING_TURN:
        of_p = -stages[BY_TURN, stage]
    elif l == CROSS_SHARE:
        of_p = xs
    elif l == STRIP_MOMENT:
        of_p = -stages[AT_MOMENT, stage]
    elif l == STRIP_FORCE:
        of_x = stages[AT_FORCE, stage]
    else:
        of_p, of_x = -stages[MOMENT_BY_FLOW, stage], stages[FORCE_BY_FLOW, stage]
    return of_p, of_x


@inner
def _map_constants(
    moved: IntArray, stages: FloatArray, push: FloatArray, pull: FloatArray, fast: float, floored: float, by: FloatArray
) -> None:
    """Fill by (3, K) with what a step makes of the state per unit of each of the K constants that any parameter moves.

    Where there is no cross state no constant moves it, and the third rows of push and pull are nil.
    """
    for k in range(moved.shape[0]):
        to_y, to_p, to_x = 0.0, 0.0, 0.0
        for stage in range(4):
            e, z = _of_constant(moved[k], stages, stage, fast, floored)
            to_y += push[0, stage] * e - pull[0, stage] * z
            to_p += push[1, stage] * e - pull[1, stage] * z
            to_x += push[2, stage] * e - pull[2, stage] * z
        by[0, k], by[1, k], by[2, k] = to_y, to_p, to_x


@inner
def _moved_constants(d_c: FloatArray) -> IntArray:
    """Return the places of the constants that any parameter moves; d_c (P, 16)."""
    places, count = np.zeros(d_c.shape[1], dtype=np.intp), 0
    for l in range(d_c.shape[1]):
        size = 0.0
        for j in range(d_c.shape[0]):
            size += abs(d_c[j, l])
        if size != 0.0:
            places[count] = l
            count += 1
    return places[:count]


@jit
def nonlinear_sensitivities(
    steps: FloatArray, drive: FloatArray, c: FloatArray, start: FloatArray, pieces: int, columns: FloatArray, place: IntArray,
    factor: FloatArray, d_c: FloatArray, d_start: FloatArray, out: FloatArray, sens: FloatArray,
) -> None:  # fmt: skip
    """Fill out (n, 3) and sens (P, 2, n) as `integrate.integrate_with_sensitivities` does, whatever the motion and the clock.

    All parameters go through one linear map a step, see `_map_row`.
    """
    n, count = steps.shape[0] + 1, d_c.shape[0]
    s, has_c = np.zeros((count, 3)), np.zeros(count)
    stages, rows, push, pull = np.zeros((STAGE_COLUMNS, 4)), np.zeros((3, 9)), np.zeros((3, 4)), np.zeros((3, 4))
    turning, raised, late = reverses(c), c[BEYOND_SQUARE] != 0.0, -0.5 * _total(steps)
    stripped = of_strips(c)
    crossing = crosses_limit(drive, c, start)
    for j in range(count):
        for l in range(3):
            s[j, l] = d_start[j, l]
        for l in range(d_c.shape[1]):
            has_c[j] += d_c[j, l] != 0.0
        sens[j, 0, 0], sens[j, 1, 0] = s[j, 0], s[j, 1]
        turning, stripped = turning or reverses(d_c[j]), stripped or of_strips(d_c[j])
        raised, crossing = (
            raised or d_c[j, BEYOND_SQUARE] != 0.0,
            crossing or crosses_limit_by(d_c[j]) or s[j, 2] != 0.0 or factor[j, 5] != 0.0,
        )
    bent = crossing or turning or raised or stripped or c[QUADRATIC] != 0.0
    moved = _moved_constants(d_c)
    by_constant = np.zeros((3, moved.shape[0]))
    last_h, last_a, last_k = -1.0, 0.0, 0.0
    y, p, x = start[0], start[1], start[2]
    out[0, 0], out[0, 1], out[0, 2] = y, p, x
    for i in range(n - 1):
        h = steps[i] / pieces
        a, k = drive[i, 0], drive[i, 1]
        fast = drive[i, 4]
        floored = max(fast, SMALLEST_SPEED_RATIO)
        damp, turn, hold, q = c[CROSS_DAMPING] * fast, c[CROSS_RATE] * fast * fast, c[CROSS_QUADRATIC] / floored, drive[i, 5]
        for piece in range(pieces):
            ky, kp, kx = 0.0, 0.0, 0.0
            ty, tp, tx = 0.0, 0.0, 0.0
            for stage in range(4):
                g, part, wt = _reach(stage) * h, (piece + _reach(stage)) / pieces, _weight(stage)
                ys, ps, xs = y + g * ky, p + g * kp, x + g * kx
                m = drive[i, 2] + (drive[i, 3] - drive[i, 2]) * part
                drag, log = ps * abs(ps), 0.0
                by_y, by_p = -k, -a - 2.0 * c[QUADRATIC] * abs(ps)
                if raised:
                    drag, log = power_drag(ps, c[BEYOND_SQUARE])
                    by_p = -a - (2.0 + c[BEYOND_SQUARE]) * c[QUADRATIC] * drag / (ps if abs(ps) > ZERO_RATE_RAD_S else 1.0)
                f = -a * ps - k * ys + m - c[QUADRATIC] * drag + c[CROSS_SHARE] * xs
                if turning:
                    clock = late + part * steps[i]
                    seen = ys - c[HEADING_TURN] * clock
                    sin, cos = np.sin(seen), np.cos(seen)
                    sin2, cos2 = 2.0 * sin * cos, 1.0 - 2.0 * sin * sin
                    f += c[HEADING_SIN] * sin + c[HEADING_COS] * cos + c[HEADING_SIN2] * sin2 + c[HEADING_COS2] * cos2
                    f += c[RIGHTING_SIN] * (seen - sin) + c[RIGHTING_COS] * (cos - 1.0)
                    slope = c[HEADING_SIN] * cos - c[HEADING_COS] * sin + 2.0 * (c[HEADING_SIN2] * cos2 - c[HEADING_COS2] * sin2)
                    slope += c[RIGHTING_SIN] * (1.0 - cos) - c[RIGHTING_COS] * sin
                    by_y += slope
                    stages[SIN, stage], stages[COS, stage], stages[ARC, stage] = sin, cos, seen - sin
                    stages[BY_TURN, stage] = slope * clock
                square = xs * abs(xs)
                slower = damp * xs + hold * square + turn * ps - q
                by_x = damp + 2.0 * hold * abs(xs)
                by_factor = c[CROSS_DAMPING] * xs + 2.0 * fast * c[CROSS_RATE] * ps - hold / floored * square
                stages[OF_X, stage], stages[OF_FACTOR, stage], stages[X_BY_P, stage] = c[CROSS_SHARE], 0.0, turn
                if stripped:
                    alpha = c[STRIP_FLOW] * xs / floored
                    moment, moment_by_flow, moment_by_p = crossflow(alpha, ps)
                    force, force_by_flow, force_by_p = crossforce(alpha, ps)
                    f -= c[STRIP_MOMENT] * moment
                    slower += c[STRIP_FORCE] * fast * force
                    by_p -= c[STRIP_MOMENT] * moment_by_p
                    by_x += c[STRIP_FORCE] * fast * force_by_flow * c[STRIP_FLOW] / floored
                    by_factor += c[STRIP_FORCE] * (force - fast * force_by_flow * alpha / floored)
                    stages[OF_X, stage] -= c[STRIP_MOMENT] * moment_by_flow * c[STRIP_FLOW] / floored
                    stages[OF_FACTOR, stage] = c[STRIP_MOMENT] * moment_by_flow * alpha / floored
                    stages[X_BY_P, stage] += c[STRIP_FORCE] * fast * force_by_p
                    stages[AT_MOMENT, stage], stages[AT_FORCE, stage] = moment, fast * force
                    stages[MOMENT_BY_FLOW, stage] = c[STRIP_MOMENT] * moment_by_flow * xs / floored
                    stages[FORCE_BY_FLOW, stage] = c[STRIP_FORCE] * fast * force_by_flow * xs / floored
                stages[AT_Y, stage], stages[AT_P, stage], stages[AT_X, stage], stages[PART, stage] = ys, ps, xs, part
                stages[BY_Y, stage], stages[BY_P, stage] = by_y, by_p
                stages[BY_X, stage], stages[BY_FACTOR, stage] = by_x, by_factor
                stages[DRAG, stage], stages[BY_POWER, stage] = drag, c[QUADRATIC] * log * drag
                ky, kp, kx = ps, f, -slower
                ty += wt * ky
                tp += wt * kp
                tx += wt * kx
            y += h / 6.0 * ty
            p += h / 6.0 * tp
            x += h / 6.0 * tx
            for row in range(2 + crossing):
                if bent or not (a == last_a and k == last_k and abs(h - last_h) < 1e-9 * h):
                    _map_row(row, h, stages, rows, push, pull)
                _map_rates(row, stages, push, rows)
            last_h, last_a, last_k = h, a, k
            _map_constants(moved, stages, push, pull, fast, floored, by_constant)
            for j in range(count):
                # written out: each call that hands over arrays would cost as much as what it does
                sy, sp, sx = s[j, 0], s[j, 1], s[j, 2]
                to_y = rows[0, 0] * sy + rows[0, 1] * sp
                to_p = rows[1, 0] * sy + rows[1, 1] * sp
                to_x = 0.0
                if crossing:
                    to_y += rows[0, 2] * sx
                    to_p += rows[1, 2] * sx
                    to_x = rows[2, 0] * sy + rows[2, 1] * sp + rows[2, 2] * sx
                if factor[j, 2] != 0.0 or factor[j, 3] != 0.0:
                    m = factor[j, 2] * columns[place[j, 2], i]
                    slope = factor[j, 3] * columns[place[j, 3], i] - m
                    to_y += rows[0, 3] * m + rows[0, 4] * slope
                    to_p += rows[1, 3] * m + rows[1, 4] * slope
                    if crossing:
                        to_x += rows[2, 3] * m + rows[2, 4] * slope
                if factor[j, 0] != 0.0 or factor[j, 1] != 0.0:
                    d_a, d_k = factor[j, 0] * columns[place[j, 0], i], factor[j, 1] * columns[place[j, 1], i]
                    to_y += rows[0, 5] * d_a + rows[0, 6] * d_k
                    to_p += rows[1, 5] * d_a + rows[1, 6] * d_k
                    if crossing:
                        to_x += rows[2, 5] * d_a + rows[2, 6] * d_k
                if crossing and (factor[j, 4] != 0.0 or factor[j, 5] != 0.0):
                    d_fast, d_q = factor[j, 4] * columns[place[j, 4], i], factor[j, 5] * columns[place[j, 5], i]
                    to_y += rows[0, 7] * d_q + rows[0, 8] * d_fast
                    to_p += rows[1, 7] * d_q + rows[1, 8] * d_fast
                    to_x += rows[2, 7] * d_q + rows[2, 8] * d_fast
                if has_c[j] > 0.0:
                    for l in range(moved.shape[0]):
                        size = d_c[j, moved[l]]
                        to_y += size * by_constant[0, l]
                        to_p += size * by_constant[1, l]
                        to_x += size * by_constant[2, l]
                # a start's influence dies out; below the normal numbers it would only cost time, eightfold
                s[j, 0] = to_y if abs(to_y) > SMALLEST_WEIGHT else 0.0
                s[j, 1] = to_p if abs(to_p) > SMALLEST_WEIGHT else 0.0
                s[j, 2] = to_x if abs(to_x) > SMALLEST_WEIGHT else 0.0
        if not abs(p) < DIVERGED_RATE_RAD_S:
            set_diverged(out, i + 1)
            set_all_diverged(sens, i + 1)
            return
        out[i + 1, 0], out[i + 1, 1], out[i + 1, 2] = y, p, x
        late += steps[i]
        for j in range(count):
            sens[j, 0, i + 1], sens[j, 1, i + 1] = s[j, 0], s[j, 1]
