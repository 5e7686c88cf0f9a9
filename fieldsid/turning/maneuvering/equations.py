"""Surge, sway and yaw of a hull with a stern rudder, in dimensionless coefficients, compiled.

    u' = (D (s^2 (1 + t (1 - u/s)) - u^2) + X0 U (s - u) - M R w^2 f(alpha) sin(delta)) / L + M v r + X L r^2
    v' = (-(Yv u + Y0 U) v - Yr L u r - C J0 + R w^2 f(alpha) cos(delta)) / L
    r' = (-Nv u v - (Nr u + N0 U) L r - b C J1 + a R w^2 f(alpha) cos(delta)) / (k L^2)
    Jn = int_{-1/2}^{1/2} h(x) (v + x L r)|v + x L r| x^n dx,   h = sqrt(1 - |2 x|^3)
    alpha = delta + d0 - atan((v + a L r)/u),  w^2 = u^2 + (v + a L r)^2,  f(alpha) = alpha / (1 + (alpha/c)^4)^(1/4)
(Yv u + Y0 U) is at least zero; s is the speed of the straight run at this thrust, t the slope of the thrust over speed, L the
length, U = 1.5 m/s; R is proportional to (s/U)^e; f is the lift with a stall at the angle c.
Source: Fossen 2011, sections 6.4, 6.5 and 9.4; cross-flow drag as in Faltinsen 1990, chapter 6.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from fieldsid.numerics.arrays import FloatArray
from fieldsid.numerics.jit import inner, jit
from fieldsid.plant.yaw_plant import LEAST_SURGE_M_S, STEP_S
from fieldsid.records.check import LARGEST_SPEED_M_S

NAMES = (
    "length", "drag", "sway_surge", "thrust_slope", "rudder", "rudder_arm", "gyration", "sway_lift", "sway_rate",
    "yaw_lift", "yaw_rate", "cross_drag", "stall", "rudder_offset", "lag", "rate_surge", "rate_limit",
    "wash", "sway_viscous", "yaw_viscous", "yaw_drag", "surge_viscous",
)  # fmt: skip
"""In order: L, D, M, t, R, a, k, Yv, Yr, Nv, Nr, C, c, d0, servo lag (s), X, servo rate limit (rad/s), e, Y0, N0, b, X0."""
LOGARITHMS = {
    "length", "drag", "rudder", "gyration", "cross_drag", "stall", "lag", "rate_limit", "yaw_drag",
    "sway_viscous", "yaw_viscous", "surge_viscous",
}  # fmt: skip
IN_LOGARITHM = np.array([n in LOGARITHMS for n in NAMES])
REFERENCE_SPEED_M_S = 1.5
LENGTHS_A_STEP = 1.0 / 24.0
"""Longest time step, over the time in which the hull travels its length: the product with its eigenvalues is below a fifth."""
STATIONS = np.linspace(-0.45, 0.45, 10)
HEIGHTS = 0.1 * np.sqrt(1.0 - np.abs(2.0 * STATIONS) ** 3)
SUMS = np.concatenate([np.zeros((1, 4)), np.cumsum(HEIGHTS[:, None] * STATIONS[:, None] ** np.arange(4), axis=0)])
"""Sums of h x^n over the first 0 to 10 stations, (11, 4): the cross flow changes its sign at most once along the hull."""
FIRST_STATION, STATION_STEP = float(STATIONS[0]), float(STATIONS[1] - STATIONS[0])
OFFSET = NAMES.index("rudder_offset")
DIFFERENCE = 1e-5
"""Width of the central differences, relative to speed and speed over length, and in rad; truncation error below 1e-10."""


@inner
def crossflow(v: float, w: float) -> tuple[float, float]:
    """Return the strip sums J0 and J1, sum h x^n (v + x w)|v + x w|, for w = L r."""
    last = SUMS.shape[0] - 1
    below = 0
    sign = 1.0 if v > 0.0 else -1.0
    if w != 0.0:
        sign = 1.0 if w > 0.0 else -1.0
        place = (-v / w - FIRST_STATION) / STATION_STEP
        below = min(max(math.ceil(min(max(-1.0, place), last + 1.0)), 0), last)
    a0, a1 = SUMS[last, 0] - 2.0 * SUMS[below, 0], SUMS[last, 1] - 2.0 * SUMS[below, 1]
    a2, a3 = SUMS[last, 2] - 2.0 * SUMS[below, 2], SUMS[last, 3] - 2.0 * SUMS[below, 3]
    return sign * (v * v * a0 + 2.0 * v * w * a1 + w * w * a2), sign * (v * v * a1 + 2.0 * v * w * a2 + w * w * a3)


@inner
def slope(
    u: float, v: float, r: float, delta: float, push: float, straight: float, lift: float, p: FloatArray
) -> tuple[float, float, float]:
    """Return u', v' and r'; push: thrust over that of the straight run; straight: s; lift: R of `rudder_lift`; p (22,)."""
    length = p[0]
    surge = max(u, LEAST_SURGE_M_S)
    j0, j1 = crossflow(v, length * r)
    side = v + p[5] * length * r
    alpha = delta + p[13] - math.atan(side / surge)
    ratio = (alpha / p[12]) ** 2
    force = lift * (surge * surge + side * side) * alpha / math.sqrt(math.sqrt(1.0 + ratio * ratio))
    cosine = force * math.cos(delta)
    thrust = push * straight * straight * (1.0 + p[3] * (1.0 - u / straight))
    viscous = p[21] / length * REFERENCE_SPEED_M_S * (straight - u)
    du = (
        p[1] / length * (thrust - u * abs(u))
        + viscous
        + p[2] * v * r
        + p[15] * length * r * r
        - p[2] * force * math.sin(delta) / length
    )
    # damping dissipates: the linear sway damping is not negative (Fossen 2011, property 6.3)
    linear_sway, linear_yaw = max(p[7] * surge + p[18] * REFERENCE_SPEED_M_S, 0.0), p[10] * surge + p[19] * REFERENCE_SPEED_M_S
    dv = (-linear_sway * v - p[8] * length * surge * r - p[11] * j0 + cosine) / length
    moment = -p[9] * surge * v - linear_yaw * length * r - p[20] * p[11] * j1 + p[5] * cosine
    dr = moment / (p[6] * length * length)
    return du, dv, dr


