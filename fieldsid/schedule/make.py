"""A schedule from identified parameters: one row of gains per speed, with provenance."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees
from typing import Any

import numpy as np

from fieldsid._version import __version__
from fieldsid.errors import ModelError, UsageError
from fieldsid.logs.run import Note, Run
from fieldsid.models.allocation import PlaneFins
from fieldsid.models.axis import NAMES, Axis
from fieldsid.plant.parameter_source import ParameterSource
from fieldsid.plant.remedies import fin_limit_hint, refuse_fin_limit
from fieldsid.records.keys import body_of
from fieldsid.records.named_inputs import sha256_of
from fieldsid.schedule.linear_plant import FinLimits, not_counted, plants_at
from fieldsid.schedule.plants import Plants, models_plants, plants_of
from fieldsid.schedule.record import Answer, Schedule
from fieldsid.schedule.rows import DESIGN_DRAWS, SEED, design_rows
from fieldsid.schedule.verify import PITCH_LIMIT_RAD
from fieldsid.schedule.wish import PROPORTIONAL, Wish, check_wish

FIN = {Axis.YAW: "rudder", Axis.PITCH: "elevator"}
HELD_STEP_SHARE = 0.8
"""Share of the steady fin beyond trim that a smaller step may use: the rest moves the vehicle there."""
TURNS = {
    (Axis.YAW, 1.0): "positive rudder turns to starboard (b2 > 0)",
    (Axis.YAW, -1.0): "positive rudder turns to port (b2 < 0)",
    (Axis.PITCH, 1.0): "positive elevator pitches the nose up (d2 > 0)",
    (Axis.PITCH, -1.0): "positive elevator pitches the nose down (d2 < 0)",
}


def design_schedule(
    source: ParameterSource,
    fin_limit: float,
    *,
    speeds: Sequence[float] = (),
    wish: Wish | None = None,
    limits: FinLimits | None = None,
    depth: bool = False,
    runs: Sequence[Run] = (),
    length: float | None = None,
    fins: PlaneFins | None = None,
) -> Schedule:
    """Return the schedule of a source's axis at its speeds (or at `speeds`, m/s), with the fin limited to +/-fin_limit rad.

    runs are those the models were fitted to: the vehicle in surge, sway and yaw, `length` m long where that is known, is
    identified from them. fins: the fins over which the command is allocated, for the export of the gains. Raises UsageError for
    an impossible request and ModelError where no gain stabilises the loop.
    """
    wish, limits = wish or Wish(), limits or FinLimits()
    knots = _checked(source, fin_limit, speeds, wish, limits, fins, depth=depth)
    plants, refused = plants_of(source, limits, runs, length), False
    try:
        rows, answer = design_rows(plants, knots, wish, fin_limit, depth=depth)
    except ModelError as error:
        if plants.belief is None or wish.kind in PROPORTIONAL:
            raise  # only a rate feedback stabilises a hull that may be unstable
        # the sway of an unstable hull from pulses may be further off than the model of each speed, which is valid near its pulses
        plants, refused = models_plants(source, limits, runs, _refusal_note(error)), True
        rows, answer = design_rows(plants, knots, wish, fin_limit, depth=depth)
    return Schedule(
        axis=source.axis,
        kind=wish.kind,
        damping=wish.damped,
        phase_margin_deg=wish.phase_margin_deg,
        depth=depth,
        rows=rows,
        actuator=plants.actuator,
        provenance=_provenance(plants, wish, knots, depth=depth)
        | {"belief_refused": refused, "length_m": length}
        | ({} if fins is None else {"fins": body_of(fins)}),
        stated=body_of(limits),
        notes=() if plants.note is None else (plants.note,),
        answer=Answer(answer, wish.step_of(source.axis), wish.settling, wish.bandwidth, wish.overshoot, wish.fin_use),
    )


def _checked(
    source: ParameterSource, fin_limit: float, speeds: Sequence[float], wish: Wish, limits: FinLimits, fins: PlaneFins | None,
    *, depth: bool,
) -> list[float]:  # fmt: skip
    """Return the speeds (m/s) of a request; raises UsageError for one that is impossible, whatever the gains."""
    check_wish(wish)
    limits.refuse_impossible()
    knots = _knots(source, speeds)
    if depth and source.axis is not Axis.PITCH:
        raise UsageError("depth is held through pitch", found="axis: yaw", hint="give the pitch models")
    refuse_fin_limit("a fin's limit", fin_limit)
    if fins is not None and not fins.follows(fin_limit):
        raise UsageError(
            "the fin's limit is more than the fins reach",
            found=f"--fin-max {fin_limit:g}, {fins.reach:.4g} rad by `fins` of vehicle.yaml",
            hint=f"write `--fin-max {fins.reach:.4g}`, or leave it out",
        )
    source.require(knots)
    _refuse_fin_too_small(source, knots, fin_limit, limits, wish.step_of(source.axis))
    return knots


def _refusal_note(error: ModelError) -> Note:
    """Return the note for a vehicle fitted to all runs for which there are no gains."""
    words = (
        f"the vehicle that all runs together make believe in takes no gains ({error.what}: {error.found}); they are for each "
        "speed's own model: fly a zig-zag, which tells the sway, and identify again"
    )
    return Note("belief_refused", words)


def _knots(source: ParameterSource, speeds: Sequence[float]) -> list[float]:
    knots = sorted({round(float(s), 9) for s in (speeds or source.knots)})
    if not all(np.isfinite(s) and s > 0 for s in knots):
        raise UsageError("speeds must be above zero", found=f"{knots}", hint="write `--speeds 1.0,1.5,2.0`")
    return knots


def _refuse_fin_too_small(
    source: ParameterSource, knots: Sequence[float], fin_limit: float, limits: FinLimits, step: float
) -> None:  # fmt: skip
    """Raise UsageError where the fin limit is below the offset, or below what holds a pitch of `step` rad beside it."""
    plants = {speed: plants_at(source, speed, limits, 1, 0) for speed in knots}
    offsets = {speed: sum(share * float(plant.offset[0]) for plant, share in at) for speed, at in plants.items()}
    gains = {speed: abs(sum(share * plant.reference_gain for plant, share in at)) for speed, at in plants.items()}
    speed = max(knots, key=lambda s: abs(offsets[s]) + gains[s] * step)
    held = abs(offsets[speed]) + gains[speed] * step
    if held < fin_limit:
        return
    if abs(offsets[speed]) < fin_limit:
        possible = degrees(HELD_STEP_SHARE * (fin_limit - abs(offsets[speed])) / gains[speed])
        raise UsageError(
            f"the fin cannot hold a step of {degrees(step):.3g} deg at {speed:.3g} m/s to both sides",
            found=f"limit {fin_limit:.4g} rad; {held:.4g} rad against stiffness and trim",
            hint=f"ask a smaller step, `--step {possible:.2g}deg`, or leave slow speeds out, `--speeds`",
        )
    speed = max(offsets, key=lambda s: abs(offsets[s]))
    raise UsageError(
        f"the fin limit is below the offset at {speed:.3g} m/s: holding a straight run would take the whole {FIN[source.axis]}",
        found=f"limit {fin_limit:.4g} rad, offset {NAMES[source.axis].trim_fin} = {offsets[speed]:.4g} rad",
        hint=fin_limit_hint("--fin-max", abs(offsets[speed]), source),
    )


def _provenance(plants: Plants, wish: Wish, knots: Sequence[float], *, depth: bool) -> dict[str, Any]:
    source = plants.source
    names = NAMES[source.axis]
    sign = float(np.sign(source.base_at(float(source.speeds[0]))[names.authority]))
    low, high = float(source.speeds[0]), float(source.speeds[-1])
    return {
        "tool": f"fieldsid {__version__}",
        "models": [{"path": str(p), "sha256": sha256_of(p)} for p in source.paths if p.is_file()],
        "runs": [r for m in source.models for r in m.runs],
        "effects": sorted({e for m in source.models for e in m.effects}),
        "effects_not_counted": list(not_counted(source.models)),
        "speed_lost": plants.says,
        "draws": DESIGN_DRAWS,
        "draws_of": plants.draws_of,
        "draws_rejected": max(plants.share_rejected(speed, DESIGN_DRAWS, SEED) for speed in knots),
        "schedule_variable": "speed_m_s: forward speed through the water, m/s",
        "between_rows": "linear in speed",
        "outside_rows": "clamp: the nearest row's gains",
        "supported_m_s": [low, high],
        "sign_convention": f"{TURNS[source.axis, sign]}; angles rad, NED, body forward-starboard-down",
        "law": f"{FIN[source.axis]} = kp (ref - {source.axis.value}) + ki int(ref - {source.axis.value}) dt - kd rate "
        "+ feed_forward + reference_gain ref, limited to +/- fin_limit"
        + (f"; ref = depth_gain (depth - wanted depth), limited to +/- {PITCH_LIMIT_RAD:.3g} rad" if depth else ""),
        "wished": {"controller": wish.kind, "damping_ratio": wish.damped, "phase_margin_deg": wish.phase_margin_deg},
    }


def usual_controller(source: ParameterSource) -> str:
    """Return the default controller: PD where the models' runs have a measured rate, else P."""
    logged = source.models and all(np.isfinite(m.trained.get("rate_max", np.nan)) for m in source.models)
    return "pd" if logged else "p"
