"""From identified parameters to a schedule: one row of gains per speed, with provenance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fieldsid._version import __version__
from fieldsid.artifacts import sha256_of
from fieldsid.errors import UsageError
from fieldsid.models.axis import NAMES, Axis
from fieldsid.schedule.controller import Gains
from fieldsid.schedule.design import Wish, check_wish, design_gains
from fieldsid.schedule.margins import margins
from fieldsid.schedule.plant import FinLimits, LinearPlant, plants_at
from fieldsid.schedule.record import Row, Schedule
from fieldsid.turning.source import Source

FIN = {Axis.YAW: "rudder", Axis.PITCH: "elevator"}
TURNS = {
    (Axis.YAW, 1.0): "positive rudder turns to starboard (b2 > 0)",
    (Axis.YAW, -1.0): "positive rudder turns to port (b2 < 0)",
    (Axis.PITCH, 1.0): "positive elevator pitches the nose up (d2 > 0)",
    (Axis.PITCH, -1.0): "positive elevator pitches the nose down (d2 < 0)",
}


def design_schedule(
    source: Source,
    fin_limit: float,
    *,
    speeds: Sequence[float] = (),
    wish: Wish | None = None,
    limits: FinLimits | None = None,
    depth: bool = False,
) -> Schedule:
    """Return the schedule of a source's axis at its speeds (or those given, m/s), fin limited to +/-fin_limit rad.

    Raises UsageError for what cannot be meant and ModelError where no gain holds the loop.
    """
    wish, limits = wish or Wish(), limits or FinLimits()
    check_wish(wish)
    knots = _knots(source, speeds)
    if depth and source.axis is not Axis.PITCH:
        raise UsageError("depth is held through pitch", found="axis: yaw", hint="give the pitch models")
    if not 0.0 < fin_limit <= 1.5708:
        raise UsageError("the fin limit must be an angle in rad", found=f"{fin_limit:g}", hint="for 15 deg: `--fin-limit 0.26`")
    rows = tuple(_row(source, speed, fin_limit, wish, limits, depth=depth) for speed in knots)
    return Schedule(
        axis=source.axis,
        kind=wish.kind,
        damping=wish.damping,
        phase_margin_deg=wish.phase_margin_deg,
        depth=depth,
        rows=rows,
        actuator=_actuator(source, limits),
        provenance=_provenance(source, wish),
    )


def _knots(source: Source, speeds: Sequence[float]) -> list[float]:
    knots = sorted({round(float(s), 9) for s in (speeds or source.speeds)})
    if not all(np.isfinite(s) and s > 0 for s in knots):
        raise UsageError("speeds must be above zero", found=f"{knots}", hint="write `--speeds 1.0,1.5,2.0`")
    return knots


def _row(source: Source, speed: float, fin_limit: float, wish: Wish, limits: FinLimits, *, depth: bool) -> Row:
    plants = plants_at(source, speed, limits, 1, 0)
    made = [(design_gains(plant, wish, fin_limit), plant, share) for plant, share in plants]
    gains, forward, reference, depth_gain, slowed = Gains(0.0), 0.0, 0.0, 0.0, 1.0
    for designed, plant, share in made:
        own = designed.gains.times(share)
        gains = Gains(gains.kp + own.kp, gains.ki + own.ki, gains.kd + own.kd)
        forward -= share * float(plant.offset[0])
        reference += share * designed.reference_gain
        depth_gain += share * designed.depth_gain
        slowed = min(slowed, designed.slowed)
    _refuse_offset(forward, fin_limit, speed, source.axis)
    worst = [_margins_at(plant, gains) for _, plant, _ in made]
    phase, gain, delay = (min(w[i] for w in worst) for i in range(3))
    return Row(
        float(speed), gains, forward, reference, fin_limit, depth_gain if depth else 0.0, source.supports(speed), slowed,
        phase, gain, delay,
    )  # fmt: skip


def _margins_at(plant: LinearPlant, gains: Gains) -> tuple[float, float, float]:
    return margins(plant.one(), gains).worst()


def _refuse_offset(forward: float, fin_limit: float, speed: float, axis: Axis) -> None:
    if abs(forward) < fin_limit:
        return
    raise UsageError(
        f"the fin limit is below the offset at {speed:.3g} m/s: holding a straight run would take the whole {FIN[axis]}",
        found=f"limit {fin_limit:.4g} rad, offset {NAMES[axis].trim_fin} = {-forward:.4g} rad",
        hint="trim the fin, or give the true limit: `--fin-limit 0.35`",
    )


def _actuator(source: Source, limits: FinLimits) -> dict[str, float | None]:
    """Return lag, delay and rate limit the design counted with: stated ones first, else the first model's effects."""
    values = source.models[0].values if source.models else {}
    return {
        "lag_s": limits.lag if limits.lag is not None else values.get("lag", 0.0),
        "delay_s": limits.delay if limits.delay is not None else values.get("delay", 0.0),
        "fin_rate_rad_s": limits.rate if limits.rate is not None else values.get("max_rate"),
    }


def _provenance(source: Source, wish: Wish) -> dict[str, Any]:
    names = NAMES[source.axis]
    sign = float(np.sign(source.points[0].values[names.authority]))
    low, high = float(source.speeds[0]), float(source.speeds[-1])
    return {
        "tool": f"fieldsid {__version__}",
        "models": [{"path": str(p), "sha256": sha256_of(p)} for p in source.paths if p.is_file()],
        "runs": [r for m in source.models for r in m.runs],
        "effects": sorted({e for m in source.models for e in m.effects}),
        "schedule_variable": "speed_m_s: forward speed through the water, m/s",
        "between_rows": "linear in speed",
        "outside_rows": "clamp: the nearest row's gains",
        "supported_m_s": [low, high],
        "sign_convention": f"{TURNS[source.axis, sign]}; angles rad, NED, body forward-starboard-down",
        "law": f"{FIN[source.axis]} = kp (ref - {source.axis.value}) + ki int(ref - {source.axis.value}) dt - kd rate "
        "+ feed_forward + reference_gain ref, limited to +/- fin_limit",
        "wished": {"controller": wish.kind, "damping_ratio": wish.damping, "phase_margin_deg": wish.phase_margin_deg},
    }
