"""Plans made by hand: legs of any maneuver inside one envelope, for tests of what is written."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldsid.maneuvers import Autopilot, parse_spec
from fieldsid.models.axis import Axis
from fieldsid.planning.design.leg import Expected, Leg
from fieldsid.planning.design.plan import Plan
from fieldsid.planning.flight.excitation import Excitation, Window
from fieldsid.planning.safety.envelope import Envelope

ENVELOPE = Envelope(0.26, 1.5, heading=1.0, depth_low=1.0, depth_high=6.0, roll=0.3, area_length=200.0, area_width=50.0)


def leg(spec="square_pulses", **changes):
    maneuver, values = parse_spec(spec)
    made = Leg(
        1.4, Excitation(maneuver.name, values), Window(33.0), 10.0, 15.0, Autopilot(-0.4, -0.1, 0.26),
        {"a22": Expected(1.1, 0.05, 0.07, 0.045, 0.1)}, {"heading": 0.4}, 0.02,
        replay_risk=float("nan") if maneuver.rule is None else 0.01,
        nominal=np.zeros(0) if maneuver.rule is None else np.append(np.linspace(-0.2, 0.2, 540), np.full(60, np.nan)),
    )  # fmt: skip
    return replace(made, **changes)


def plan(*legs):
    return Plan(
        Axis.YAW,
        "pandan",
        "torpedo",
        ENVELOPE,
        legs or (leg(), leg("zigzag:duration=26"), leg("chirp:duration=26")),
        {"a22": 0.05},
    )
