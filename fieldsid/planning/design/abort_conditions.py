"""When to give the fin back to the autopilot before a maneuver is over: one condition per limit of the envelope."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from fieldsid.planning.design.leg import Leg
from fieldsid.planning.safety.envelope import Envelope
from fieldsid.records.keys import Key

GRACE_S = 5.0
SLOWEST_SHARE = 0.6


@dataclass(frozen=True, slots=True)
class Abort:
    """End the maneuver when a signal leaves `limit`: `kind` is deviation (from its value at the start), below, above or time."""

    signal: Annotated[str, Key("The signal, or `time_s`.")]
    kind: Annotated[str, Key("How it is compared.", of=Literal["deviation", "below", "above", "time"])]
    limit: Annotated[float, Key("The limit.")]
    unit: Annotated[str, Key("Its unit.")]
    says: Annotated[str, Key("In words.")]


def aborts_of(leg: Leg, envelope: Envelope) -> tuple[Abort, ...]:
    """Return the abort conditions of a leg, one per limit that holds on it, the time first."""
    limits = leg.envelope_in(envelope)
    found = [
        Abort("time_s", "time", leg.window.length + GRACE_S, "s", "the window is over"),
        Abort("surge_m_s", "below", SLOWEST_SHARE * leg.speed, "m/s", "too slow to steer as planned"),
    ]
    for signal, limit, says in (("yaw_rad", limits.heading, "heading"), ("pitch_rad", limits.pitch, "pitch")):
        if limit is not None:
            found.append(Abort(signal, "deviation", limit, "rad", f"{says} left the envelope"))
    if limits.roll is not None:
        found.append(Abort("roll_rad", "deviation", limits.roll, "rad", "roll left the envelope"))
    if limits.depth_low is not None and limits.depth_high is not None:
        found.append(Abort("depth_m", "above", limits.depth_high, "m", "too deep"))
        found.append(Abort("depth_m", "below", limits.depth_low, "m", "too shallow"))
    return (*found, *_of_place(leg, limits))


def _of_place(leg: Leg, limits: Envelope) -> tuple[Abort, ...]:
    """Return the conditions on the place: x along the leg from the window's start, y to starboard of its line."""
    found = []
    sides = [s for s in (limits.track, None if limits.area_width is None else 0.5 * limits.area_width) if s is not None]
    if sides:
        found.append(Abort("y_m", "deviation", min(sides), "m", "too far from the leg's line"))
    if limits.area_length is not None:
        run_up = leg.run_up_s * leg.speed
        found.append(Abort("x_m", "above", limits.area_length - run_up, "m", "beyond the end of the area"))
        found.append(Abort("x_m", "below", -run_up, "m", "behind the start of the area"))
    return tuple(found)