@inner
def rudder_lift(p: FloatArray, straight: float) -> float:
    """Return R at the speed s = `straight` (m/s) of the straight run."""
    return float(p[4] * (straight / REFERENCE_SPEED_M_S) ** p[17])


@inner
def servo(angle: float, command: float, share: float, most: float) -> float:
    """Return the fin angle after it has gone a share of the way to its command, by `most` rad at most."""
    return angle + min(max((command - angle) * share, -most), most)


@inner
def midpoint_step(
    u: float, v: float, r: float, fins: tuple[float, float], push: float, straight: float, lift: float, p: FloatArray, h: float,
    moment: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return u, v and r after a step of h s by the midpoint rule, and r at its middle.

    fins are the fin angles (rad) at the start and the middle, `moment` (rad/s^2) is a disturbance.
    """
    du, dv, dr = slope(u, v, r, fins[0], push, straight, lift, p)
    middle = r + 0.5 * h * (dr + moment)
    du, dv, dr = slope(u + 0.5 * h * du, v + 0.5 * h * dv, middle, fins[1], push, straight, lift, p)
    return max(u + h * du, LEAST_SURGE_M_S), v + h * dv, r + h * (dr + moment), middle


@jit
def simulate(
    p: FloatArray,
    straight: float,
    first: FloatArray,
    begins: npt.NDArray[np.int64],
    time: FloatArray,
    fin: FloatArray,
    thrust: FloatArray,
    longest: float,
) -> FloatArray:
    """Return surge, sway, rate and heading (4, n) of a run in segments that begin at samples `begins` with states first (m, 3).

    fin (n-1, 2), rad, is the command at the start and end of each interval, ahead of the servo; thrust (n,) is relative to the
    straight run; `longest` is the longest time step in s (`longest_step`).
    """
    count = time.size
    out = np.empty((4, count))
    u, v, r, heading = first[0, 0], first[0, 1], first[0, 2], 0.0
    angle = fin[0, 0]
    segment = 0
    lift = rudder_lift(p, straight)
    last, keep, half = 0.0, 0.0, 0.0
    for i in range(count):
        if segment < begins.size and i == begins[segment]:
            u, v, r = first[segment, 0], first[segment, 1], first[segment, 2]
            segment += 1
        out[0, i], out[1, i], out[2, i], out[3, i] = u, v, r, heading
        if i == count - 1:
            break
        interval = time[i + 1] - time[i]
        pieces = max(math.ceil(interval / longest - 1e-6), 1)
        h = interval / pieces
        if h != last:
            last, keep, half = h, math.exp(-h / p[14]), math.exp(-0.5 * h / p[14])
        for j in range(pieces):
            command = fin[i, 0] + (fin[i, 1] - fin[i, 0]) * (j + 0.5) / pieces
            fins = angle, servo(angle, command, 1.0 - half, 0.5 * h * p[16])
            push = thrust[i] + (thrust[i + 1] - thrust[i]) * (j + 0.5) / pieces
            u, v, r, middle = midpoint_step(u, v, r, fins, push, straight, lift, p, h, 0.0)
            heading += h * middle
            u = min(u, LARGEST_SPEED_M_S)
            v = min(max(v, -LARGEST_SPEED_M_S), LARGEST_SPEED_M_S)
            r = min(max(r, -LARGEST_SPEED_M_S), LARGEST_SPEED_M_S)
            angle = servo(angle, command, 1.0 - keep, h * p[16])
    return out


@jit
def settle(p: FloatArray, straight: float, fin: float) -> FloatArray:
    """Return surge, sway and rate (3,) of the steady circle after a straight run with the rudder at `fin` rad.

    NaN where the rate has not settled after 400 lengths; settled is a range below a thousandth of it over 40 lengths.
    """
    h = 0.1 * p[0] / straight
    lift = rudder_lift(p, straight)
    u, v, r = straight, 0.0, 0.0
    low, high = 1e9, -1e9
    block = 400
    for i in range(1, 10 * block + 1):
        u, v, r, _ = midpoint_step(u, v, r, (fin, fin), 1.0, straight, lift, p, h, 0.0)
        if not (abs(v) < LARGEST_SPEED_M_S and abs(r) < LARGEST_SPEED_M_S):
            break
        low, high = min(low, r), max(high, r)
        if i % block == 0:
            if high - low < 1e-3 * abs(r) and u > LEAST_SURGE_M_S:
                return np.array([u, v, r])
            low, high = 1e9, -1e9
    return np.full(3, np.nan)


def longest_step(length: float, speed: float) -> float:
    """Return the longest time step (s) for a hull of a length (m) at a speed (m/s); STEP_S suffices for any."""
    return max(LENGTHS_A_STEP * length / speed, STEP_S)


def coefficients(theta: FloatArray) -> FloatArray:
    """Return the coefficients (22,) of a vector theta (22,), which has the positive ones as logarithms."""
    return np.where(IN_LOGARITHM, np.exp(np.where(IN_LOGARITHM, theta, 0.0)), theta)


@jit
def about_straight(hulls: FloatArray, speed: float) -> FloatArray:
    """Return the derivatives (d, 2, 3) of v' and r' by v, r and delta on a straight run at a speed in m/s, for hulls (d, 22).

    By central differences of `slope`, extrapolated from two widths because the cross-flow drag is proportional to v|v|.
    """
    out = np.zeros((hulls.shape[0], 2, 3))
    for i in range(hulls.shape[0]):
        p = hulls[i].copy()
        p[OFFSET] = 0.0
        lift, length = rudder_lift(p, speed), p[0]
        for column in range(3):
            unit = speed if column == 0 else speed / length if column == 1 else 1.0
            for weight, width in ((4.0, 0.5 * DIFFERENCE * unit), (-1.0, DIFFERENCE * unit)):
                v, r, delta = width * (column == 0), width * (column == 1), width * (column == 2)
                _, dv, dr = slope(speed, v, r, delta, 1.0, speed, lift, p)
                _, before_v, before_r = slope(speed, -v, -r, -delta, 1.0, speed, lift, p)
                out[i, 0, column] += weight * (dv - before_v) / (2.0 * DIFFERENCE * unit)
                out[i, 1, column] += weight * (dr - before_r) / (2.0 * DIFFERENCE * unit)
    return out


def growth_rate(p: FloatArray, speed: float) -> float:
    """Return the largest real part (1/s) of the eigenvalues of sway and yaw on a straight run at a speed in m/s."""
    return float(np.max(np.linalg.eigvals(about_straight(p[None], speed)[0, :, :2]).real))
