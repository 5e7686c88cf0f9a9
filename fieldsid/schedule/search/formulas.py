"""Gains of a chosen controller by formula, with two free numbers: a share of a bandwidth and a multiple of the damping.

Yaw P is the paper's: kp = a22^2 / (4 zeta^2 b2) gives the poles the damping zeta; with lag or delay of the fin or a sway state it
is the largest gain whose poles have that damping, which is the same number without these. PD: poles at a bandwidth and damping.
PI, PID: with an integral added. LQR: Bryson's weights, solved in closed form (Kwakernaak and Sivan 1972, Linear Optimal Control
Systems).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from fieldsid.schedule.controller import Gains, margins
from fieldsid.schedule.linear_plant import LinearPlant
from fieldsid.schedule.wish import Wish

INTEGRAL_SHARE = 0.1
"""Corner frequency of the integral over the crossover of the proportional loop: a tenth costs six degrees of phase."""
LEAST_STIFF = 1e-6
"""Least stiffness of the closed loop over that of the full fin, for a hull that the full fin hardly stabilises."""
Formula = Callable[[float, float], Gains]
"""The gains for a share of the bandwidth that uses the allowed fin, and a multiple of the required damping."""


def formula_of(plant: LinearPlant, wish: Wish, fin: float) -> Formula:
    """Return the formula of a wish's controller for a plant's estimate; the step may use `fin` rad of the fin."""
    return _FORMULAS[wish.kind](plant.one(), wish, fin)


def fin_bandwidth(plant: LinearPlant, fin: float, error: float) -> float:
    """Return the bandwidth (rad/s) at which the formula's gain uses a fin angle (rad) at an error (rad)."""
    most = abs(float(plant.slow_authority[0])) * fin / error
    return float(np.sqrt(max(most + min(float(plant.stiffness[0]), most), LEAST_STIFF * most)))


def bandwidth_of(plant: LinearPlant, gains: Gains) -> float:
    """Return the bandwidth (rad/s) for which the formula gives these gains at a plant: the inverse of the formula."""
    return fin_bandwidth(plant, abs(gains.kp), 1.0)


def _proportional(plant: LinearPlant, wish: Wish, fin: float) -> Formula:
    a, k, b = float(plant.slow_damping[0]), float(plant.stiffness[0]), float(plant.slow_authority[0])
    wished = (a * a / (4.0 * wish.damped**2) - k) / b
    if k > 0 and wished * b <= 0:
        wished = 0.5 * k / b  # the stiffness alone is underdamped and any gain lowers the damping: a modest gain, within margins
    most = min(abs(wished), fin / wish.step_of(plant.axis)) * float(np.sign(wished))
    return lambda share, _: Gains(most * share**2)


def _rate(plant: LinearPlant, wish: Wish, fin: float) -> Formula:
    a, k, b = float(plant.slow_damping[0]), float(plant.stiffness[0]), float(plant.slow_authority[0])
    omega = fin_bandwidth(plant, fin, wish.step_of(plant.axis))

    def gains(share: float, more: float) -> Gains:
        w = omega * share
        return Gains(kp=(w * w - min(k, 0.5 * w * w)) / b, kd=max(2.0 * wish.damped * more * w - a, 0.0) / b + 0.0)

    return gains


def _with_integral(trial: Formula, plant: LinearPlant) -> Formula:
    def gains(share: float, more: float) -> Gains:
        base = trial(share, more)
        crossover = float(np.nan_to_num(margins(plant, base).crossover[0]))
        return Gains(base.kp, base.kp * INTEGRAL_SHARE * max(crossover, 1e-3), base.kd)

    return gains


def _quadratic(plant: LinearPlant, wish: Wish, fin: float) -> Formula:
    """Return the gains that minimise the integral of (share^2 angle/step)^2 + (fin angle/fin)^2, by the symmetric root locus."""
    a, k, b = float(plant.slow_damping[0]), float(plant.stiffness[0]), float(plant.slow_authority[0])
    most = b * fin / wish.step_of(plant.axis)

    def gains(share: float, _: float) -> Gains:
        stiff = float(np.hypot(k, most * share**2))
        return Gains(kp=(stiff - k) / b, kd=(float(np.sqrt(a * a - 2.0 * k + 2.0 * stiff)) - a) / b)

    return gains


_FORMULAS: Mapping[str, Callable[[LinearPlant, Wish, float], Formula]] = MappingProxyType(
    {
        "p": _proportional,
        "pd": _rate,
        "pi": lambda plant, wish, fin: _with_integral(_proportional(plant, wish, fin), plant),
        "pid": lambda plant, wish, fin: _with_integral(_rate(plant, wish, fin), plant),
        "lqr": _quadratic,
    }
)
