"""The compiled kernel of any motion: the equations of models/hull.py by RK4, with the exact derivatives of the discrete map.

Damping, stiffness, fin and cross factor are constant over an interval; the moment is linear from its start to its end. A tangent
is the derivative of the state by one parameter: that of the RK4 map itself, so that the gradient is exact for the simulation.
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
from fieldsid.numerics.jit import inlined, inner, jit

SMALLEST_WEIGHT = 1e-150
MAX_PIECES = 200
"""The largest number of RK4 steps in an interval, and the length of a block of steps, see `nonlinear_sensitivities`."""
BY_ANGLE, BY_RATE, BY_CROSS, BY_FACTOR, CROSS_BY_RATE, CROSS_BY_CROSS, CROSS_BY_FACTOR, AT_ANGLE, AT_RATE, PART, STEP = range(11)
"""Rows of the table of a step's stages: the derivatives of `Slope`; angle and rate; the elapsed share of the interval; h."""
OF_DRIVES, OF_CONSTANTS = 3, 9
"""First columns of the drives and of the constants in a step's linear map; the first three columns are those of the state."""


@inner
def _weight(stage: int) -> float:
    """Return the weight of a stage of the RK4 rule, times six."""
    return 1.0 + (stage % 3 != 0)


@inner
def _reach(stage: int) -> float:
    """Return the share of a step at which a stage of the RK4 rule is evaluated."""
    return 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)


@inner
def _total(steps: FloatArray) -> float:
    """Return the sum of steps; this loop compiles in a fraction of the time of the array method."""
    total = 0.0
    for i in range(steps.shape[0]):
        total += steps[i]
    return total


