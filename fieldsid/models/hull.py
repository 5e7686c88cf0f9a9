"""The equations of motion of an identified vehicle in one plane: the right-hand side and its derivatives by state and constants.

    y' = p
    p' = -a p - k y + m(t) - Q p|p| (|p|/0.2)^o - N F(s x/g, p) + c x
         + hs sin z + hc cos z + hs2 sin 2z + hc2 cos 2z + rs (z - sin z) + rc (cos z - 1)
    z = y - ht (t - t_middle)
    x' = -e g x - (D/g) x|x| - f g^2 p - Y g G(s x/g, p) + h d
    F(alpha, p) = 32 int_{-1/2}^{1/2} (alpha + xi p) |alpha + xi p| xi dxi        (F(0, p) = p |p|)
    G(alpha, p) = int_{-1/2}^{1/2} (alpha + xi p) |alpha + xi p| dxi              (G(alpha, 0) = alpha |alpha|)
with y the angle, p the rate, x the cross state (sway or heave, scaled so that its moment is c x), d the fin angle, g the speed
over the speed of the run and t_middle the middle of the run. Free runs, closed loops, settled turns, linear plants and planned
flights all use these equations. A hydrodynamic term is a field of `Core`, a term of `slope` and its derivative in `by_constants`.
Source: Fossen 2011, sections 6.4.3 (cross-flow drag principle) and 7.1.
"""

from __future__ import annotations

from math import cos, exp, log, sin, sqrt
from operator import add
from typing import NamedTuple

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import inlined, inner

REFERENCE_RATE_RAD_S, ZERO_RATE_RAD_S = 0.2, 1e-9
"""rad/s: the rate at which drag of another power equals the quadratic drag, and the rate below which it is taken as zero."""
SMALLEST_SPEED_RATIO = 0.01
"""Lower limit of g in D/g and s/g: a hull at rest has no sway in proportion to the cross state."""


class Core(NamedTuple):
    """The C constants of the equations, in the order of the kernels' arrays (C,); defaults are those of an absent effect.

    In the symbols of the module: Q = quadratic, o = beyond_square, hs, hc, hs2, hc2 = heading_sin, heading_cos, heading_sin2,
    heading_cos2, ht = heading_turn, rs, rc = righting_sin, righting_cos, c = cross_share, e = cross_damping, f = cross_rate,
    D = cross_quadratic, h = cross_fin, N = strip_moment, Y = strip_force, s = strip_flow.
    """

    quadratic: float = 0.0
    heading_sin: float = 0.0
    heading_cos: float = 0.0
    righting_sin: float = 0.0
    righting_cos: float = 0.0
    cross_damping: float = 0.0
    cross_rate: float = 0.0
    cross_quadratic: float = 0.0
    beyond_square: float = 0.0
    heading_sin2: float = 0.0
    heading_cos2: float = 0.0
    heading_turn: float = 0.0
    cross_share: float = 1.0
    strip_moment: float = 0.0
    strip_force: float = 0.0
    strip_flow: float = 0.0
    cross_fin: float = 0.0

    def plus(self, other: Core) -> Core:
        """Return the sum of two sets of constants; each of FACTORS is taken from the set in which it is not one."""
        factors = {n: (b if (b := getattr(other, n)) != 1.0 else getattr(self, n)) for n in FACTORS}
        return Core._make(map(add, self, other))._replace(**factors)

    def steady_cross_state(self, rate: float) -> float:
        """Return the cross state that a steady rate p leads to at the speed of the run, zero where there is no cross state.

        The cross-flow force G is taken at zero rate, G(s x, 0).
        """
        if self.cross_damping <= 0.0:
            return 0.0
        push, square = -self.cross_rate * rate, self.cross_quadratic + self.strip_force * self.strip_flow**2
        return 2.0 * push / (self.cross_damping + sqrt(self.cross_damping**2 + 4.0 * square * abs(push)))


