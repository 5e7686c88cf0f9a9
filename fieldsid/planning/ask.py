"""From what a user typed to a plan: vehicle, prior, envelope and wish put together and checked against each other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fieldsid.errors import UsageError
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.model import Model
from fieldsid.models.simulate import effects_of
from fieldsid.planning.candidate import Window
from fieldsid.planning.envelope import Envelope
from fieldsid.planning.plan import Plan, Request, make_plan
from fieldsid.planning.plan_file import plan_body
from fieldsid.planning.prior import named_prior
from fieldsid.planning.prior_file import load_believed
from fieldsid.planning.quantities import parse_angle, parse_area, parse_band, parse_speeds
from fieldsid.planning.rivals import rivals_from, rivals_named
from fieldsid.planning.separate_plan import separating_plan
from fieldsid.planning.wish import parse_wish
from fieldsid.vehicle import Vehicle, find_vehicle, load_vehicle

FIN_MAX = 0.26
"""Fin limit (rad) where no vehicle says another: beyond it the fins of the paper's vehicle stall."""
HEADING_MAX, PITCH_MAX = np.radians(60.0), np.radians(30.0)


@dataclass(frozen=True, slots=True)
class Limiting:
    """The limits as typed."""

    area: str | None = None
    depth_band: str | None = None
    heading: str | None = None
    track: float | None = None
    pitch: str | None = None
    roll: str | None = None
    fin: str | None = None
    fin_rate: str | None = None
    share: float = 0.05


UNLIMITED = Limiting()


@dataclass(frozen=True, slots=True)
class Asked:
    """Everything that was typed."""

    axis: Axis
    speeds: str | None = None
    vehicle: Path | None = None
    model: Path | None = None
    prior: str = "torpedo"
    want: str | None = None
    minutes: float | None = None
    limiting: Limiting = UNLIMITED
    window: float = 33.0
    run_up: float = 10.0
    rate: float = 20.0
    radius: bool = False
    separate: tuple[str, ...] = ()
    diagnosis: Path | None = None
    seed: int = 1
    open_loop: bool = False

    @property
    def legs(self) -> int:
        """How many legs will be searched, for a progress bar."""
        return 1 if self.speeds is None else max(1, len(parse_speeds(self.speeds)))


@dataclass(frozen=True, slots=True)
class Made:
    """A plan, the prior it was made on, and what there is to print."""

    plan: Plan
    model: Model
    body: Mapping[str, Any]


def planned(asked: Asked, step: Callable[[], None] = lambda: None, ready: Callable[[], None] = lambda: None) -> Made:
    """Return the plan that was asked for; raises FieldsidError with what would be possible.

    ready is called once what was asked for is read and understood, before the search.
    """
    vehicle = _vehicle(asked.vehicle)
    if asked.separate or asked.diagnosis:
        return _separating(asked, vehicle, ready)
    model = _signed(believed(asked), vehicle)
    speeds = _speeds(asked, model)
    known = [*NAMES[asked.axis].base, *(c.name for e in effects_of(model) for c in e.shared)]
    request = Request(
        axis=asked.axis,
        speeds=speeds,
        envelope=envelope_of(asked.axis, asked.limiting, vehicle),
        want=parse_wish(asked.want, known) if asked.want else {},
        minutes=asked.minutes,
        window=Window(asked.window, rate_hz=asked.rate),
        run_up_s=_run_up(asked.run_up),
        radius=asked.radius,
        open_loop=asked.open_loop,
        seed=asked.seed,
        vehicle=vehicle.name if vehicle else "vehicle",
        slowest=vehicle.speed_min_m_s if vehicle else None,
        fastest=vehicle.speed_max_m_s if vehicle else None,
    )
    ready()
    plan = make_plan(model, request, step)
    return Made(plan, model, plan_body(plan))


