"""A plan from command-line options: vehicle, prior, envelope and accuracy goals, checked against each other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fieldsid import angles
from fieldsid.dynamics.free_run import effects_of
from fieldsid.errors import UsageError
from fieldsid.maneuvers import RATE_HZ
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.model import Model
from fieldsid.planning.belief.prior_model import checked_prior, load_believed, named_prior
from fieldsid.planning.design.objective import RUN_UP_S
from fieldsid.planning.design.plan import WINDOW, Plan, Request, make_plan
from fieldsid.planning.discriminate.discriminate import LONGEST_WINDOW_S, Separation
from fieldsid.planning.discriminate.rivals import rivals_from, rivals_named
from fieldsid.planning.discriminate.separating_plan import separating_plan
from fieldsid.planning.flight.excitation import Window
from fieldsid.planning.safety.envelope import ACCEPTED_SHARE, LARGEST_FIN, Envelope
from fieldsid.planning.specify.quantities import parse_accuracy_goals, parse_area, parse_band, parse_speeds
from fieldsid.vehicle import Vehicle, find_vehicle, load_vehicle

FIN_MAX = 0.26
"""Default fin limit (rad): beyond it the fins of the paper's vehicle stall."""
HEADING_MAX, PITCH_MAX = float(np.radians(60.0)), float(np.radians(30.0))
PRIOR, NONE = "torpedo", "none"
AS_TYPED = 1e-4
"""Share by which a limit may exceed the vehicle's own, as one that is typed with a few digits."""


@dataclass(frozen=True, slots=True)
class EnvelopeLimits:
    """The limits as typed."""

    area: str | None = None
    depth_band: str | None = None
    heading: str | None = None
    track: float | None = None
    pitch: str | None = None
    roll: str | None = None
    fin: str | None = None
    fin_rate: str | None = None
    share: float = ACCEPTED_SHARE


UNLIMITED = EnvelopeLimits()


@dataclass(frozen=True, slots=True)
class PlanRequest:
    """The options of `sysid plan`, None where they are not given."""

    axis: Axis | None = None
    speeds: str | None = None
    vehicle: Path | None = None
    model: Path | None = None
    prior: str | None = None
    want: str | None = None
    minutes: float | None = None
    limiting: EnvelopeLimits = UNLIMITED
    window: float | None = None
    run_up: float = RUN_UP_S
    rate: float = RATE_HZ
    radius: bool = False
    separate: tuple[str, ...] = ()
    diagnosis: Path | None = None
    seed: int = 1
    open_loop: bool = False
    course: str | None = None

    @property
    def legs(self) -> int:
        """Number of legs, for a progress bar."""
        return 1 if self.speeds is None else max(1, len(parse_speeds(self.speeds)))


@dataclass(frozen=True, slots=True)
class Made:
    """A plan, its prior, and the discriminating maneuvers of `--separate`."""

    plan: Plan
    model: Model
    found: tuple[Separation, ...] = ()


def planned(options: PlanRequest, step: Callable[[], None] = lambda: None, ready: Callable[[], None] = lambda: None) -> Made:
    """Return the requested plan; raises FieldsidError with a possible request in the hint.

    `ready` is called once the request has been read and checked, before the search.
    """
    vehicle = _vehicle(options.vehicle)
    if options.seed < 0:
        raise UsageError("a seed is a whole number from zero", found=f"--seed {options.seed}", hint="write `--seed 1`")
    if options.model is not None and options.prior is not None:
        raise UsageError("`--model` and `--prior` both say what is believed", found=f"--prior {options.prior}", hint="give one")
    if options.separate or options.diagnosis is not None:
        return _separating(options, vehicle, step, ready)
    model = _signed(prior_model(options), vehicle)
    request = _request(options, model, vehicle, options.axis or model.axis)
    known = [*NAMES[request.axis].base, *(c.name for e in effects_of(model) for c in e.shared)]
    request = replace(request, want=parse_accuracy_goals(options.want, known) if options.want is not None else {})
    ready()
    plan = make_plan(model, request, step)
    return Made(plan, model)


