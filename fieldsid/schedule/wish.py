"""What is asked of a loop, as control engineers state it, and what of it can be meant at all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees, exp, hypot, inf, log, pi, sqrt
from types import MappingProxyType

from fieldsid.errors import UsageError
from fieldsid.models.axis import Axis
from fieldsid.registry import near
from fieldsid.schedule.controller import KINDS

STEP_ANGLE_RAD: Mapping[Axis, float] = MappingProxyType({Axis.YAW: 0.3490658503988659, Axis.PITCH: 0.17453292519943295})
"""The standard step: 20 deg of heading, 10 deg of pitch."""
DAMPING, MOST_DAMPING = 0.7071, 3.0
PROPORTIONAL, RATE_FED = ("p", "pi"), ("pd", "pid")
QUICKEST = 0.0
"""The settling time that stands for: at each speed as quick as its fin and its margins let it be."""


@dataclass(frozen=True, slots=True)
class Wish:
    """What is asked of the loop: controller kind, damping ratio, phase margin (deg), and the answer to a step.

    `step` (rad) is the error that may ask for `fin_use` of the fin's limit, without it the axis' standard step and the whole fin.
    `settling` (s) is how soon the step has to settle at every speed: without it all speeds settle as the slowest of them can,
    QUICKEST leaves each its own. `bandwidth` (rad/s) is that of the formula's poles at every speed, in place of a time to settle.
    `overshoot` is the share by which the step may overshoot; a damping that is not given is that of such a step.
    """

    kind: str = "p"
    damping: float | None = None
    phase_margin_deg: float = 45.0
    step: float | None = None
    bandwidth: float | None = None
    settling: float | None = None
    overshoot: float | None = None
    fin_use: float | None = None

    @property
    def damped(self) -> float:
        """The damping ratio: as asked, else that of the overshoot asked, else DAMPING."""
        if self.damping is not None:
            return self.damping
        return DAMPING if self.overshoot is None else damping_of(self.overshoot)

    @property
    def is_formula(self) -> bool:
        """Whether the gain is the damping's alone: a proportional gain is one number, and nothing else is asked of it."""
        return self.kind in PROPORTIONAL and self.settling is None and self.bandwidth is None

    @property
    def most_fin(self) -> float:
        """The share of the fin that the step may ask for; a formula's gain asks for what it takes."""
        return self.fin_use if self.fin_use is not None else inf if self.is_formula else 1.0

    def step_of(self, axis: Axis) -> float:
        """Return the step (rad) that is flown."""
        return STEP_ANGLE_RAD[axis] if self.step is None else self.step


def overshoot_of(damping: float) -> float:
    """Return the overshoot of a second-order loop as a share; its damping ratio is a hundredth of its phase margin in deg."""
    return 0.0 if damping >= 1.0 else exp(-pi * damping / sqrt(1.0 - damping**2))


def damping_of(overshoot: float) -> float:
    """Return the damping ratio of a second-order loop that overshoots by a share."""
    return 1.0 if overshoot <= 0.0 else -log(overshoot) / hypot(pi, log(overshoot))


def check_wish(wish: Wish) -> None:
    """Raise UsageError for a wish that cannot be meant, whatever the vehicle."""
    if wish.kind not in KINDS:
        raise UsageError(f"there is no controller {wish.kind!r}", found=", ".join(KINDS), hint=near(wish.kind, list(KINDS)))
    if wish.settling is not None and wish.bandwidth is not None:
        raise UsageError(
            "`--settling` and `--bandwidth` both say how quick the loop is to be",
            found=f"settling {wish.settling:g} s, bandwidth {wish.bandwidth:g} rad/s",
            hint="leave one of them out",
        )
    ranges = (
        ("the damping ratio", wish.damping, 0.1, MOST_DAMPING, "0.1 .. 3", "`--damping 0.7` overshoots by 5 %"),
        ("the phase margin", wish.phase_margin_deg, 10.0, 80.0, "10 .. 80 deg", "`--phase-margin 45deg` is usual"),
        ("the overshoot", wish.overshoot, 0.0, 0.5, "0 .. 50 %", "`--overshoot 5%` is usual"),
        ("the share of the fin", wish.fin_use, 0.01, 1.0, "1 .. 100 %", "`--fin-use 80%` leaves a fifth of the fin"),
        ("the step", wish.step, 1e-3, pi, "0.06 .. 180 deg", "`--step 20deg` is usual"),
        ("the time to settle", wish.settling, 0.0, 1e5, "0 .. 100000 s", "`--settling 4s`"),
        ("the bandwidth", wish.bandwidth, 1e-4, 1e3, "0.0001 .. 1000 rad/s", "`--bandwidth 1rad/s`"),
    )
    for what, value, low, high, between, hint in ranges:
        if value is not None and not low <= value <= high:
            said = degrees(value) if what == "the step" else 100.0 * value if between.endswith("%") else value
            raise UsageError(f"{what} must lie in {between}", found=f"{said:g}", hint=hint)
