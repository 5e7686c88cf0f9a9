"""The compiled core of any motion: the equations of models/hull.py by RK4 over each interval, with exact tangents of that map.

Damping, stiffness, the fin and the cross factor are held over an interval; the moment runs straight from its start to its end.
The tangents are the derivatives of the discrete map itself, so a least-squares step has no truncation error of its own.
"""

from __future__ import annotations

import numpy as np

from fieldsid.dynamics.linear_kernel import DIVERGED_RATE_RAD_S, set_all_diverged, set_diverged
from fieldsid.models.hull import (
    CROSS_FACTOR,
    DAMPING,
    FIN,
    MOMENT_END,
    MOMENT_START,
    STIFFNESS,
    Core,
    Kinds,
    Slope,
    by_constants,
    either,
    kinds_of,
    named,
    slope,
)
from fieldsid.numerics.arrays import FloatArray, IntArray
from fieldsid.numerics.jit import inner, jit

SMALLEST_WEIGHT = 1e-150
BY_ANGLE, BY_RATE, BY_CROSS, BY_FACTOR, CROSS_BY_RATE, CROSS_BY_CROSS, CROSS_BY_FACTOR, AT_ANGLE, AT_RATE, PART = range(10)
"""What is kept of each stage of a step: the slopes, see `Slope`; angle, rate and the share of the interval that has passed."""
OF_ANGLE, OF_RATE, OF_CROSS, OF_LEVEL, OF_RISE, OF_DAMPING, OF_STIFFNESS, OF_FIN, OF_FACTOR = range(9)
"""The columns of a step's linear map: of the state, of a moment's level and rise, and of the other drives."""


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


