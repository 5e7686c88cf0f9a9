"""When to give the fin back to the autopilot before a maneuver is over: one condition per limit of the envelope."""

from __future__ import annotations

from dataclasses import dataclass

from fieldsid.models.axis import Axis
from fieldsid.planning.envelope import Envelope
from fieldsid.planning.leg import Leg

GRACE_S = 5.0
SLOWEST_SHARE = 0.6


@dataclass(frozen=True, slots=True)
class Abort:
    """End the maneuver when |signal - its value at the start| exceeds `limit`; `kind` is deviation, below, above or time."""

    signal: str
    kind: str
    limit: float
    unit: str
    says: str


def aborts_of(axis: Axis, leg: Leg, envelope: Envelope) -> tuple[Abort, ...]:
    """Return the abort conditions of a leg, the time first: they hold whatever else a mission says."""
    found = [
        Abort("time_s", "time", leg.window.length + GRACE_S, "s", "the window is over"),
        Abort("surge_m_s", "below", SLOWEST_SHARE * leg.speed, "m/s", "too slow to steer as planned"),
    ]
    circle = leg.purpose == "turn radius"
    if axis is Axis.YAW and envelope.heading is not None and not circle:
        found.append(Abort("yaw_rad", "deviation", envelope.heading, "rad", "heading left the envelope"))
    if axis is Axis.YAW and envelope.track is not None and not circle:
        found.append(Abort("y_m", "deviation", envelope.track, "m", "track left the envelope"))
    if envelope.pitch is not None:
        found.append(Abort("pitch_rad", "deviation", envelope.pitch, "rad", "pitch left the envelope"))
    if envelope.roll is not None:
        found.append(Abort("roll_rad", "deviation", envelope.roll, "rad", "roll left the envelope"))
    if envelope.depth_low is not None and envelope.depth_high is not None:
        found.append(Abort("depth_m", "above", envelope.depth_high, "m", "too deep"))
        found.append(Abort("depth_m", "below", envelope.depth_low, "m", "too shallow"))
    return tuple(found)
