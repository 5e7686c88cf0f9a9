"""Gains at one speed for a chosen controller: by formula, then slowed until damping and phase margin are what was asked.

By the estimate first, then by 95 % of the draws of its errors: each has to leave half of the margin and to fly the step, with the
fin's limits, the speed lost in the turn and the drag of the turning hull. A free bandwidth is the one that settles soonest.

Yaw P is the paper's: kp = a22^2 / (4 zeta^2 b2) puts the poles at damping zeta; with a fin's lag, delay or a sway state it is
found as the largest gain whose poles keep that damping, which is the same number where there are none. Feed-forward is
-delta_r0 (-delta_s0 in pitch, plus c23/d2 of the pitch reference). LQR: Bryson's weights.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from scipy.linalg import solve_continuous_are

from fieldsid.errors import ModelError, UsageError
from fieldsid.models.axis import Axis
from fieldsid.registry import near
from fieldsid.schedule.controller import KINDS, Gains, least_damping
from fieldsid.schedule.flown.response import LIMIT_CYCLE_SHARE, about_rest, overshoot, settling, step_response, swing
from fieldsid.schedule.linear_plant import LinearPlant
from fieldsid.schedule.margins import FREQUENCY_GRID_RAD_S, HELD_SHARE, margins, worst_of
from fieldsid.schedule.record import Row

INTEGRAL_SHARE = 0.1
"""Integral corner over the proportional loop's crossover: a tenth costs six degrees of phase."""
SLOWDOWN_FACTOR = 0.93
MAX_SLOWDOWNS = 160
FAMILY_SLOWDOWN = 0.85
MAX_FAMILY_SLOWDOWNS = 24
MAX_SPEEDUPS = 9
DRAWS_MARGIN_SHARE = 0.5
"""Share of the wished phase margin that a draw of the errors has to leave: the estimate has all of it."""
LEAST_HELD = 0.5
"""P and PI that hold fewer of the draws are refused: no proportional gain holds an unstable hull."""
SOON, FAR = 1.05, 1.5
"""Settling times over the least: of those as good as alike the slowest loop is taken; beyond the second no slower is tried."""
STEP_DURATION_S = 60.0
PROPORTIONAL, RATE_FED = ("p", "pi"), ("pd", "pid")
MOST_DAMPING = 3.0
MORE_DAMPING = (1.0, 1.5, 2.25)
"""Multiples of the wished damping tried in turn: an unstable hull behind a slow fin has its margin from the rate alone."""
DesignAttempt = Callable[[float], Gains]
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
        hint = "`--phase-margin 45` is usual"
        raise UsageError("the phase margin must lie in 10 .. 80 deg", found=f"{wish.phase_margin_deg:g}", hint=hint)


def design_gains(plant: LinearPlant, wish: Wish, fin_limit: float) -> Designed:
    """Return the gains of one speed that serve most of a plant's draws; raises ModelError where the estimate is not served.

    P and PI that serve fewer than half of the draws are refused as well.
    """
    one, family = plant.one(), plant.distinct()
    if wish.kind in PROPORTIONAL and one.slow_damping[0] <= 0:
        raise _unstable(family, wish, fin_limit)
    found = _found(family, wish, fin_limit)
    if found is None:
        raise _refusal(family, wish, fin_limit)
    crossover = float(np.nan_to_num(margins(one, found.gains).crossover[0]))
    depth_gain = _depth_gain(family, found.gains) if plant.axis is Axis.PITCH else 0.0
    return Designed(found.gains, crossover, found.factor, _reference_gain(one), depth_gain, found.held, found.settling)


@dataclass(frozen=True, slots=True)
class _Served:
    """Gains tried on all draws: the share of them with the wished margin that come to rest from the step, and in what time."""

    gains: Gains
    factor: float
    held: float
    settling: float

    @property
    def enough(self) -> bool:
        return self.held >= HELD_SHARE


def _served(family: LinearPlant, gains: Gains, factor: float, wish: Wish, fin_limit: float) -> _Served:
    row = Row(family.speed, gains, -float(family.offset[0]), _reference_gain(family), fin_limit)
    size = wish.largest_error
    steps = step_response(family, row, reference=size, seconds=STEP_DURATION_S)
    moved = about_rest(steps.angle, size)
    most = _overshoot_of(min(wish.damping, DRAWS_MARGIN_SHARE * wish.phase_margin_deg / 100.0))
    rests = (overshoot(moved, size) <= most) & (swing(steps.angle, size) <= LIMIT_CYCLE_SHARE)
    damped = margins(family, gains).phase_deg >= DRAWS_MARGIN_SHARE * wish.phase_margin_deg
    slowest = worst_of(settling(steps.time, moved, size), most=True)
    return _Served(gains, factor, float(np.mean(rests & damped)), slowest)


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


def _found(family: LinearPlant, wish: Wish, fin_limit: float) -> _Served | None:
    """Return the best gains of a controller, with the wished damping or, where that serves more or settles sooner, with more."""
    best: _Served | None = None
    for share in MORE_DAMPING if wish.kind in RATE_FED else (1.0,):
        more = replace(wish, damping=min(wish.damping * share, MOST_DAMPING))
        now = _best(family, _DESIGN_ATTEMPTS[wish.kind](family.one(), more, fin_limit), wish, fin_limit)
        if now is None or (best is not None and best.enough and now.settling * SOON > best.settling):
            continue
        best = now if best is None or now.enough or now.held > best.held else best
    return best