def _request(options: PlanRequest, model: Model, vehicle: Vehicle | None, axis: Axis, window_s: float = WINDOW.length) -> Request:
    return Request(
        axis=axis,
        speeds=_speeds(options, model),
        envelope=envelope_of(axis, options.limiting, vehicle),
        want={},
        minutes=options.minutes,
        window=Window(window_s if options.window is None else options.window, rate_hz=options.rate),
        run_up_s=_run_up(options.run_up),
        radius=_with_circles(options),
        open_loop=options.open_loop,
        seed=options.seed,
        vehicle=vehicle.name if vehicle else "vehicle",
        fins=vehicle.fins.of(axis.value) if vehicle and vehicle.fins else None,
        slowest=vehicle.speed_min_m_s if vehicle else None,
        fastest=vehicle.speed_max_m_s if vehicle else None,
        course=_course(options.course),
    )


def _course(text: str | None) -> float | None:
    return None if text is None else angles.parse_angle(text, "--course", angles.TURN, angles.TURN) % angles.TURN


def _with_circles(options: PlanRequest) -> bool:
    """Return whether circles are requested; raises UsageError with a heading limit or `--open-loop`, which exclude them."""
    if options.radius and options.limiting.heading not in (None, NONE):
        raise UsageError(
            "a circle turns through more than a whole turn, whatever `--max-heading` says",
            found=f"--radius --max-heading {options.limiting.heading}",
            hint="leave `--max-heading` out, or plan the circles apart: `sysid plan --radius`",
        )
    if options.radius and options.open_loop:
        raise UsageError(
            "a circle follows the heading: it is not open loop", found="--radius --open-loop", hint="leave one of the two out"
        )
    return options.radius


def prior_model(options: PlanRequest) -> Model:
    """Return the prior model: a model or prior file, else the named prior of the axis."""
    return (
        named_prior(options.prior or PRIOR, options.axis or Axis.YAW) if options.model is None else load_believed(options.model)
    )


def envelope_of(axis: Axis, limiting: EnvelopeLimits, vehicle: Vehicle | None) -> Envelope:
    """Return the envelope from the options, else the limits of the vehicle, else the defaults; raises UsageError.

    The option `none` removes the default limit of heading or pitch.
    """
    area = parse_area(limiting.area)
    band = parse_band(limiting.depth_band)
    fin = None if limiting.fin is None else angles.parse_angle(limiting.fin, "--fin-max", angles.FIN, LARGEST_FIN)
    rate = None
    if limiting.fin_rate is not None:
        rate = angles.parse_angle(limiting.fin_rate, "--fin-rate", angles.FIN_RATE, angles.FASTEST_FIN)
    fin = _within_own(fin, None if vehicle is None else vehicle.fin_max_rad(axis.value), "--fin-max", "rad")
    rate = _within_own(rate, None if vehicle is None else vehicle.fin_rate_rad_s, "--fin-rate", "rad/s")
    return Envelope(
        fin=FIN_MAX if fin is None else fin,
        fin_rate=np.inf if rate is None else rate,
        heading=_limit(
            limiting.heading,
            "--max-heading",
            (angles.HEADING, angles.TURN),
            HEADING_MAX if axis is Axis.YAW else None,
            f"write `--max-heading {NONE}` to let circles in",
        ),
        track=limiting.track,
        depth_low=band[0],
        depth_high=band[1],
        pitch=_limit(limiting.pitch, "--max-pitch", (angles.TILT, angles.TILT), PITCH_MAX if axis is Axis.PITCH else None),
        roll=_limit(limiting.roll, "--max-roll", (angles.TILT, angles.TILT)),
        area_length=area[0],
        area_width=area[1],
        share=limiting.share,
    )


