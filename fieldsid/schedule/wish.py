"""The requirements on a loop as control engineers state them, and their possible ranges."""

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
"""The required settling time that means: at each speed as quick as fin and margins allow."""


@dataclass(frozen=True, slots=True)
class Wish:
    """The requirements on the loop: kind of controller, damping ratio, phase margin (deg), and the response to a step.

    `step` (rad) is the error that may use the share `fin_use` of the fin limit; by default the standard step of the axis and the
    full fin. `settling` (s) is the settling time of the step at every speed; by default that of the slowest speed, with QUICKEST
    the shortest of each. `bandwidth` (rad/s) is that of the formula's poles at every speed, in place of a settling time. The step
    may overshoot by the share `overshoot`; without a stated damping the damping ratio follows from it.
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
        """The damping ratio: as stated, else that of the stated overshoot, else DAMPING."""
        if self.damping is not None:
            return self.damping
        return DAMPING if self.overshoot is None else damping_of(self.overshoot)

    @property
    def is_formula(self) -> bool:
        """Whether the gain follows from the damping: P or PI without a required settling time or bandwidth."""
        return self.kind in PROPORTIONAL and self.settling is None and self.bandwidth is None

    @property
    def most_fin(self) -> float:
        """The share of the fin limit that the step may use; unlimited for the gain of a formula."""
        return self.fin_use if self.fin_use is not None else inf if self.is_formula else 1.0

    def step_of(self, axis: Axis) -> float:
        """Return the step (rad) for which the loop is designed."""
        return STEP_ANGLE_RAD[axis] if self.step is None else self.step


def overshoot_of(damping: float) -> float:
    """Return the overshoot of a second-order loop as a share; its damping ratio is about its phase margin in deg over 100."""
    return 0.0 if damping >= 1.0 else exp(-pi * damping / sqrt(1.0 - damping**2))


def damping_of(overshoot: float) -> float:
    """Return the damping ratio of a second-order loop with an overshoot, as a share."""
    return 1.0 if overshoot <= 0.0 else -log(overshoot) / hypot(pi, log(overshoot))


def check_wish(wish: Wish) -> None:
    """Raise UsageError for requirements outside their possible ranges, independent of the vehicle."""
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