def _best(family: LinearPlant, trial: DesignAttempt, wish: Wish, fin_limit: float) -> _Served | None:
    """Return the gains that serve 95 % of the draws, or else most of them; None where not even the estimate is served.

    P and PI are as fast as the damping lets them; a free bandwidth is the slowest of those that settle soonest. Only where
    slower loops hold nothing, as with an unstable hull, are faster ones tried than use the whole fin at the largest error.
    """
    first = _fastest(family.one(), trial, wish)
    tried: list[_Served] = []
    if first is not None:
        tried = _family_tried(family, trial, wish, fin_limit, first * FAMILY_SLOWDOWN ** np.arange(MAX_FAMILY_SLOWDOWNS))
    if not any(t.enough for t in tried) and wish.kind not in PROPORTIONAL and wish.bandwidth is None:
        factors = FAMILY_SLOWDOWN ** -np.arange(1.0, MAX_SPEEDUPS)
        tried += _family_tried(family, trial, wish, fin_limit, [f for f in factors if _good(family.one(), trial(float(f)), wish)])
    best = max(tried, key=lambda t: min(t.held, HELD_SHARE), default=None)
    if best is None or (wish.kind in PROPORTIONAL and best.held < LEAST_HELD):
        return None
    if not best.enough:
        return best
    enough = [t for t in tried if t.enough]
    if wish.kind in PROPORTIONAL or wish.bandwidth is not None:
        return _nearer(family, trial, wish, fin_limit, enough[0], first)
    soonest = min(t.settling for t in enough)
    return min((t for t in enough if t.settling <= SOON * soonest), key=lambda t: t.factor)


def _family_tried(
    family: LinearPlant, trial: DesignAttempt, wish: Wish, fin_limit: float, factors: Iterable[float]
) -> list[_Served]:
    """Return what gains of falling or rising speed do for the draws; those that are far from the best are not tried."""
    tried: list[_Served] = []
    for factor in factors:
        tried.append(_served(family, trial(float(factor)), float(factor), wish, fin_limit))
        enough = [t for t in tried if t.enough]
        if enough and (wish.kind in PROPORTIONAL or tried[-1].settling > FAR * min(t.settling for t in enough)):
            break
    return tried


def _nearer(
    family: LinearPlant, trial: DesignAttempt, wish: Wish, fin_limit: float, found: _Served, first: float | None
) -> _Served:
    """Return the fastest loop that serves, between one that does and the next faster one that did not."""
    if first is None or found.factor >= first:
        return found
    best, high = found, found.factor / FAMILY_SLOWDOWN
    for _ in range(6):
        middle = 0.5 * (best.factor + high)
        now = _served(family, trial(middle), middle, wish, fin_limit)
        best, high = (now, high) if now.enough else (best, middle)
    return best


def _fastest(plant: LinearPlant, trial: DesignAttempt, wish: Wish) -> float | None:
    """Return the share of the wished speed of the loop that serves the estimate, found by slowing it; None for none."""
    good = next((float(f) for f in SLOWDOWN_FACTOR ** np.arange(MAX_SLOWDOWNS) if _good(plant, trial(float(f)), wish)), None)
    if good is None or good == 1.0:
        return good
    bad = good / SLOWDOWN_FACTOR
    for _ in range(20):
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if _good(plant, trial(middle), wish) else (good, middle)
    return good


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


def _good(plant: LinearPlant, gains: Gains, wish: Wish) -> bool:
    # two digits less than asked: a formula that meets the damping exactly must not fail by rounding
    damped = float(least_damping(plant, gains)[0]) >= _damping_floor(wish) - 1e-6
    return damped and float(margins(plant, gains).phase_deg[0]) >= wish.phase_margin_deg - 1e-6


def _damping_floor(wish: Wish) -> float:
    """Poles other than the designed pair (an integrator's, the fin's) may be a little less damped, never below half."""
    return wish.damping if wish.kind == "p" and wish.damping < 1.0 else min(wish.damping, 1.0) * 0.8


def _proportional(plant: LinearPlant, wish: Wish, fin_limit: float) -> DesignAttempt:
    a, k, b = float(plant.slow_damping[0]), float(plant.stiffness[0]), float(plant.slow_authority[0])
    wished = (a * a / (4.0 * wish.damping**2) - k) / b
    if k > 0 and wished * b <= 0:
        wished = 0.5 * k / b  # stiff already beyond the wished damping: any gain lowers it, a modest one is left to the margins
    return lambda factor: Gains(wished * factor)


def _rate(plant: LinearPlant, wish: Wish, fin_limit: float) -> DesignAttempt:
    a, k, b = float(plant.slow_damping[0]), float(plant.stiffness[0]), float(plant.slow_authority[0])
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
    a, k, b = float(plant.slow_damping[0]), float(plant.stiffness[0]), float(plant.slow_authority[0])
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