def _within_own(asked: float | None, own: float | None, option: str, unit: str) -> float | None:
    """Return the limit asked for, else the vehicle's own; raises UsageError where more is asked for than the vehicle has."""
    if asked is None or own is None:
        return own if asked is None else asked
    if asked > own * (1.0 + AS_TYPED):
        raise UsageError(
            f"`{option}` {asked:.4g} {unit} is more than the vehicle has",
            found=f"{own:.4g} {unit} in vehicle.yaml",
            hint=f"leave `{option}` out, which takes the vehicle's own",
        )
    return min(asked, own)


def _limit(
    text: str | None, option: str, most: tuple[float, float], default: float | None = None, beyond: str = ""
) -> float | None:
    """Return the limit of an option in rad, None for `none`, the default without the option.

    `most` are the largest angles without and with a unit, in rad; `beyond` is an additional hint for a larger one.
    """
    if text is None:
        return default
    return None if text.strip().lower() == NONE else angles.parse_angle(text, option, *most, beyond)


def _separating(options: PlanRequest, vehicle: Vehicle | None, step: Callable[[], None], ready: Callable[[], None]) -> Made:
    if options.want is not None:
        raise UsageError(
            "`--want` asks for accuracy, not for what tells effects apart",
            found=f"--want {options.want}",
            hint="leave it out, or plan the two apart",
        )
    rivals = _rivals(options, vehicle)
    request = _request(options, rivals[0], vehicle, rivals[0].axis, LONGEST_WINDOW_S)
    ready()
    plan, found = separating_plan(rivals, request, step)
    return Made(plan, rivals[0], tuple(found))


def _rivals(options: PlanRequest, vehicle: Vehicle | None) -> tuple[Model, ...]:
    if options.diagnosis is None:
        model = _signed(prior_model(options), vehicle)
        # stability is not checked here: an added effect may bound the rate of an unstable base model
        return rivals_named(checked_prior(model, options.axis or model.axis, ()), options.separate)
    if options.model is not None or options.prior is not None:
        raise UsageError(
            "a diagnosis says itself what is believed", found="`--from` with `--model` or `--prior`", hint="leave the latter out"
        )
    rivals = rivals_from(options.diagnosis, options.separate)
    if options.axis not in (None, rivals[0].axis):
        raise UsageError(
            f"`{options.diagnosis}` is a diagnosis of {rivals[0].axis.value}",
            found=f"--axis {options.axis.value}" if options.axis else "",
            hint=f"write `--axis {rivals[0].axis.value}`, or leave it out",
        )
    return rivals


def _vehicle(path: Path | None) -> Vehicle | None:
    return find_vehicle(Path()) if path is None else load_vehicle(path)


def _signed(model: Model, vehicle: Vehicle | None) -> Model:
    """Return a prior whose authority has the sign of the vehicle's convention, where that is stated."""
    if vehicle is None or model.method != "prior":
        return model
    side = vehicle.positive_rudder if model.axis is Axis.YAW else vehicle.positive_elevator
    if side is None:
        return model
    name = NAMES[model.axis].authority
    sign = 1.0 if side in ("starboard", "nose_up") else -1.0
    return replace(model, values={**model.values, name: sign * abs(model.values[name])})


def _speeds(options: PlanRequest, model: Model) -> tuple[float, ...]:
    if options.speeds is not None:
        return parse_speeds(options.speeds)
    if not np.isfinite(model.law.reference):
        raise UsageError("the model does not say at what speed it holds", found="no speed", hint="give `--speeds 1.0,1.4,1.8`")
    return (round(model.law.reference, 3),)


def _run_up(seconds: float) -> float:
    if not 0 <= seconds <= 600:
        raise UsageError(
            f"a run-up of {seconds:g} s cannot be meant", found=f"--run-up {seconds:g}", hint="for example `--run-up 10`"
        )
    return seconds
