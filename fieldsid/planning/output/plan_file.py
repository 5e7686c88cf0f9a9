"""A plan as a YAML file, whose numbers are all checked when it is read."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fieldsid.artifacts import save_record
from fieldsid.errors import ArtifactError
from fieldsid.maneuvers import Autopilot, pick_maneuver
from fieldsid.models.allocation import plane_fins_of
from fieldsid.models.axis import Axis
from fieldsid.planning.design.leg import Expected, Leg
from fieldsid.planning.design.plan import MOST_PASSES, Plan
from fieldsid.planning.flight.excitation import Excitation, Window, fits
from fieldsid.planning.safety.envelope import LARGEST_SPEED, Envelope
from fieldsid.planning.specify.quantities import MOST_SPEEDS
from fieldsid.planning.whole_file import whole_file
from fieldsid.records.check import finite_number
from fieldsid.records.keys import body_of
from fieldsid.records.reading import load_record

KIND = "fieldsid/plan"
MAX_LEG_S = 3600.0
MOST_LEGS = 3 * MOST_SPEEDS
"""One leg and two circles at every speed."""


def save_plan(plan: Plan, path: Path, *, inputs: Sequence[Path] = (), force: bool = False) -> Path:
    """Write a plan as YAML; raises ArtifactError."""
    return save_record(path, f"{KIND}/1", body_of(plan), inputs=inputs, force=force)


def load_plan(path: Path) -> Plan:
    """Read a plan back, with every number checked against its bounds.

    Raises ArtifactError naming what is missing, wrong or out of bounds.
    """
    body = load_record(path, KIND)
    with whole_file(path, "plan", "plan again, with `--force`"):
        return _plan_of(body)


def _plan_of(body: Mapping[str, Any]) -> Plan:
    limits = {k: (None if v is None else finite_number(v, k)) for k, v in body["envelope"].items()}
    limits["fin_rate"] = np.inf if limits.get("fin_rate") is None else limits["fin_rate"]
    envelope = Envelope(**limits)  # type: ignore[arg-type]
    legs = body["legs"]
    if not isinstance(legs, list) or not 0 < len(legs) <= MOST_LEGS:
        raise ArtifactError(f"a plan has 1 to {MOST_LEGS} legs", found=str(len(legs)))
    return Plan(
        axis=Axis(body["axis"]),
        vehicle=str(body["vehicle"]),
        prior=str(body["prior"]),
        envelope=envelope,
        legs=tuple(_leg_of(leg, envelope) for leg in legs),
        want={str(k): finite_number(v, f"want {k}", 0.0, 1.0) for k, v in body["want"].items()},
        seed=int(body["seed"]),
        course=None if body.get("course_rad") is None else _number(body, "course_rad", 0.0, 2.0 * math.pi),
        fins=None if body.get("fins") is None else plane_fins_of(body["fins"]),
    )


def _leg_of(body: Mapping[str, Any], envelope: Envelope) -> Leg:
    maneuver = pick_maneuver(str(body["maneuver"]))
    candidate = Excitation(maneuver.name, maneuver.checked({k: finite_number(v, k) for k, v in body["parameters"].items()}))
    _check_fins(candidate, envelope)
    w = body["window"]
    lead, recover = (_number(w, k, 0.0, MAX_LEG_S) for k in ("lead_s", "recover_s"))
    window = Window(_number(w, "length_s", 1.0, MAX_LEG_S), lead, recover, _number(body, "rate_hz", 0.1, 1000.0))
    if not fits(candidate, window):
        raise ArtifactError(
            f"{candidate.duration:.1f} s of `{maneuver.name}` do not fit a window of {window.length:g} s",
            found=f"{window.excitation:g} s between lead and recovery",
        )
    pilot = body["autopilot"]
    return Leg(
        speed=_number(body, "speed_m_s", 1e-3, LARGEST_SPEED),
        candidate=candidate,
        window=window,
        run_up_s=_number(body, "run_up_s", 0.0, MAX_LEG_S),
        turn_s=_number(body, "turn_s", 0.0, MAX_LEG_S),
        autopilot=Autopilot(_number(pilot, "angle_gain"), _number(pilot, "rate_gain"), envelope.fin),
        expected={str(n): _expected(e) for n, e in body["expected"].items()},
        excursions={str(k): finite_number(v, k) for k, v in body["excursions"].items()},
        break_probability=_number(body, "break_probability", 0.0, 1.0),
        passes=round(_number(body, "passes", 1, MOST_PASSES)),
        purpose=str(body["purpose"]),
        heading=None if body["heading_limit_rad"] is None else _number(body, "heading_limit_rad", 1e-3, 30.0),
        replay_risk=_known(body.get("replay_break_probability"), "replay_break_probability", 0.0, 1.0),
        nominal=np.clip([_known(v, "expected_fin_rad") for v in body.get("expected_fin_rad", [])], -envelope.fin, envelope.fin),
    )


def _check_fins(candidate: Excitation, envelope: Envelope) -> None:
    for parameter in candidate.record.parameters:
        value = candidate.parameters[parameter.name]
        if parameter.unit == "rad" and parameter.name != "turn" and value > envelope.fin * (1 + 1e-9):
            raise ArtifactError(
                f"`{candidate.maneuver}` asks for {value:g} rad of fin, more than the plan's limit",
                found=f"{parameter.name} = {value:g}, limit {envelope.fin:g} rad",
                hint=f"set `{parameter.name}` to at most {envelope.fin:g}",
            )


def _expected(body: Mapping[str, Any]) -> Expected:
    return Expected(**{f: math.nan if body[f] is None else float(body[f]) for f in Expected.__dataclass_fields__})


def _number(body: Mapping[str, Any], name: str, *bounds: float) -> float:
    return finite_number(body[name], name, *bounds)


def _known(value: Any, *bounds: Any) -> float:
    """Return a number, NaN for None."""
    return math.nan if value is None else finite_number(value, *bounds)