@inner
def over_interval(
    k: Core, kinds: Kinds, drive: FloatArray, i: int, step: float, pieces: int, late: float, state: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Return angle, rate and cross state after interval i of drive (n-1, 6), which begins `late` s after the run's middle."""
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
    """Fill out (n, 3) as `integrate.integrate_motion` does, for any motion and any steps."""
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


@inlined
def _keep(now: Slope, y: float, p: float, part: float, h: float, stage: int, at: int, kept: FloatArray) -> None:
    """Fill kept (11, 4, m) with the values of one stage of step `at` from which its linear map is computed."""
    kept[BY_ANGLE, stage, at], kept[BY_RATE, stage, at], kept[BY_CROSS, stage, at] = now.by_angle, now.by_rate, now.by_cross
    kept[BY_FACTOR, stage, at], kept[CROSS_BY_FACTOR, stage, at] = now.by_factor, now.cross_by_factor
    kept[CROSS_BY_RATE, stage, at], kept[CROSS_BY_CROSS, stage, at] = now.cross_by_rate, now.cross_by_cross
    kept[AT_ANGLE, stage, at], kept[AT_RATE, stage, at], kept[PART, stage, at], kept[STEP, stage, at] = y, p, part, h


@inlined
def _map_row(
    row: int, count: int, cross_fin: float, kept: FloatArray, push: FloatArray, pull: FloatArray, maps: FloatArray
) -> None:
    """Fill one row of the linear maps of `count` steps: maps (3, 9 + K, m), the columns of the state and the drives.

    A tangent obeys s' = A_l s + b u_l at stage l of the step, so that s -> s + sum_l W_l (A_l s + b u_l) with
    W_4 = h/6, W_3 = h/3 + h W_4 A_4, W_2 = h/3 + h/2 W_3 A_3, W_1 = h/6 + h/2 W_2 A_2: the same for every parameter.
    push and pull (4, m) receive the weights of p' and x' at each stage.
    """
    in_y, in_p, in_x = 1.0 * (row == 0), 1.0 * (row == 1), 1.0 * (row == 2)
    for at in range(count):  # arrays of known shape and no branch, so that the compiler vectorises over four steps
        of_y, of_p, of_x = in_y, in_p, in_x
        v_y, v_p, v_x, reach = 0.0, 0.0, 0.0, 0.0
        total, end, turned, stiffened, of_cross, by_factor = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for back in range(4):
            l = 3 - back
            h = kept[STEP, l, at]
            w = _weight(l) * h / 6.0
            w_y, w_p, w_x = reach * v_y + w * in_y, reach * v_p + w * in_p, reach * v_x + w * in_x
            v_y, v_p = w_p * kept[BY_ANGLE, l, at], w_y + w_p * kept[BY_RATE, l, at] + w_x * kept[CROSS_BY_RATE, l, at]
            v_x = w_p * kept[BY_CROSS, l, at] + w_x * kept[CROSS_BY_CROSS, l, at]
            of_y, of_p, of_x = of_y + v_y, of_p + v_p, of_x + v_x
            total, end, of_cross = total + w_p, end + w_p * kept[PART, l, at], of_cross + w_x
            turned, stiffened = turned - w_p * kept[AT_RATE, l, at], stiffened - w_p * kept[AT_ANGLE, l, at]
            by_factor += w_p * kept[BY_FACTOR, l, at] + w_x * kept[CROSS_BY_FACTOR, l, at]
            push[l, at], pull[l, at] = w_p, w_x
            reach = _reach(l) * h
        maps[row, 0, at], maps[row, 1, at], maps[row, 2, at] = of_y, of_p, of_x
        maps[row, OF_DRIVES + MOMENT_START, at], maps[row, OF_DRIVES + MOMENT_END, at] = total - end, end
        maps[row, OF_DRIVES + DAMPING, at], maps[row, OF_DRIVES + STIFFNESS, at] = turned, stiffened
        maps[row, OF_DRIVES + FIN, at], maps[row, OF_DRIVES + CROSS_FACTOR, at] = cross_fin * of_cross, by_factor


@inlined
def _map_constants(
    row: int, count: int, of_rate: FloatArray, of_cross: FloatArray, push: FloatArray, pull: FloatArray, maps: FloatArray
) -> None:
    """Fill the columns of the K constants in the same row; of_rate, of_cross (K, 4, m): derivatives of p', x' by them."""
    for l in range(of_rate.shape[0]):
        for at in range(count):
            total = 0.0
            for stage in range(4):
                total += push[stage, at] * of_rate[l, stage, at] + pull[stage, at] * of_cross[l, stage, at]
            maps[row, OF_CONSTANTS + l, at] = total


@inner
def _moved_constants(d_c: FloatArray) -> IntArray:
    """Return the places of the constants that depend on any parameter; d_c (P, C) are their derivatives."""
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
    """Return the kinds of terms that the constants, or their derivatives, bring in, and whether there is a cross state."""
    kinds = kinds_of(c)
    crossing = start[2] != 0.0
    for j in range(d_c.shape[0]):
        kinds = either(kinds, kinds_of(d_c[j]))
        crossing = crossing or d_start[j, 2] != 0.0
    return kinds, crossing or kinds.crossing


@inlined
def _force(
    size: int, count: int, maps: FloatArray, given: FloatArray, place: IntArray, factor: FloatArray, d_c: FloatArray,
    moved: IntArray, force: FloatArray,
) -> None:  # fmt: skip
    """Fill force (3, m) with the direct contribution of a parameter to its tangent, of `size` components, in `count` steps."""
    for row in range(size):
        for at in range(count):
            force[row, at] = 0.0
        for l in range(moved.shape[0]):
            by = d_c[moved[l]]  # out of the loop: the compiler cannot know that d_c and force do not overlap
            if by != 0.0:
                for at in range(count):
                    force[row, at] += by * maps[row, OF_CONSTANTS + l, at]
        for l in range(factor.shape[0]):
            by, of = factor[l], place[l]
            if by != 0.0:
                for at in range(count):
                    force[row, at] += by * given[of, at] * maps[row, OF_DRIVES + l, at]


@inlined
def _carry(pieces: int, count: int, maps: FloatArray, force: FloatArray, s: FloatArray, sens: FloatArray, first: int) -> None:
    """Advance a parameter's tangent s (3,) over `count` intervals by the steps' maps; fill sens (2, n) after sample `first`."""
    y, p, x = s[0], s[1], s[2]
    for i in range(count):
        for piece in range(pieces):
            at = i * pieces + piece
            y, p, x = (
                (maps[0, 0, at] * y + maps[0, 1, at] * p) + (maps[0, 2, at] * x + force[0, at]),
                (maps[1, 0, at] * y + maps[1, 1, at] * p) + (maps[1, 2, at] * x + force[1, at]),
                (maps[2, 0, at] * y + maps[2, 1, at] * p) + (maps[2, 2, at] * x + force[2, at]),
            )
        sens[0, first + i + 1], sens[1, first + i + 1] = y, p
    # the influence of the initial state dies out; arithmetic with subnormal numbers would take eight times as long
    s[0] = y if abs(y) > SMALLEST_WEIGHT else 0.0
    s[1] = p if abs(p) > SMALLEST_WEIGHT else 0.0
    s[2] = x if abs(x) > SMALLEST_WEIGHT else 0.0


@jit
def nonlinear_sensitivities(
    steps: FloatArray, drive: FloatArray, c: FloatArray, start: FloatArray, pieces: int, columns: FloatArray, place: IntArray,
    factor: FloatArray, d_c: FloatArray, d_start: FloatArray, out: FloatArray, sens: FloatArray,
) -> None:  # fmt: skip
    """Fill out (n, 3) and sens (P, 2, n) as `integrate.integrate_with_sensitivities` does, for any motion and any steps.

    One linear map a step, see `_map_row`, serves the tangents of all parameters. The motion is computed for a block of steps, the
    maps of the block are computed by vector instructions, then each parameter's tangent is advanced through the whole block, so
    that its results are written to consecutive memory.
    """
    s, moved, m = d_start.copy(), _moved_constants(d_c), MAX_PIECES
    count, size, more = s.shape[0], d_c.shape[1], moved.shape[0]
    of_rate, of_cross, push, pull = np.zeros((size, 4)), np.zeros((size, 4)), np.zeros((4, m)), np.zeros((4, m))
    kept_rate, kept_cross, given = np.zeros((more, 4, m)), np.zeros((more, 4, m)), np.zeros((columns.shape[0], m))
    kept, maps, force = np.zeros((11, 4, m)), np.zeros((3, OF_CONSTANTS + more, m)), np.zeros((3, m))
    k, (kinds, crossing), late = named(c), _all_kinds(c, start, d_c, d_start), -0.5 * _total(steps)
    for j in range(count):
        sens[j, 0, 0], sens[j, 1, 0] = s[j, 0], s[j, 1]
    y, p, x = start[0], start[1], start[2]
    out[0, 0], out[0, 1], out[0, 2] = y, p, x
    i, bounded = 0, True
    while bounded and i < steps.shape[0]:
        first, at = i, 0
        while bounded and i < steps.shape[0] and at + pieces <= m:
            h, a, b, fast, fin = steps[i] / pieces, drive[i, DAMPING], drive[i, STIFFNESS], drive[i, CROSS_FACTOR], drive[i, FIN]
            level, rise = drive[i, MOMENT_START], drive[i, MOMENT_END] - drive[i, MOMENT_START]
            for piece in range(pieces):
                ky, kp, kx, ty, tp, tx = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                for stage in range(4):
                    g, part, weight = _reach(stage) * h, (piece + _reach(stage)) / pieces, _weight(stage)
                    angle, rate, cross = y + g * ky, p + g * kp, x + g * kx
                    now = slope(k, kinds, a, b, level + rise * part, fin, fast, angle, rate, cross, late + part * steps[i])
                    _keep(now, angle, rate, part, h, stage, at, kept)
                    by_constants(k, kinds, now, fin, fast, rate, cross, stage, of_rate, of_cross)
                    ky, kp, kx = rate, now.rate, now.cross
                    ty, tp, tx = ty + weight * ky, tp + weight * kp, tx + weight * kx
                y, p, x = y + h / 6.0 * ty, p + h / 6.0 * tp, x + h / 6.0 * tx
                for l in range(more):
                    for stage in range(4):
                        kept_rate[l, stage, at], kept_cross[l, stage, at] = of_rate[moved[l], stage], of_cross[moved[l], stage]
                for l in range(columns.shape[0]):
                    given[l, at] = columns[l, i]
                at += 1
            bounded = abs(p) < DIVERGED_RATE_RAD_S
            if bounded:
                late += steps[i]
                i += 1
                out[i, 0], out[i, 1], out[i, 2] = y, p, x
        for row in range(2 + crossing):
            _map_row(row, at, k.cross_fin, kept, push, pull, maps)
            _map_constants(row, at, kept_rate, kept_cross, push, pull, maps)
        for j in range(count):
            _force(2 + crossing, at, maps, given, place[j], factor[j], d_c[j], moved, force)
            _carry(pieces, i - first, maps, force, s[j], sens[j], first)
    set_diverged(out, i + 1)
    set_all_diverged(sens, i + 1)
