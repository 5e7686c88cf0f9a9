"""Gains at one speed for a chosen controller: by formula, with the bandwidth and damping that `optimum` finds.

The estimate has the damping and phase margin asked; 95 % of the draws of its errors leave half of the margin and fly the step,
with the fin's limits, the speed lost in the turn and the drag of the turning hull. P and PI are as fast as that lets them.

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
from fieldsid.models.axis import Axis
from fieldsid.registry import near
from fieldsid.schedule.controller import KINDS, Gains
from fieldsid.schedule.flown.pace import full_bandwidth, pace_of
from fieldsid.schedule.linear_plant import LinearPlant
from fieldsid.schedule.margins import FREQUENCY_GRID_RAD_S, HELD_SHARE, margins, worst_of
from fieldsid.schedule.optimum import (
    DRAWS_MARGIN_SHARE,
    LACK_ROUNDING,
    Demand,
    Found,
    fastest_gains,
    flown,
    soonest_gains,
)

INTEGRAL_SHARE = 0.1
"""Integral corner over the proportional loop's crossover: a tenth costs six degrees of phase."""
LEAST_HELD = 0.5
"""P and PI that hold fewer of the draws are refused: no proportional gain holds an unstable hull."""
FLOWN_TIMES, LEAST_SHARE = 25.0, 1.0 / 3.0
"""A step is flown for so many times 1/bandwidth of the full fin: within this share of what its pace has and all of that."""
PROPORTIONAL, RATE_FED = ("p", "pi"), ("pd", "pid")
MOST_DAMPING = 3.0
DesignAttempt = Callable[[float, float], Gains]
"""Gains of a share of the fastest bandwidth and a multiple of the wished damping."""
DEPTH_PHASE_MARGIN_DEG = 60.0
"""Phase margin of the depth loop around the pitch loop: no overshoot to speak of beside what the pitch limit does."""


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
    """Gains; the loop's crossover rad/s; by how much lag, delay and the draws slowed them (1: not at all).

    `held` is the share of the draws that come to rest from the step, `settling` (s) how long 95 % of them take.
    """

    gains: Gains
    crossover: float
    slowed: float
    reference_gain: float
    depth_gain: float
    held: float
    settling: float


def check_wish(wish: Wish) -> None:
    """Raise UsageError for a controller, damping or margin that cannot be meant."""
    if wish.kind not in KINDS:
        raise UsageError(f"there is no controller {wish.kind!r}", found=", ".join(KINDS), hint=near(wish.kind, list(KINDS)))
    if not 0.1 <= wish.damping <= MOST_DAMPING:
        raise UsageError(
            "the damping ratio must lie in 0.1 .. 3", found=f"{wish.damping:g}", hint="`--damping 0.7` overshoots by 5 %"
        )
    if not 10.0 <= wish.phase_margin_deg <= 80.0:
        hint = "`--phase-margin 45deg` is usual"
        raise UsageError("the phase margin must lie in 10 .. 80 deg", found=f"{wish.phase_margin_deg:g}", hint=hint)


def design_gains(plant: LinearPlant, wish: Wish, fin_limit: float) -> Designed:
    """Return the gains of one speed that serve most of a plant's draws; raises ModelError where the estimate is not served.

    P and PI that serve fewer than half of the draws are refused as well; with a rate, where no gains serve as many draws as they
    have to, they are the estimate's, and `held` says of how few: half-way between serves neither.
    """
    one, family = plant.one(), plant.distinct()
    if wish.kind in PROPORTIONAL and one.slow_damping[0] <= 0:
        raise _unstable(family, wish, fin_limit)
    found, demand = _found(family, wish, fin_limit), _demand(family, wish, fin_limit)
    if found is None:
        raise _refusal(family, wish, fin_limit)
    did = flown(family, found.gains, demand)
    if did.held < HELD_SHARE and (alone := _found(one, wish, fin_limit)) is not None:
        found, did = alone, flown(family, alone.gains, demand)
    crossover = float(np.nan_to_num(margins(one, found.gains).crossover[0]))
    depth_gain = _depth_gain(family, found.gains) if plant.axis is Axis.PITCH else 0.0
    return Designed(found.gains, crossover, found.share, _reference_gain(one), depth_gain, did.held, did.settling)


