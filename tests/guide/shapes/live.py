"""What `sysid live --json` prints: one object a look, a line each."""

from __future__ import annotations

from typing import Literal

from guide.shapes.common import AxisName, Interval, Number, Shape, schema_field


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
    counts: dict[str, int]
    """What was met: missing, repeated, late samples, gaps, restarts, spikes, lines that could not be read."""
    next: str
    """The command that comes next; empty where the source is no log."""