CONSTANTS = Core._fields
(
    QUADRATIC, HEADING_SIN, HEADING_COS, RIGHTING_SIN, RIGHTING_COS, CROSS_DAMPING, CROSS_RATE, CROSS_QUADRATIC, BEYOND_SQUARE,
    HEADING_SIN2, HEADING_COS2, HEADING_TURN, CROSS_SHARE, STRIP_MOMENT, STRIP_FORCE, STRIP_FLOW, CROSS_FIN,
) = range(len(CONSTANTS))  # fmt: skip
FACTORS = ("cross_share",)
"""The constants that are one where no effect sets them."""
RISING = ("quadratic", "strip_moment")
"""The constants of a damping that grows with the rate and so bounds the rate of a hull with negative linear damping."""
OF_ANGLE = (HEADING_SIN, HEADING_COS, RIGHTING_SIN, RIGHTING_COS, HEADING_SIN2, HEADING_COS2, HEADING_TURN)
"""The constants of the terms in the angle y: they need the course of a run and mean nothing for a circle or a step from any."""
MULTIPLIERS = (BEYOND_SQUARE, HEADING_TURN, CROSS_SHARE, STRIP_FLOW)
"""The constants that only modify a term of another constant: the motion is linear where all others are zero."""
DRIVES = ("damping", "stiffness", "moment_start", "moment_end", "cross_factor", "fin")
"""The inputs over each interval, by their place: a, k and g constant, m linear from start to end, d as its mean."""
DAMPING, STIFFNESS, MOMENT_START, MOMENT_END, CROSS_FACTOR, FIN = range(len(DRIVES))


class Kinds(NamedTuple):
    """The kinds of terms that are present, so that the others need not be computed.

    turning: in the angle y; stripped: the cross-flow integrals F and G; raised: a drag exponent other than two; crossing: the
    equation of the cross state; bent: any term besides a, k and m. Constants and parameters' derivatives of them both count.
    """

    turning: bool
    stripped: bool
    raised: bool
    crossing: bool
    bent: bool


class Slope(NamedTuple):
    """The right-hand sides p' (`rate`) and x' (`cross`), their derivatives by y, p, x and g, and the factors of the constants.

    by_... are derivatives of p', cross_by_... of x'. drag = p|p| (|p|/0.2)^o and log_rate = log(|p|/0.2); sin and cos are those
    of z, arc = z - sin z; by_turn, moment_by_flow and force_by_flow are derivatives by ht and s; moment = F and force = g G.
    """

    rate: float
    cross: float
    by_angle: float
    by_rate: float
    by_cross: float
    by_factor: float
    cross_by_rate: float
    cross_by_cross: float
    cross_by_factor: float
    drag: float
    log_rate: float
    sin: float
    cos: float
    arc: float
    by_turn: float
    moment: float
    force: float
    moment_by_flow: float
    force_by_flow: float


@inner
def named(c: FloatArray) -> Core:
    """Return the constants (C,) as a `Core`."""
    return Core(
        c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8], c[9], c[10], c[11], c[12], c[13], c[14], c[15], c[16]
    )  # fmt: skip


@inner
def kinds_of(c: FloatArray) -> Kinds:
    """Return the kinds of terms that constants (C,), or a parameter's derivatives of them, bring in."""
    heading = abs(c[HEADING_SIN]) + abs(c[HEADING_COS]) + abs(c[HEADING_SIN2]) + abs(c[HEADING_COS2])
    crossing = abs(c[CROSS_DAMPING]) + abs(c[CROSS_RATE]) + abs(c[CROSS_QUADRATIC]) + abs(c[CROSS_FIN]) + abs(c[STRIP_FORCE])
    bent = 0.0
    for l in range(c.shape[0]):
        if l not in MULTIPLIERS:
            bent += abs(c[l])
    return Kinds(
        heading + abs(c[RIGHTING_SIN]) + abs(c[RIGHTING_COS]) != 0.0,
        abs(c[STRIP_MOMENT]) + abs(c[STRIP_FORCE]) != 0.0,
        c[BEYOND_SQUARE] != 0.0,
        crossing != 0.0,
        bent != 0.0,
    )


