"""The kinds of records by their schema: the shape of each, its name, and how it is made again.

The numbers of a plan and of a prior are checked where they are read, as their bounds are those of their maneuvers and effects;
the shapes here have only what the overview of a folder needs.
"""

from __future__ import annotations

from typing import NamedTuple

from fieldsid.records.check import (
    AXES,
    BOTH_SIDES,
    ERRORS,
    FLOOR,
    HEAD,
    LARGEST_FIN_RAD,
    SIDES,
    Shape,
    above_zero,
    anything,
    at_least_one,
    flag,
    maybe,
    number,
    one_of,
    text,
)
from fieldsid.records.laws import FIT
from fieldsid.records.model import MODEL, SPEED
from fieldsid.records.schedule import SCHEDULE


class Kind(NamedTuple):
    """The shape of one kind of record, its name in an error, how it is made again, and the command that makes one."""

    shape: Shape
    name: str
    again: str
    made_by: str = ""


DIAGNOSIS: Shape = {
    **HEAD,
    "axis": one_of(AXES),
    "verdict?": text,
    "says?": text,
    "effects?": [text],
    "base?": BOTH_SIDES,
    "noise_floor?": FLOOR,
    "noiseless?": flag,
    "runs?": [text],
    "validation_runs?": [text],
    "candidates?": [
        {
            "effect": text,
            "train?": ERRORS,
            "validation?": ERRORS,
            "probability?": number(0.0, 1.0),
            "explained?": number(0.0, 1.0),
            "log_evidence?": number(),
            "worse?": flag,
        }
    ],
}
DRAWN_DIAGNOSIS: Shape = {
    **dict.fromkeys(("verdict", "base", "noise_floor"), anything),
    "candidates": [{"train": anything, "validation": anything}],
}
"""What a report needs of a diagnosis in addition."""
SIZE, ENDS = maybe(number(0.0)), (maybe(number(0.0)), maybe(number(0.0)))
CIRCLE: Shape = {
    "side": one_of(SIDES),
    "radius_m": above_zero(),
    "std_error_m": SIZE,
    "fin_rad": maybe(number(-LARGEST_FIN_RAD, LARGEST_FIN_RAD)),
    **dict.fromkeys(("entry_speed_m_s?", "path_speed_m_s?"), maybe(SPEED)),
}
"""A measured circle, as it is drawn beside the predictions."""
TURN_RADIUS: Shape = {
    **HEAD,
    "rudder_max_rad?": above_zero(LARGEST_FIN_RAD),
    "rows": at_least_one(
        {
            "speed_m_s": SPEED,
            "side": one_of(SIDES),
            "radius_m": above_zero(),
            "interval95": (number(0.0), number(0.0)),
            "yaw_rate_max_rad_s": number(0.0),
            "trust": text,
            "extrapolated": flag,
            "method?": one_of(("maneuvering", "simulated", "u_turn", "steady", "measured")),
            **dict.fromkeys(("steady_radius_m?", "u_turn_radius_m?", "u_turn_time_s?", "model_radius_m?", "predicted_m?"), SIZE),
            **dict.fromkeys(("predicted95?", "u_turn_time95_s?"), ENDS),
        }
    ),
    "measured?": [CIRCLE],
}
PLAN: Shape = {**HEAD, "axis?": one_of(AXES)}
RUN_HEAD: Shape = {
    **HEAD,
    "schema": text,
    "notes": [{"code": text, "message": text, "data": {"signal?": anything, "reach_rad?": number(0.0)}}],
}
"""The metadata of a run file, next to its columns."""

ANY = Kind(HEAD, "record", "make it again")
"""A record of a kind of which only the head is read back."""
KINDS = {
    "fieldsid/model": Kind(MODEL, "model file", "identify again, with `--force`", "sysid identify RUN... -o models/"),
    "fieldsid/fit": Kind(FIT, "fit file", "make it again: `sysid fit MODEL...`", "sysid fit MODEL... -o laws.yaml"),
    "fieldsid/schedule": Kind(
        SCHEDULE, "schedule", "design it again, with `--force`", "sysid schedule design MODEL... -o gains.yaml"
    ),
    "fieldsid/diagnosis": Kind(DIAGNOSIS, "diagnosis", "diagnose again, with `-o`"),
    "fieldsid/turn-radius": Kind(TURN_RADIUS, "prediction of turns", "predict it again, with `--force`"),
    "fieldsid/run": Kind(RUN_HEAD, "run", "import the log again, with `--force`"),
    "fieldsid/plan": Kind(PLAN, "plan", "plan again, with `--force`", "sysid plan --axis yaw -o plan.yaml"),
    "fieldsid/prior": Kind(HEAD, "prior", "correct it; `sysid init NAME` writes an example"),
}
