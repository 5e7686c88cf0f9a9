"""What `sysid live --json` prints: one object a look, a line each."""

from __future__ import annotations

from typing import Any, Literal

from guide.shapes.common import AxisName, Interval, Number, Shape, schema_field
from guide.shapes.gains import Row


class LiveExcitation(Shape):
    """How the vehicle was moved in the last 10 s."""

    fin_rms_rad: Number
    """Root mean square of the fin about its mean, in rad."""
    rate_rms_rad_s: Number
    """Of the rate, in rad/s."""


class LiveParameter(Shape):
    """One parameter now."""

    value: Number
    """Its value."""
    std_error: Number
    """Its standard error."""
    interval95: Interval
    """Its 95 % interval."""
    unit: str
    """Its unit."""
    goal_std_error: Number
    """The standard error that is wanted; null where none is."""
    share: float
    """Share of the information for that which is in, 0 to 1."""
    settled: bool
    """Whether it has stayed, over the last 10 s, within 5 % of its value or one standard error."""


class LiveJump(Shape):
    """A jump of the fin's authority, as by a payload swapped or a fin lost."""

    since_s: float
    """When it was, about; the estimate is of what came since."""
    factor: float
    """The authority over what it was, at the same speed."""
    std_error: float
    """Its standard error."""


class LiveGains(Shape):
    """Gains of the estimate, by the design of `schedule design`, with `--gains`."""

    time_s: Number
    """Time of the estimate they are of."""
    verdict: Literal["use", "keep", "change", "refused"]
    """`keep` and `change` are of the gains that are loaded, `use` where none are; `refused` until the estimate has settled."""
    says: str
    """The gains with their errors beside those loaded, or why there are none."""
    speed_m_s: Number = None
    """The speed they are for: that of the last 10 s."""
    row: Row | None = None
    """The row of a schedule."""
    std_errors: dict[str, float] | None = None
    """Standard errors of kp, ki, kd and of the feed-forward in rad."""
    loaded: Row | None = None
    """The row of the schedule that is loaded, at this speed."""
    loaded_phase_margin_deg: Number = None
    """Its phase margin with the estimate: the least over 95 % of the draws."""


class LiveDiagnosis(Shape):
    """What `diagnose` says of what was flown when the last maneuver had ended, with `--diagnose`."""

    time_s: Number
    """The end of what was diagnosed."""
    verdict: str
    """Its verdict; `refused` where it could not be diagnosed."""
    says: str
    """Its first line."""
    effects: list[str] | None = None
    """What is missing."""
    left: dict[str, Any] | None = None
    """What is left: `ratio` is the error over the noise."""
    base: dict[str, Any] | None = None
    """The error without them."""
    final: dict[str, Any] | None = None
    """The error with them."""
    noise_floor: dict[str, Any] | None = None
    """The sensors' noise."""
    next_maneuver: dict[str, Any] | None = None
    """What to fly before coming up; null where nothing is to be told apart."""


class Live(Shape):
    """One look at the estimate of a vehicle under way."""

    schema_: Literal["fieldsid/live/1"] = schema_field("fieldsid/live/1")
    axis: AxisName
    """The plane."""
    source: str
    """Where the samples come from."""
    time_s: Number
    """Stamp of the newest sample."""
    verdict: Literal["starting", "contradicts", "collecting", "not_excited", "moving", "enough"]
    """`enough`: every goal is reached and has settled; `moving`: reached, not settled; `not_excited`: the fin is still;
    `contradicts`: angle and rate are not each other's."""
    said: str
    """The verdict in a sentence."""
    share: float
    """Share of the information that the goal takes which is in, of the parameter that limits."""
    limited_by: str
    """That parameter."""
    left_s: Number
    """Seconds to the goal at the pace of the last 10 s; null where unknown."""
    goals_from: str
    """Where the goals are from."""
    speed_m_s: Number
    """Mean surge."""
    samples: int
    """Rows that joined the estimate."""
    excitation: LiveExcitation
    """How the vehicle was moved."""
    parameters: dict[str, LiveParameter]
    """By name."""
    authority_jump: LiveJump | None
    """The last jump of the fin's authority; null where there was none."""
    gains: LiveGains | None
    """Gains of now; null without `--gains`."""
    diagnosed: LiveDiagnosis | None
    """A diagnosis of what was flown; null without `--diagnose`, or before the first maneuver has ended."""
    counts: dict[str, int]
    """What was met: missing, repeated, late samples, gaps, restarts, spikes, lines that could not be read."""
    next: str
    """The command that comes next; empty where the source is no log."""