def _overshoot_of(damping: float) -> float:
    """Return the overshoot of a second-order loop; its damping ratio is a hundredth of its phase margin in deg."""
    return 0.0 if damping >= 1.0 else float(np.exp(-np.pi * damping / np.sqrt(1.0 - damping**2)))


def _depth_gain(family: LinearPlant, gains: Gains) -> float:
    """Return the gain from depth to pitch, rad/m: the cascade u k T/s keeps its phase margin with 95 % of the draws.

    T is the closed pitch loop from its reference, so the crossover is where T lags by 90 deg less the margin.
    """
    omega = FREQUENCY_GRID_RAD_S
    asked = gains.kp + gains.ki / (1j * omega) + _reference_gain(family)
    hull = family.response(omega)
    closed = hull * asked[None, :] / (1.0 + hull * gains.response(omega)[None, :])
    phase = np.degrees(np.unwrap(np.angle(closed), axis=1))
    first = np.argmax(phase <= DEPTH_PHASE_MARGIN_DEG - 90.0, axis=1)
    reached = np.take_along_axis(np.abs(closed), first[:, None], axis=1)[:, 0]
    return worst_of(omega[first] / (family.speed * reached), most=False)


def _reference_gain(plant: LinearPlant) -> float:
    return float(plant.stiffness[0]) / float(plant.slow_authority[0])


def _found(family: LinearPlant, wish: Wish, fin_limit: float) -> Found | None:
    """Return the gains of least cost; None where they do not serve the estimate, or with P and PI not half of the draws."""
    demand = _demand(family, wish, fin_limit)
    attempt = _DESIGN_ATTEMPTS[wish.kind](family.one(), wish, fin_limit)
    if wish.kind in PROPORTIONAL:
        found = fastest_gains(family, lambda share: attempt(share, 1.0), demand)
    else:
        most = MOST_DAMPING / wish.damping if wish.kind in RATE_FED else 1.0
        found = soonest_gains(family, attempt, demand, most, bounded=wish.bandwidth is not None)
    if found.own_lack > LACK_ROUNDING:
        return None
    return None if wish.kind in PROPORTIONAL and flown(family, found.gains, demand).held < LEAST_HELD else found


def _demand(family: LinearPlant, wish: Wish, fin_limit: float) -> Demand:
    allowed = _overshoot_of(min(wish.damping, DRAWS_MARGIN_SHARE * wish.phase_margin_deg / 100.0))
    pace = pace_of(family, fin_limit, wish.largest_error)
    wanted = FLOWN_TIMES / max(full_bandwidth(family, fin_limit, wish.largest_error), FLOWN_TIMES / pace.flight)
    pace = replace(pace, flight=max(wanted, LEAST_SHARE * pace.flight))
    return Demand(_damping_floor(wish), wish.phase_margin_deg, wish.largest_error, allowed, fin_limit, pace)


def _unstable(family: LinearPlant, wish: Wish, fin_limit: float) -> ModelError:
    growth = float(family.growth[0])
    grows = f", a deviation doubles every {np.log(2) / growth:.2g} s" if growth > 0 else ""
    return ModelError(
        f"the plant is unstable at {family.speed:.3g} m/s, and a proportional gain alone cannot hold it",
        found=f"damping {family.slow_damping[0]:.3g} 1/s{grows}{_of_draws(family)}",
        hint=_remedy(family, wish, fin_limit),
    )


def _of_draws(family: LinearPlant) -> str:
    unstable = int(np.count_nonzero(family.growth > 0.0))
    return f"; unstable by {unstable} of {family.count} draws of the errors" if unstable and family.count > 1 else ""