@inner
def either(one: Kinds, other: Kinds) -> Kinds:
    """Return the kinds of terms that are in `one` or in `other`."""
    return Kinds(
        one.turning or other.turning, one.stripped or other.stripped, one.raised or other.raised,
        one.crossing or other.crossing, one.bent or other.bent,
    )  # fmt: skip


@inlined
def slope(
    k: Core, kinds: Kinds, damping: float, stiffness: float, moment: float, fin: float, factor: float,
    y: float, p: float, x: float, clock: float,
) -> Slope:  # fmt: skip
    """Return the right-hand side and its derivatives at angle y, rate p and cross state x, `clock` = t - t_middle in s."""
    floored = max(factor, SMALLEST_SPEED_RATIO)
    drag, log_rate, steep = p * abs(p), 0.0, 2.0 * abs(p)
    if kinds.raised:
        drag, log_rate = power_drag(p, k.beyond_square)
        steep = (2.0 + k.beyond_square) * drag / (p if abs(p) > ZERO_RATE_RAD_S else 1.0)
    rate = -damping * p - stiffness * y + moment - k.quadratic * drag + k.cross_share * x
    by_angle, by_rate, by_cross, by_factor = -stiffness, -damping - k.quadratic * steep, k.cross_share, 0.0
    linear, turn, square = k.cross_damping * factor, k.cross_rate * factor * factor, k.cross_quadratic / floored
    cross = -(linear + square * abs(x)) * x - turn * p + k.cross_fin * fin
    cross_by_rate, cross_by_cross = -turn, -linear - 2.0 * square * abs(x)
    cross_by_factor = -k.cross_damping * x - 2.0 * factor * k.cross_rate * p + square / floored * x * abs(x)
    sine, cosine, arc, by_turn = 0.0, 1.0, 0.0, 0.0
    if kinds.turning:
        z = y - k.heading_turn * clock
        sine, cosine = sin(z), cos(z)
        arc, sine2, cosine2 = z - sine, 2.0 * sine * cosine, 1.0 - 2.0 * sine * sine
        rate += k.heading_sin * sine + k.heading_cos * cosine + k.heading_sin2 * sine2 + k.heading_cos2 * cosine2
        rate += k.righting_sin * arc + k.righting_cos * (cosine - 1.0)
        tilt = k.heading_sin * cosine - k.heading_cos * sine + 2.0 * (k.heading_sin2 * cosine2 - k.heading_cos2 * sine2)
        tilt += k.righting_sin * (1.0 - cosine) - k.righting_cos * sine
        by_angle += tilt
        by_turn = -tilt * clock
    turned, force, turned_by_flow, force_by_flow = 0.0, 0.0, 0.0, 0.0
    if kinds.stripped:
        alpha = k.strip_flow * x / floored
        turned, turned_by_alpha, turned_by_rate = crossflow(alpha, p)
        force, force_by_alpha, force_by_rate = crossforce(alpha, p)
        pull, along = k.strip_force * factor, k.strip_flow / floored
        rate -= k.strip_moment * turned
        cross -= pull * force
        by_rate -= k.strip_moment * turned_by_rate
        by_cross -= k.strip_moment * turned_by_alpha * along
        by_factor = k.strip_moment * turned_by_alpha * alpha / floored
        cross_by_rate -= pull * force_by_rate
        cross_by_cross -= pull * force_by_alpha * along
        cross_by_factor -= k.strip_force * (force - factor * force_by_alpha * alpha / floored)
        turned_by_flow, force_by_flow = k.strip_moment * turned_by_alpha * x / floored, pull * force_by_alpha * x / floored
        force *= factor
    return Slope(
        rate, cross, by_angle, by_rate, by_cross, by_factor, cross_by_rate, cross_by_cross, cross_by_factor, drag,
        log_rate, sine, cosine, arc, by_turn, turned, force, turned_by_flow, force_by_flow,
    )  # fmt: skip


