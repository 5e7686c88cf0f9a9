"""Before the dive: plan."""

from __future__ import annotations

from typing import Literal

from guide.shapes.common import AxisName, Number, Result, Shape, schema_field
from pydantic import Field


class Envelope(Shape):
    """The limits the plan keeps; null where none was given."""

    fin: float
    """Largest fin angle about trim, rad."""
    fin_rate: Number
    """Fastest fin, rad/s."""
    heading: Number
    """Largest deviation of heading, rad."""
    track: Number
    """Largest distance from the leg's line, m."""
    depth_low: Number
    """Shallowest, m."""
    depth_high: Number
    """Deepest, m."""
    pitch: Number
    """Largest pitch, rad."""
    roll: Number
    """Largest roll, rad."""
    area_length: Number
    """Room along the leg, m."""
    area_width: Number
    """Room across it, m."""
    share: float
    """Accepted probability of leaving them."""


class Window(Shape):
    """The part of a leg that is identified on."""

    length_s: float
    """Its length."""
    lead_s: float
    """Straight run at its start."""
    recover_s: float
    """Recovery at its end."""


class Autopilot(Shape):
    """Who steers before, between and after: fin = -angle_gain angle - rate_gain rate, about trim."""

    angle_gain: float
    """rad of fin per rad."""
    rate_gain: float
    """rad of fin per rad/s."""


class Expected(Shape):
    """What a parameter will be known to."""

    value: float
    """The value that is believed, at the leg's speed."""
    std_error: Number
    """Expected standard error."""
    std_error_high: Number
    """The error that five of six draws of what is believed stay below."""
    relative: Number
    """Standard error over the value; of a trim over a typical one."""
    baseline: Number
    """Standard error that the usual pulses of the same length give."""


class Excursions(Shape):
    """95 % quantiles of what the flight reaches, over draws of what is believed."""

    heading: float
    """Deviation of heading, rad."""
    track: float
    """Distance from the line, m."""
    depth: float
    """Change of depth, m."""
    pitch: float
    """Pitch, rad."""
    roll: float
    """Roll, rad."""
    along: float
    """Length needed, m."""
    across: float
    """Width needed, m."""
    behind: float
    """Way beyond the end of the area, m."""


class Abort(Shape):
    """Give the fin back to the autopilot when this limit is passed."""

    signal: str
    """The signal, or `time_s`."""
    kind: Literal["deviation", "below", "above", "time"]
    """How it is compared."""
    limit: float
    """The limit."""
    unit: str
    """Its unit."""
    says: str
    """In words."""


class Leg(Shape):
    """One leg of the plan."""

    speed_m_s: float
    """Speed through the water."""
    purpose: str
    """`parameters`, `turn radius`, or the effects it separates."""
    maneuver: str
    """The maneuver."""
    parameters: dict[str, float]
    """Its parameters."""
    passes: int
    """How many times it is flown."""
    run_up_s: float
    """Straight run before the window."""
    turn_s: float
    """Time to turn at the end."""
    window: Window
    """The part that is identified on."""
    rate_hz: float
    """The vehicle's command rate."""
    heading_limit_rad: Number
    """Largest deviation of heading on this leg; null where it is not limited."""
    duration_s: float
    """Length of all passes."""
    distance_m: float
    """Distance of all passes."""
    autopilot: Autopilot
    """Who steers where the maneuver does not."""
    expected: dict[str, Expected]
    """By parameter, what it will be known to."""
    excursions: Excursions
    """What the flight reaches."""
    break_probability: float
    """Probability of leaving the envelope."""
    abort: list[Abort]
    """When to give up."""
    expected_fin_rad: list[Number] = Field(default_factory=list)
    """The fin expected at each sample of a maneuver that follows the motion; null where the autopilot steers."""


class Separation(Shape):
    """The maneuver that tells effects apart."""

    maneuver: str
    """The maneuver."""
    spec: str
    """With its parameters, as `--maneuver` takes it."""
    parameters: dict[str, float]
    """Its parameters."""
    speed_m_s: float
    """The speed to fly it at."""
    duration_s: float
    """Its length."""
    expected_log_odds: Number
    """Smallest log odds of the pairs."""
    expected_odds: Number
    """The same as odds."""
    pairs: dict[str, Number]
    """`true>wrong`: expected log odds for the true one."""
    decides: bool
    """Whether one pass is expected to give odds of 20 to 1."""
    alternatives: dict[str, Number]
    """Other maneuvers, with what they are expected to give."""


class PlaneFins(Shape):
    """The fins that make the command of a plane."""

    names: list[str]
    """What each is called."""
    shares: list[float]
    """What each is told for a command of one rad, in its unit."""
    limits: list[float]
    """How far each goes, in its unit."""
    unit: str
    """Their unit."""


class Plan(Result):
    """What to fly."""

    schema_: Literal["fieldsid/plan/1"] = schema_field("fieldsid/plan/1")
    axis: AxisName
    """The plane."""
    vehicle: str
    """The vehicle's name."""
    prior: str
    """What is believed before the dive."""
    seed: int
    """Seed of the search and the draws."""
    want: dict[str, float]
    """Relative standard errors asked for."""
    minutes: float
    """Length of all legs, turns included."""
    metres: float
    """Distance of all legs."""
    break_probability: float
    """Largest probability of leaving the envelope."""
    course_rad: Number
    """Course of the legs; null where none was given."""
    fins: PlaneFins | None
    """The fins that the command is made of; null where it is one."""
    envelope: Envelope
    """The limits it keeps."""
    limits: dict[str, str]
    """The same in words, `NOT LIMITED` where there is none."""
    legs: list[Leg]
    """The legs."""
    files: list[str]
    """The files that were written."""
    separation: Separation | None = None
    """What tells the effects apart, where that was asked."""
    separations: list[Separation] = Field(default_factory=list)
    """The same for every speed."""
    says: list[str] = Field(default_factory=list)
    """The same in sentences."""
