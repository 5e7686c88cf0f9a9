"""Gains at one speed for a chosen controller: by formula, then slowed until damping and phase margin are what was asked.

Yaw P is the paper's: kp = a22^2 / (4 zeta^2 b2) puts the poles at damping zeta; with a fin's lag, delay or a sway state it is
found as the largest gain whose poles keep that damping, which is the same number where there are none. Feed-forward is
-delta_r0 (-delta_s0 in pitch, plus c23/d2 of the pitch reference). LQR: Bryson's weights.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from scipy.linalg import solve_continuous_are

from fieldsid.errors import ModelError, UsageError
from fieldsid.registry import near
from fieldsid.schedule.controller import KINDS, Gains, least_damping
from fieldsid.schedule.linear_plant import LinearPlant
from fieldsid.schedule.margins import margins

INTEGRAL_SHARE = 0.1
"""Integral corner over the proportional loop's crossover: a tenth costs six degrees of phase."""
SLOWDOWN_FACTOR = 0.93
MAX_SLOWDOWNS = 160
PROPORTIONAL = ("p", "pi")
DesignAttempt = Callable[[float], Gains]
DEPTH_SEPARATION = 5.0
"""How much slower the depth loop is than the pitch loop under it."""


@dataclass(frozen=True, slots=True)
class Wish:
    """What is asked of the loop: controller kind, damping ratio, phase margin deg, largest error met without saturation rad."""

    kind: str = "p"
    damping: float = 0.7071
    phase_margin_deg: float = 45.0
    largest_error: float = 0.35
    bandwidth: float | None = None


@dataclass(frozen=True, slots=True)
class Designed:
    """Gains at the estimate; the loop's crossover rad/s; by how much lag and delay slowed them (1: not at all)."""

    gains: Gains
    crossover: float
    slowed: float
    reference_gain: float
    depth_gain: float


def check_wish(wish: Wish) -> None:
    """Raise UsageError for a controller, damping or margin that cannot be meant."""
    if wish.kind not in KINDS:
        raise UsageError(f"there is no controller {wish.kind!r}", found=", ".join(KINDS), hint=near(wish.kind, list(KINDS)))
    if not 0.1 <= wish.damping <= 3.0:
        raise UsageError(
            "the damping ratio must lie in 0.1 .. 3", found=f"{wish.damping:g}", hint="`--damping 0.7` overshoots by 5 %"
        )
    if not 10.0 <= wish.phase_margin_deg <= 80.0:
        hint = "`--phase-margin 45` is usual"
        raise UsageError("the phase margin must lie in 10 .. 80 deg", found=f"{wish.phase_margin_deg:g}", hint=hint)


def design_gains(plant: LinearPlant, wish: Wish, fin_limit: float) -> Designed:
    """Return the gains of one speed; raises ModelError when no gain keeps the loop damped."""
    one = plant.one()  # the loop is designed at zero trim
    if wish.kind in PROPORTIONAL and _slow_damping(one) <= 0:
        raise ModelError(
            f"the plant is unstable at {plant.speed:.3g} m/s, and a proportional gain alone cannot hold it",
            found=f"damping {_slow_damping(one):.3g} 1/s",
            hint=_remedy(one, wish, fin_limit),
        )
    trial = _DESIGN_ATTEMPTS[wish.kind](one, wish, fin_limit)
    factor = _fastest(one, trial, wish)
    if factor is None:
        raise ModelError(
            f"no {wish.kind} gain keeps damping {wish.damping:g} and {wish.phase_margin_deg:g} deg at {plant.speed:.3g} m/s",
            found=f"damping {one.damping[0]:.3g} 1/s, fin lag {one.lag[0]:.3g} s, delay {one.delay[0]:.3g} s",
            hint=_remedy(one, wish, fin_limit),
        )
    gains = trial(factor)
    if factor < 1.0:
        factor = _refined(one, trial, wish, factor)
        gains = trial(factor)
    crossover = float(np.nan_to_num(margins(one, gains).crossover[0]))
    authority = _static(one)
    reference = float(one.stiffness[0]) / authority
    return Designed(gains, crossover, factor, reference, crossover / (DEPTH_SEPARATION * plant.speed))


def _fastest(plant: LinearPlant, trial: DesignAttempt, wish: Wish) -> float | None:
    """Return the share of the wished speed of the loop that serves, found by slowing it; None where none does."""
    factors = SLOWDOWN_FACTOR ** np.arange(MAX_SLOWDOWNS)
    return next((float(f) for f in factors if _good(plant, trial(float(f)), wish)), None)