@inlined
def by_constants(
    k: Core, kinds: Kinds, now: Slope, fin: float, factor: float, p: float, x: float, stage: int, of_rate: FloatArray,
    of_cross: FloatArray,
) -> None:  # fmt: skip
    """Fill column `stage` of of_rate and of_cross (C, 4) with the non-zero derivatives of p' and x' by the constants."""
    of_rate[QUADRATIC, stage] = -now.drag
    of_rate[CROSS_SHARE, stage] = x
    of_cross[CROSS_DAMPING, stage] = -factor * x
    of_cross[CROSS_RATE, stage] = -factor * factor * p
    of_cross[CROSS_QUADRATIC, stage] = -x * abs(x) / max(factor, SMALLEST_SPEED_RATIO)
    of_cross[CROSS_FIN, stage] = fin
    if kinds.raised:
        of_rate[BEYOND_SQUARE, stage] = -k.quadratic * now.log_rate * now.drag
    if kinds.turning:
        of_rate[HEADING_SIN, stage], of_rate[HEADING_COS, stage] = now.sin, now.cos
        of_rate[HEADING_SIN2, stage], of_rate[HEADING_COS2, stage] = 2.0 * now.sin * now.cos, 1.0 - 2.0 * now.sin * now.sin
        of_rate[RIGHTING_SIN, stage], of_rate[RIGHTING_COS, stage] = now.arc, now.cos - 1.0
        of_rate[HEADING_TURN, stage] = now.by_turn
    if kinds.stripped:
        of_rate[STRIP_MOMENT, stage], of_cross[STRIP_FORCE, stage] = -now.moment, -now.force
        of_rate[STRIP_FLOW, stage], of_cross[STRIP_FLOW, stage] = -now.moment_by_flow, -now.force_by_flow


@inner
def surge_slope(u: float, straight: float, drag: float, fin_loss: float, turn_loss: float, fin: float, rate: float) -> float:
    """Return u' = drag (straight^2 - u^2 (1 + fin_loss delta^2) - turn_loss r^2).

    The thrust is the one that holds the speed `straight` (m/s) on a straight run; drag in 1/m, turn_loss in m^2.
    """
    return drag * (straight * straight - u * u * (1.0 + fin_loss * fin * fin) - turn_loss * rate * rate)


@inner
def power(ratio: float, exponent: float) -> float:
    """Return ratio^exponent, the usual exponents 0, 1 and 2 by products: they take a tenth of the time of a power."""
    return 1.0 if exponent == 0.0 else ratio if exponent == 1.0 else ratio * ratio if exponent == 2.0 else ratio**exponent


@inner
def core_at(core: FloatArray, powers: FloatArray, ratio: float, out: FloatArray) -> None:
    """Fill out (C,) with the constants at `ratio` times the speed that `core` (C,) holds at: core_j ratio^powers_j."""
    for j in range(core.shape[0]):
        out[j] = core[j] * power(ratio, powers[j]) if core[j] != 0.0 else 0.0


@inlined
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


@inlined
def crossforce(alpha: float, p: float) -> tuple[float, float, float]:
    """Return G(alpha, p) and its derivatives by alpha and by p, from the closed form of the integral."""
    if abs(alpha) >= 0.5 * abs(p):
        s = 1.0 if alpha >= 0.0 else -1.0
        return s * (alpha * alpha + p * p / 12.0), 2.0 * abs(alpha), s * p / 6.0
    s, ratio = (1.0 if p >= 0.0 else -1.0), alpha / p
    cube = 2.0 / 3.0 * alpha * ratio
    return s * (0.5 * alpha * p + cube * alpha), s * (0.5 * p + 3.0 * cube), s * (0.5 * alpha - cube * ratio)


@inlined
def power_drag(p: float, beyond: float) -> tuple[float, float]:
    """Return p|p| (|p|/0.2)^beyond and its logarithmic derivative by `beyond`, log(|p|/0.2); both are zero at rest."""
    if abs(p) < ZERO_RATE_RAD_S:
        return 0.0, 0.0
    size = log(abs(p) / REFERENCE_RATE_RAD_S)
    return p * abs(p) * exp(beyond * size), size