def believed(asked: Asked) -> Model:
    """Return what is believed before the dive: a model or prior file, else the named prior of the axis."""
    return named_prior(asked.prior, asked.axis) if asked.model is None else load_believed(asked.model)


def envelope_of(axis: Axis, limiting: Limiting, vehicle: Vehicle | None, *, free_heading: bool = False) -> Envelope:
    """Return the envelope: what was typed, then the vehicle's own limits, then the defaults; raises UsageError."""
    area = parse_area(limiting.area) or (None, None)
    band = parse_band(limiting.depth_band) or (None, None)
    own = None if vehicle is None else vehicle.fin_max_rad(axis.value)
    fin = parse_angle(limiting.fin, "--fin-max")
    if fin is not None and own is not None and fin > own:
        raise UsageError(
            f"a fin of {fin:g} rad is more than the vehicle has",
            found=f"{own:g} rad in vehicle.yaml",
            hint=f"give `--fin-max {own:g}`",
        )
    rate = parse_angle(limiting.fin_rate, "--fin-rate") or (vehicle.fin_rate_rad_s if vehicle else None)
    heading, pitch = parse_angle(limiting.heading, "--max-heading"), parse_angle(limiting.pitch, "--max-pitch")
    if axis is Axis.YAW and heading is None and not free_heading:
        heading = HEADING_MAX
    return Envelope(
        fin=fin if fin is not None else own if own is not None else FIN_MAX,
        fin_rate=np.inf if rate is None else rate,
        heading=heading,
        track=limiting.track,
        depth_low=band[0],
        depth_high=band[1],
        pitch=PITCH_MAX if axis is Axis.PITCH and pitch is None else pitch,
        roll=parse_angle(limiting.roll, "--max-roll"),
        area_length=area[0],
        area_width=area[1],
        share=limiting.share,
    )


def _separating(asked: Asked, vehicle: Vehicle | None, ready: Callable[[], None]) -> Made:
    if asked.diagnosis is not None:
        rivals = rivals_from(asked.diagnosis, asked.separate)
    else:
        rivals = rivals_named(_signed(believed(asked), vehicle), asked.separate)
    envelope = envelope_of(rivals[0].axis, asked.limiting, vehicle, free_heading=True)
    window = Window(asked.window, rate_hz=asked.rate)
    speeds = _speeds(asked, rivals[0])
    name, run_up = vehicle.name if vehicle else "vehicle", _run_up(asked.run_up)
    ready()
    plan, separation = separating_plan(rivals, envelope, speeds, window, run_up, name, asked.seed)
    return Made(plan, rivals[0], {**plan_body(plan), "separation": separation.plain(), "says": separation.says()})


def _vehicle(path: Path | None) -> Vehicle | None:
    return find_vehicle(Path()) if path is None else load_vehicle(path)


def _signed(model: Model, vehicle: Vehicle | None) -> Model:
    """Return a prior with the sign of its authority turned to the vehicle's convention, where one is stated."""
    if vehicle is None or model.method != "prior":
        return model
    side = vehicle.positive_rudder if model.axis is Axis.YAW else vehicle.positive_elevator
    if side is None:
        return model
    name = NAMES[model.axis].authority
    sign = 1.0 if side in ("starboard", "nose_up") else -1.0
    return replace(model, values={**model.values, name: sign * abs(model.values[name])})


def _speeds(asked: Asked, model: Model) -> tuple[float, ...]:
    if asked.speeds is not None:
        return parse_speeds(asked.speeds)
    if not np.isfinite(model.law.reference):
        raise UsageError("the model does not say at what speed it holds", found="no speed", hint="give `--speeds 1.0,1.4,1.8`")
    return (round(model.law.reference, 3),)


def _run_up(seconds: float) -> float:
    if not 0 <= seconds <= 600:
        raise UsageError(
            f"a run-up of {seconds:g} s cannot be meant", found=f"--run-up {seconds:g}", hint="for example `--run-up 10`"
        )
    return seconds