@inner
def over_interval(
    k: Core, kinds: Kinds, drive: FloatArray, i: int, step: float, pieces: int, late: float, state: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Return angle, rate and cross state after the interval of a drive's row i (n-1, 6), `late` s after the run's middle."""
    y, p, x = state
    h, a, b, fast, fin = step / pieces, drive[i, DAMPING], drive[i, STIFFNESS], drive[i, CROSS_FACTOR], drive[i, FIN]
    first, last = drive[i, MOMENT_START], drive[i, MOMENT_END]
    for piece in range(pieces):
        ky, kp, kx, ty, tp, tx = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for stage in range(4):
            g, part = _reach(stage) * h, (piece + _reach(stage)) / pieces
            rate, moment = p + g * kp, first + (last - first) * part
            now = slope(k, kinds, a, b, moment, fin, fast, y + g * ky, rate, x + g * kx, late + part * step)
            ky, kp, kx = rate, now.rate, now.cross
            ty, tp, tx = ty + _weight(stage) * ky, tp + _weight(stage) * kp, tx + _weight(stage) * kx
        y, p, x = y + h / 6.0 * ty, p + h / 6.0 * tp, x + h / 6.0 * tx
    return y, p, x


@jit
def nonlinear_motion(
    steps: FloatArray, drive: FloatArray, c: FloatArray, start: FloatArray, pieces: int, out: FloatArray
) -> None:
    """Fill out (n, 3) as `integrate.integrate_motion` does, whatever the motion and the clock."""
    state = (start[0], start[1], start[2])
    out[0, 0], out[0, 1], out[0, 2] = state
    k, kinds, late = named(c), kinds_of(c), -0.5 * _total(steps)
    for i in range(steps.shape[0]):
        state = over_interval(k, kinds, drive, i, steps[i], pieces, late, state)
        if not abs(state[1]) < DIVERGED_RATE_RAD_S:
            set_diverged(out, i + 1)
            return
        out[i + 1, 0], out[i + 1, 1], out[i + 1, 2] = state
        late += steps[i]


@inner
def _keep(stage: int, now: Slope, y: float, p: float, part: float, stages: FloatArray) -> None:
    """Fill column `stage` of stages (10, 4) with what the linear map of a step is made of."""
    stages[BY_ANGLE, stage], stages[BY_RATE, stage], stages[BY_CROSS, stage] = now.by_angle, now.by_rate, now.by_cross
    stages[BY_FACTOR, stage], stages[CROSS_BY_FACTOR, stage] = now.by_factor, now.cross_by_factor
    stages[CROSS_BY_RATE, stage], stages[CROSS_BY_CROSS, stage] = now.cross_by_rate, now.cross_by_cross
    stages[AT_ANGLE, stage], stages[AT_RATE, stage], stages[PART, stage] = y, p, part


@inner
def _map_row(
    row: int, h: float, cross_fin: float, stages: FloatArray, rows: FloatArray, push: FloatArray, pull: FloatArray
) -> None:
    """Fill one row of a step's linear map: rows (3, 9) of the state and of what enters, push and pull (3, 4) of each stage.

    A tangent obeys s' = A_l s + b u_l at stage l of the step, so that s -> s + sum_l W_l (A_l s + b u_l) with
    W_4 = h/6, W_3 = h/3 + h W_4 A_4, W_2 = h/3 + h/2 W_3 A_3, W_1 = h/6 + h/2 W_2 A_2: the same for every parameter.
    """
    in_y, in_p, in_x = 1.0 * (row == 0), 1.0 * (row == 1), 1.0 * (row == 2)
    of_y, of_p, of_x = in_y, in_p, in_x
    v_y, v_p, v_x, part = 0.0, 0.0, 0.0, 0.0
    level, of_cross, by_factor = 0.0, 0.0, 0.0
    for back in range(4):
        l = 3 - back
        whole = _weight(l) * h / 6.0
        w_y, w_p, w_x = part * v_y + whole * in_y, part * v_p + whole * in_p, part * v_x + whole * in_x
        v_y, v_p = w_p * stages[BY_ANGLE, l], w_y + w_p * stages[BY_RATE, l] + w_x * stages[CROSS_BY_RATE, l]
        v_x = w_p * stages[BY_CROSS, l] + w_x * stages[CROSS_BY_CROSS, l]
        of_y, of_p, of_x = of_y + v_y, of_p + v_p, of_x + v_x
        level, of_cross = level + w_p, of_cross + w_x
        by_factor += w_p * stages[BY_FACTOR, l] + w_x * stages[CROSS_BY_FACTOR, l]
        push[row, l], pull[row, l] = w_p, w_x
        part = _reach(l) * h
    rows[row, OF_ANGLE], rows[row, OF_RATE], rows[row, OF_CROSS], rows[row, OF_LEVEL] = of_y, of_p, of_x, level
    rows[row, OF_FIN], rows[row, OF_FACTOR] = cross_fin * of_cross, by_factor


@inner
def _map_rates(row: int, stages: FloatArray, push: FloatArray, rows: FloatArray) -> None:
    """Fill what changes from step to step, and from piece to piece of one, in a row of the linear map of a linear motion."""
    rise, turned, stiffened = 0.0, 0.0, 0.0
    for l in range(4):
        rise += push[row, l] * stages[PART, l]
        turned, stiffened = turned + push[row, l] * stages[AT_RATE, l], stiffened + push[row, l] * stages[AT_ANGLE, l]
    rows[row, OF_RISE], rows[row, OF_DAMPING], rows[row, OF_STIFFNESS] = rise, -turned, -stiffened


@inner
def _map_constants(
    moved: IntArray, of_rate: FloatArray, of_cross: FloatArray, push: FloatArray, pull: FloatArray, by: FloatArray
) -> None:
    """Fill by (3, K) with what a step makes of the state per unit of each of the K constants that any parameter moves.

    Where there is no cross state no constant moves it, and the third rows of push and pull are nil.
    """
    for l in range(moved.shape[0]):
        for row in range(3):
            total = 0.0
            for stage in range(4):
                total += push[row, stage] * of_rate[moved[l], stage] + pull[row, stage] * of_cross[moved[l], stage]
            by[row, l] = total


@inner
def _moved_constants(d_c: FloatArray) -> IntArray:
    """Return the places of the constants that any parameter moves; d_c (P, 17)."""
    places, count = np.zeros(d_c.shape[1], dtype=np.intp), 0
    for l in range(d_c.shape[1]):
        size = 0.0
        for j in range(d_c.shape[0]):
            size += abs(d_c[j, l])
        if size != 0.0:
            places[count] = l
            count += 1
    return places[:count]


@inner
def _all_kinds(c: FloatArray, start: FloatArray, d_c: FloatArray, d_start: FloatArray) -> tuple[Kinds, bool]:
    """Return the kinds of terms that the constants or a parameter bring in, and whether there is a cross state."""
    kinds = kinds_of(c)
    crossing = start[2] != 0.0
    for j in range(d_c.shape[0]):
        kinds = either(kinds, kinds_of(d_c[j]))
        crossing = crossing or d_start[j, 2] != 0.0
    return kinds, crossing or kinds.crossing


@inner
def _carry(
    i: int, size: int, rows: FloatArray, columns: FloatArray, place: IntArray, factor: FloatArray, d_c: FloatArray,
    has_c: FloatArray, moved: IntArray, by: FloatArray, s: FloatArray,
) -> None:  # fmt: skip
    """Carry the tangents s (P, 3) over a step of interval i: by the map of its `size` states, the drives and the constants."""
    crossing = size > 2
    for j in range(s.shape[0]):
        # written out: each call that hands over arrays would cost as much as what it does
        sy, sp, sx = s[j, 0], s[j, 1], s[j, 2]
        to_y, to_p = rows[0, OF_ANGLE] * sy + rows[0, OF_RATE] * sp, rows[1, OF_ANGLE] * sy + rows[1, OF_RATE] * sp
        to_x = 0.0
        if crossing:
            to_y, to_p = to_y + rows[0, OF_CROSS] * sx, to_p + rows[1, OF_CROSS] * sx
            to_x = rows[2, OF_ANGLE] * sy + rows[2, OF_RATE] * sp + rows[2, OF_CROSS] * sx
        if factor[j, MOMENT_START] != 0.0 or factor[j, MOMENT_END] != 0.0:
            level = factor[j, MOMENT_START] * columns[place[j, MOMENT_START], i]
            rise = factor[j, MOMENT_END] * columns[place[j, MOMENT_END], i] - level
            to_y += rows[0, OF_LEVEL] * level + rows[0, OF_RISE] * rise
            to_p += rows[1, OF_LEVEL] * level + rows[1, OF_RISE] * rise
            if crossing:
                to_x += rows[2, OF_LEVEL] * level + rows[2, OF_RISE] * rise
        if factor[j, DAMPING] != 0.0 or factor[j, STIFFNESS] != 0.0:
            d_a, d_k = factor[j, DAMPING] * columns[place[j, DAMPING], i], factor[j, STIFFNESS] * columns[place[j, STIFFNESS], i]
            to_y += rows[0, OF_DAMPING] * d_a + rows[0, OF_STIFFNESS] * d_k
            to_p += rows[1, OF_DAMPING] * d_a + rows[1, OF_STIFFNESS] * d_k
            if crossing:
                to_x += rows[2, OF_DAMPING] * d_a + rows[2, OF_STIFFNESS] * d_k
        if crossing and (factor[j, CROSS_FACTOR] != 0.0 or factor[j, FIN] != 0.0):
            d_fin, d_g = factor[j, FIN] * columns[place[j, FIN], i], factor[j, CROSS_FACTOR] * columns[place[j, CROSS_FACTOR], i]
            to_y += rows[0, OF_FIN] * d_fin + rows[0, OF_FACTOR] * d_g
            to_p += rows[1, OF_FIN] * d_fin + rows[1, OF_FACTOR] * d_g
            to_x += rows[2, OF_FIN] * d_fin + rows[2, OF_FACTOR] * d_g
        if has_c[j] > 0.0:
            for l in range(moved.shape[0]):
                by_own = d_c[j, moved[l]]
                to_y, to_p, to_x = to_y + by_own * by[0, l], to_p + by_own * by[1, l], to_x + by_own * by[2, l]
        # a start's influence dies out; below the normal numbers it would only cost time, eightfold
        s[j, 0] = to_y if abs(to_y) > SMALLEST_WEIGHT else 0.0
        s[j, 1] = to_p if abs(to_p) > SMALLEST_WEIGHT else 0.0
        s[j, 2] = to_x if abs(to_x) > SMALLEST_WEIGHT else 0.0


@jit
def nonlinear_sensitivities(
    steps: FloatArray, drive: FloatArray, c: FloatArray, start: FloatArray, pieces: int, columns: FloatArray, place: IntArray,
    factor: FloatArray, d_c: FloatArray, d_start: FloatArray, out: FloatArray, sens: FloatArray,
) -> None:  # fmt: skip
    """Fill out (n, 3) and sens (P, 2, n) as `integrate.integrate_with_sensitivities` does, whatever the motion and the clock.

    All parameters go through one linear map a step, see `_map_row`.
    """
    count, size = d_c.shape
    s, has_c = d_start.copy(), np.zeros(count)
    stages, rows, push, pull = np.zeros((10, 4)), np.zeros((3, 9)), np.zeros((3, 4)), np.zeros((3, 4))
    of_rate, of_cross = np.zeros((size, 4)), np.zeros((size, 4))
    k, (kinds, crossing), late = named(c), _all_kinds(c, start, d_c, d_start), -0.5 * _total(steps)
    for j in range(count):
        for l in range(size):
            has_c[j] += d_c[j, l] != 0.0
        sens[j, 0, 0], sens[j, 1, 0] = s[j, 0], s[j, 1]
    bent, moved = crossing or kinds.bent or kinds.raised, _moved_constants(d_c)
    by = np.zeros((3, moved.shape[0]))
    last_h, last_a, last_b = -1.0, 0.0, 0.0
    y, p, x = start[0], start[1], start[2]
    out[0, 0], out[0, 1], out[0, 2] = y, p, x
    for i in range(steps.shape[0]):
        h, a, b, fast, fin = steps[i] / pieces, drive[i, DAMPING], drive[i, STIFFNESS], drive[i, CROSS_FACTOR], drive[i, FIN]
        first, last = drive[i, MOMENT_START], drive[i, MOMENT_END]
        for piece in range(pieces):
            ky, kp, kx, ty, tp, tx = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for stage in range(4):
                g, part, weight = _reach(stage) * h, (piece + _reach(stage)) / pieces, _weight(stage)
                angle, rate, cross = y + g * ky, p + g * kp, x + g * kx
                moment = first + (last - first) * part
                now = slope(k, kinds, a, b, moment, fin, fast, angle, rate, cross, late + part * steps[i])
                _keep(stage, now, angle, rate, part, stages)
                by_constants(k, kinds, now, fin, fast, rate, cross, stage, of_rate, of_cross)
                ky, kp, kx = rate, now.rate, now.cross
                ty, tp, tx = ty + weight * ky, tp + weight * kp, tx + weight * kx
            y, p, x = y + h / 6.0 * ty, p + h / 6.0 * tp, x + h / 6.0 * tx
            alike = not bent and a == last_a and b == last_b and abs(h - last_h) < 1e-9 * h
            for row in range(2 + crossing):
                if not alike:
                    _map_row(row, h, k.cross_fin, stages, rows, push, pull)
                _map_rates(row, stages, push, rows)
            last_h, last_a, last_b = h, a, b
            _map_constants(moved, of_rate, of_cross, push, pull, by)
            _carry(i, 2 + crossing, rows, columns, place, factor, d_c, has_c, moved, by, s)
        if not abs(p) < DIVERGED_RATE_RAD_S:
            set_diverged(out, i + 1)
            set_all_diverged(sens, i + 1)
            return
        out[i + 1, 0], out[i + 1, 1], out[i + 1, 2] = y, p, x
        late += steps[i]
        for j in range(count):
            sens[j, 0, i + 1], sens[j, 1, i + 1] = s[j, 0], s[j, 1]