def _remedy(plant: LinearPlant, wish: Wish, fin_limit: float) -> str:
    """Return the option with which a gain is found at this speed after all; nothing where none of the usual ones does."""
    others = {
        **{f"--controller {kind}": replace(wish, kind=kind) for kind in ("pd", "pid", "lqr") if kind != wish.kind},
        **{f"--damping {d:g}": replace(wish, damping=d) for d in (0.5, 0.3) if d < wish.damping},
        **{f"--phase-margin {p:g}": replace(wish, phase_margin_deg=p) for p in (30.0, 20.0) if p < wish.phase_margin_deg},
    }
    for option, other in others.items():
        if other.kind in PROPORTIONAL and _slow_damping(plant) <= 0:
            continue
        if _fastest(plant, _DESIGN_ATTEMPTS[other.kind](plant, other, fin_limit), other) is not None:
            return f"at this speed there is one with `{option}`"
    return ""


def _good(plant: LinearPlant, gains: Gains, wish: Wish) -> bool:
    # two digits less than asked: a formula that meets the damping exactly must not fail by rounding
    return least_damping(plant, gains) >= _damping_floor(wish) - 1e-6 and _phase(plant, gains) >= wish.phase_margin_deg - 1e-6


def _damping_floor(wish: Wish) -> float:
    """Poles other than the designed pair (an integrator's, the fin's) may be a little less damped, never below half."""
    return wish.damping if wish.kind == "p" and wish.damping < 1.0 else min(wish.damping, 1.0) * 0.8


def _phase(plant: LinearPlant, gains: Gains) -> float:
    return float(margins(plant, gains).phase_deg[0])


def _refined(plant: LinearPlant, trial: DesignAttempt, wish: Wish, good: float) -> float:
    """Return the fastest loop between a good factor and the last bad one, by halving."""
    bad = good / SLOWDOWN_FACTOR
    for _ in range(20):
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if _good(plant, trial(middle), wish) else (good, middle)
    return good


def _static(plant: LinearPlant) -> float:
    """Return the authority as the slow loop feels it: the fin's own and that through sway or heave."""
    return float(plant.authority[0] + plant.cross_fin[0] / plant.cross_damping[0])


def _slow_damping(plant: LinearPlant) -> float:
    return float(plant.damping[0] + plant.cross_rate[0] / plant.cross_damping[0])


def _proportional(plant: LinearPlant, wish: Wish, fin_limit: float) -> DesignAttempt:
    a, k, b = _slow_damping(plant), float(plant.stiffness[0]), _static(plant)
    wished = (a * a / (4.0 * wish.damping**2) - k) / b
    if k > 0 and wished * b <= 0:
        wished = 0.5 * k / b  # stiff already beyond the wished damping: any gain lowers it, a modest one is left to the margins
    return lambda factor: Gains(wished * factor)


def _rate(plant: LinearPlant, wish: Wish, fin_limit: float) -> DesignAttempt:
    a, k, b = _slow_damping(plant), float(plant.stiffness[0]), _static(plant)
    # full fin at the largest error: faster would only saturate
    fastest = np.sqrt(max(k, 0.0) + abs(b) * fin_limit / wish.largest_error)
    omega = wish.bandwidth if wish.bandwidth is not None else float(fastest)

    def gains(factor: float) -> Gains:
        w = omega * factor
        return Gains(kp=(w * w - min(k, 0.5 * w * w)) / b, kd=max(2.0 * wish.damping * w - a, 0.0) / b)

    return gains


def _with_integral(trial: DesignAttempt, plant: LinearPlant) -> DesignAttempt:
    def gains(factor: float) -> Gains:
        base = trial(factor)
        crossover = float(np.nan_to_num(margins(plant, base).crossover[0]))
        return Gains(base.kp, base.kp * INTEGRAL_SHARE * max(crossover, 1e-3), base.kd)

    return gains


def _quadratic(plant: LinearPlant, wish: Wish, fin_limit: float) -> DesignAttempt:
    a, k, b = _slow_damping(plant), float(plant.stiffness[0]), _static(plant)
    system, drive = np.array([[0.0, 1.0], [-k, -a]]), np.array([[0.0], [b]])

    def gains(factor: float) -> Gains:
        weight = np.diag([(factor**2 / wish.largest_error) ** 2, 0.0])
        cost = np.array([[1.0 / fin_limit**2]])
        gain = np.linalg.solve(cost, drive.T @ solve_continuous_are(system, drive, weight + 1e-12 * np.eye(2), cost))
        return Gains(kp=float(gain[0, 0]), kd=float(gain[0, 1]))

    return gains


_DESIGN_ATTEMPTS: Mapping[str, Callable[[LinearPlant, Wish, float], DesignAttempt]] = MappingProxyType(
    {
        "p": _proportional,
        "pd": _rate,
        "pi": lambda plant, wish, limit: _with_integral(_proportional(plant, wish, limit), plant),
        "pid": lambda plant, wish, limit: _with_integral(_rate(plant, wish, limit), plant),
        "lqr": _quadratic,
    }
)