def _refusal(family: LinearPlant, wish: Wish, fin_limit: float) -> ModelError:
    one = family.one()
    whom = "" if family.count == 1 or wish.kind not in PROPORTIONAL else " for half of the draws of the models' errors"
    found = f"damping {one.slow_damping[0]:.3g} 1/s, fin lag {one.lag[0]:.3g} s, delay {one.delay[0]:.3g} s"
    hint = _remedy(family, wish, fin_limit)
    return ModelError(
        f"no {wish.kind} gain keeps damping {wish.damping:g} and {wish.phase_margin_deg:g} deg at {family.speed:.3g} m/s{whom}",
        found=f"{found}{_of_draws(family)}",
        hint=hint,
    )


def _remedy(family: LinearPlant, wish: Wish, fin_limit: float) -> str:
    """Return the option with which a gain is found at this speed after all; nothing where none of the usual ones does."""
    others = {
        **{f"--controller {kind}": replace(wish, kind=kind) for kind in ("pd", "pid", "lqr") if kind != wish.kind},
        **{f"--damping {d:g}": replace(wish, damping=d) for d in (0.5, 0.3) if d < wish.damping},
        **{f"--phase-margin {p:g}": replace(wish, phase_margin_deg=p) for p in (30.0, 20.0) if p < wish.phase_margin_deg},
        **{
            f"--controller {k} --damping 0.5 --phase-margin 30": replace(wish, kind=k, damping=0.5, phase_margin_deg=30.0)
            for k in ("pd",)
            if wish.damping > 0.5 and wish.phase_margin_deg > 30.0
        },
    }
    one = family.one()
    for option, other in others.items():
        if other.kind in PROPORTIONAL and one.slow_damping[0] <= 0:
            continue
        if _found(family, other, fin_limit) is not None:
            return f"at this speed there is one with `{option}`"
    return ""


def _damping_floor(wish: Wish) -> float:
    """Poles other than the designed pair (an integrator's, the fin's) may be a little less damped, never below half."""
    return wish.damping if wish.kind == "p" and wish.damping < 1.0 else min(wish.damping, 1.0) * 0.8


def _proportional(plant: LinearPlant, wish: Wish, fin_limit: float) -> DesignAttempt:
    a, k, b = float(plant.slow_damping[0]), float(plant.stiffness[0]), float(plant.slow_authority[0])
    wished = (a * a / (4.0 * wish.damping**2) - k) / b
    if k > 0 and wished * b <= 0:
        wished = 0.5 * k / b  # stiff already beyond the wished damping: any gain lowers it, a modest one is left to the margins
    return lambda share, _: Gains(wished * share)


def _rate(plant: LinearPlant, wish: Wish, fin_limit: float) -> DesignAttempt:
    a, k, b = float(plant.slow_damping[0]), float(plant.stiffness[0]), float(plant.slow_authority[0])
    omega = wish.bandwidth if wish.bandwidth is not None else full_bandwidth(plant, fin_limit, wish.largest_error)

    def gains(share: float, more: float) -> Gains:
        w = omega * share
        return Gains(kp=(w * w - min(k, 0.5 * w * w)) / b, kd=max(2.0 * wish.damping * more * w - a, 0.0) / b)

    return gains


def _with_integral(trial: DesignAttempt, plant: LinearPlant) -> DesignAttempt:
    def gains(share: float, more: float) -> Gains:
        base = trial(share, more)
        crossover = float(np.nan_to_num(margins(plant, base).crossover[0]))
        return Gains(base.kp, base.kp * INTEGRAL_SHARE * max(crossover, 1e-3), base.kd)

    return gains


def _quadratic(plant: LinearPlant, wish: Wish, fin_limit: float) -> DesignAttempt:
    a, k, b = float(plant.slow_damping[0]), float(plant.stiffness[0]), float(plant.slow_authority[0])
    system, drive = np.array([[0.0, 1.0], [-k, -a]]), np.array([[0.0], [b]])

    def gains(share: float, _: float) -> Gains:
        weight = np.diag([(share**2 / wish.largest_error) ** 2, 0.0])
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
