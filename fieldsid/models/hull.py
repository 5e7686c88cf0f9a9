"""The equations of motion of an identified vehicle in one plane: their one right-hand side, its slopes, what each constant moves.

    y' = p
    p' = -a p - k y + m(t) - Q p|p| (|p|/0.2)^o - N F(s x/g, p) + c x
         + hs sin z + hc cos z + hs2 sin 2z + hc2 cos 2z + rs (z - sin z) + rc (cos z - 1)
    z = y - ht (t - the middle of the run)
    x' = -e g x - (D/g) x|x| - f g^2 p - Y g G(s x/g, p) + h d
    F(alpha, p) = 32 int_{-1/2}^{1/2} (alpha + xi p) |alpha + xi p| xi dxi        (F(0, p) = p |p|)
    G(alpha, p) = int_{-1/2}^{1/2} (alpha + xi p) |alpha + xi p| dxi              (G(alpha, 0) = alpha |alpha|)
with y the angle, p the rate, x the cross state (sway or heave, scaled so that its moment is c x), d the fin's angle and g the
speed over the run's own. Free runs, closed loops, settled turns, linear plants and planned flights are all of these equations:
a hydrodynamic term is a field of `Core`, a term of `slope` and its derivative in `by_constants`.
Source: Fossen 2011, sections 6.4.3 (cross-flow drag principle) and 7.1.
"""

from __future__ import annotations

from math import cos, exp, log, sin, sqrt
from operator import add
from typing import NamedTuple

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import inlined, inner

REFERENCE_RATE_RAD_S, ZERO_RATE_RAD_S = 0.2, 1e-9
"""rad/s: the rate at which drag of another power equals the quadratic one, and the one below which it is nil."""
SMALLEST_SPEED_RATIO = 0.01
"""Speed over the run's speed below which the cross state's quadratic drag grows no more: at rest the state means nothing."""


class Core(NamedTuple):
    """The constants of the equations; C of them, zero where an effect is absent, in the order of the arrays (C,) of kernels."""

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
        """Return the sum of two sets of constants; the factors of FACTORS are taken from whichever sets them."""
        factors = {n: (b if (b := getattr(other, n)) != 1.0 else getattr(self, n)) for n in FACTORS}
        return Core._make(map(add, self, other))._replace(**factors)

    def steady_cross_state(self, rate: float) -> float:
        """Return the cross state that a steady rate leads to at the run's own speed, zero where there is none.

        The force along the hull is taken as that of a hull that drifts as fast and does not turn.
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
"""The constants of damping that grows with the rate: it holds a hull that is unstable at small angles."""
OF_ANGLE = (HEADING_SIN, HEADING_COS, RIGHTING_SIN, RIGHTING_COS, HEADING_SIN2, HEADING_COS2, HEADING_TURN)
"""The constants of what goes with the angle itself: they hold for the course of a run, not for a circle or a step from any."""
MULTIPLIERS = (BEYOND_SQUARE, HEADING_TURN, CROSS_SHARE, STRIP_FLOW)
"""The constants that bend no motion by themselves."""
DRIVES = ("damping", "stiffness", "moment_start", "moment_end", "cross_factor", "fin")
"""What is given over each interval: a, k and g held, m straight from its start to its end, d its mean; places by name."""
DAMPING, STIFFNESS, MOMENT_START, MOMENT_END, CROSS_FACTOR, FIN = range(len(DRIVES))


class Kinds(NamedTuple):
    """The kinds of terms that any constant, or any parameter's derivative of one, brings in: the rest need not be computed."""

    turning: bool
    stripped: bool
    raised: bool
    crossing: bool
    bent: bool


class Slope(NamedTuple):
    """p' and x' with their derivatives by y, p, x and g, and what the constants multiply."""

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
    """Return the constants (C,) by name."""
    return Core(
        c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8], c[9], c[10], c[11], c[12], c[13], c[14], c[15], c[16]
    )  # fmt: skip


@inner
def kinds_of(c: FloatArray) -> Kinds:
    """Return the kinds of terms of constants (C,), or of a parameter's derivatives of them."""
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
    """Return the kinds of terms that one or the other brings in."""
    return Kinds(
        one.turning or other.turning, one.stripped or other.stripped, one.raised or other.raised,
        one.crossing or other.crossing, one.bent or other.bent,
    )  # fmt: skip


@inlined
def slope(
    k: Core, kinds: Kinds, damping: float, stiffness: float, moment: float, fin: float, factor: float,
    y: float, p: float, x: float, clock: float,
) -> Slope:  # fmt: skip
    """Return the right-hand side at angle y, rate p and cross state x, `clock` s after the middle of the run, with its slopes."""
    floored = max(factor, SMALLEST_SPEED_RATIO)
    drag, log_rate, steep = p * abs(p), 0.0, 2.0 * abs(p)
    if kinds.raised:
        drag, log_rate = power_drag(p, k.beyond_square)
        steep = (2.0 + k.beyond_square) * drag / (p if abs(p) > ZERO_RATE_RAD_S else 1.0)
    rate = -damping * p - stiffness * y + moment - k.quadratic * drag + k.cross_share * x
    by_angle, by_rate, by_cross, by_factor = -stiffness, -damping - k.quadratic * steep, k.cross_share, 0.0
    held, turn, square = k.cross_damping * factor, k.cross_rate * factor * factor, k.cross_quadratic / floored
    cross = -(held + square * abs(x)) * x - turn * p + k.cross_fin * fin
    cross_by_rate, cross_by_cross = -turn, -held - 2.0 * square * abs(x)
    cross_by_factor = -k.cross_damping * x - 2.0 * factor * k.cross_rate * p + square / floored * x * abs(x)
    sine, cosine, arc, by_turn = 0.0, 1.0, 0.0, 0.0
    if kinds.turning:
        seen = y - k.heading_turn * clock
        sine, cosine = sin(seen), cos(seen)
        arc, sine2, cosine2 = seen - sine, 2.0 * sine * cosine, 1.0 - 2.0 * sine * sine
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
    """Fill column `stage` of of_rate and of_cross (C, 4) with the derivatives of p' and x' by each constant that is not nil."""
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
def surge_slope(u: float, kept: float, drag: float, fin_loss: float, turn_loss: float, fin: float, rate: float) -> float:
    """Return u' of a vehicle whose thrust keeps a speed: drag a_u (1/m), what fin and turn lose over it (1, m^2)."""
    return drag * (kept * kept - u * u * (1.0 + fin_loss * fin * fin) - turn_loss * rate * rate)


@inner
def power(ratio: float, exponent: float) -> float:
    """Return a power: a law's are whole but for a fitted one, and a product takes a tenth of the time."""
    return 1.0 if exponent == 0.0 else ratio if exponent == 1.0 else ratio * ratio if exponent == 2.0 else ratio**exponent


@inner
def core_at(core: FloatArray, powers: FloatArray, ratio: float, out: FloatArray) -> None:
    """Fill out (C,) with the constants at a speed over the one that they are of, each with its power of the speed."""
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
    """Return p|p| (|p|/0.2)^beyond and its logarithmic derivative by `beyond`; both are nil at rest."""
    if abs(p) < ZERO_RATE_RAD_S:
        return 0.0, 0.0
    size = log(abs(p) / REFERENCE_RATE_RAD_S)
    return p * abs(p) * exp(beyond * size), size
