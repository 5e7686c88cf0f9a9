"""sysid plan: what to fly inside the safety envelope, what it will buy, and what would tell two effects apart."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldsid.cli import options
from fieldsid.cli.console import Body, emit, progress, say
from fieldsid.cli.options import LIMITS, WRITTEN, Text, arguments_of, flag, option
from fieldsid.cli.progress import compiling, refuse_closed, refuse_existing
from fieldsid.cli.session import draw_figure
from fieldsid.cli.voice import angles
from fieldsid.figures.sketch import sketch
from fieldsid.models.axis import Axis
from fieldsid.page import Block, Page
from fieldsid.rounding import number, with_error

if TYPE_CHECKING:
    from fieldsid.models.model import Noise
    from fieldsid.planning.design.leg import Expected
    from fieldsid.planning.design.plan import Plan
    from fieldsid.planning.request import Made

GOAL, FLOWN, KNOWN = "What to learn", "How it is flown", "What is known before"
"""Groups of the options that only this command has, on its page of help."""


class Options(options.OfVehicle):
    """What `sysid plan` takes; the limits are named as in `EnvelopeLimits`, most others as in `PlanRequest`."""

    axis: Axis | None = option("--axis AXIS", "The plane to plan for; yaw, or that of a diagnosis.", GOAL)
    speeds: Text = option("--speeds M_S,..", "`1.0,1.4,1.8` or `1.0:1.8:0.4`; the prior's own if not given.", GOAL)
    model: Path | None = option("--model YAML", "What is known before: a model or a prior file.", KNOWN)
    prior: Text = option("--prior NAME", "A prior that is shipped, torpedo where no model is given.", KNOWN)
    want: Text = option("--want a22=5%,..", "Standard errors to reach, in shares of the value; the trim's of full fin.", GOAL)
    minutes: float | None = option("--minutes MIN", "Time there is for all legs, turns included.", LIMITS)
    area: Text = option("--area LxW", "Length along the leg and width across it, m.", LIMITS)
    depth_band: Text = option("--depth-band M:M", "Shallowest and deepest, m; entered at the middle.", LIMITS)
    heading: Text = option("--max-heading ANGLE", "Largest deviation of heading; 60deg in yaw, or `none`.", LIMITS)
    track: float | None = option("--max-track M", "Largest distance from the leg's line.", LIMITS)
    pitch: Text = option("--max-pitch ANGLE", "Largest pitch; 30deg in pitch, or `none`.", LIMITS)
    roll: Text = option("--max-roll ANGLE", "Largest roll, `20deg`.", LIMITS)
    fin: Text = option("--fin-max ANGLE", "Fin limit; the vehicle's own if not given, else 0.26 rad.", LIMITS)
    fin_rate: Text = option("--fin-rate ANGLE", "Fin rate limit per second; the vehicle's own if not given.", LIMITS)
    share: float = option("--risk SHARE", "Accepted probability of leaving the envelope.", LIMITS, default=0.05)
    window: float | None = option("--window S", "Length of the part that is identified on; 33, to separate 60.", FLOWN)
    run_up: float = option("--run-up S", "Straight run before it.", FLOWN, default=10.0)
    rate: float = option("--rate HZ", "The vehicle's command rate, and its log's.", FLOWN, default=20.0)
    radius: bool = flag("--radius", "Add full-fin circles, so that the turn radius is measured.", GOAL)
    open_loop: bool = flag("--open-loop", "Leave out maneuvers that follow the motion, such as the zig-zag.", FLOWN)
    separate: Text = option("--separate A,B", "What tells these effects apart; `none` is the plain model.", GOAL)
    diagnosis: Path | None = option("--from YAML", "A diagnosis: tell its rivals apart.", GOAL)
    course: Text = option("--course ANGLE", "Compass course of the legs, `90deg`: a MOOS helm then watches headings.", FLOWN)
    write: Text = option("--write csv,..", "Some of csv, ros2, moos, dune, ardupilot; else all.", WRITTEN)
    seed: int = option("--seed N", "Seed of the search and of the draws.", FLOWN, default=1)
    output: Path | None = options.FOLDER
    figures: bool = options.FIGURES
    force: bool = options.FORCE


@options.takes(Options)
def command(given: Options) -> Body:
    """Plan maneuvers: the fin commands that buy the accuracy you want inside your limits, in the fewest minutes.

    The best of the catalogue and of optimised switching signals is flown by hundreds of draws of the prior;
    each leg says the standard error of every parameter, minutes, metres and the risk. With `-o` the plan, fin
    commands about trim, mission snippets and a figure are written. Every limit is printed, NOT LIMITED where there is none. With
    `--separate` or `--from` there is one leg at every speed, the maneuver that tells the effects apart best.

    Example: sysid plan --axis yaw --speeds 1.0,1.4,1.8 --want a22=5%,b2=3% --area 200x60 -o plan
    """
    from fieldsid.cli.headlines.trial import headline_of_plan
    from fieldsid.cli.user_effects import check_effects
    from fieldsid.results.plans import Planned

    made = _planned(given)
    if given.model is not None:
        check_effects([(given.model, made.model)])
    files = () if given.output is None else tuple(map(str, _save(made, given, given.output)))
    separation: dict[str, Any] = {}
    if made.found:
        best = max(made.found, key=lambda s: s.expected_log_odds)
        separation = {"separation": best, "separations": made.found, "says": tuple(line for s in made.found for line in s.says())}
    result = Planned(made.plan, files, **separation)
    page = _page(made.plan, made.model.noise, separation.get("says", ()))
    return emit(result, render=page, headline=headline_of_plan(result, given.model))


def _planned(given: Options) -> Made:
    """Return the plan that is asked for; a place or a format that cannot be written is refused before the search."""
    from fieldsid.planning.jit_warmup import SHARED_KERNELS, compile_planning
    from fieldsid.planning.request import EnvelopeLimits, PlanRequest, planned

    _check_write(given.write, given.output)
    refuse_closed(given.output)
    refuse_existing(given.output / "plan.yaml" if given.output is not None else None, force=given.force)
    limiting = EnvelopeLimits(**arguments_of(EnvelopeLimits, given))
    separate = tuple(filter(None, map(str.strip, (given.separate or "").split(","))))
    request = PlanRequest(**arguments_of(PlanRequest, given, limiting=limiting, separate=separate))
    with compiling() as warmup, progress("planning", request.legs) as step:

        def compile_kernels() -> None:
            compile_planning()
            warmup.compile_now(SHARED_KERNELS)

        return planned(request, step, compile_kernels)


def _save(made: Made, given: Options, folder: Path) -> list[Path]:
    """Write the plan, its commands and its figure, name what is not written, and return the files."""
    from fieldsid.face.arguments import names_of
    from fieldsid.planning.output.command_files import unwritten, write_all
    from fieldsid.planning.output.figure_data import figure_data
    from fieldsid.planning.output.plan_file import save_plan

    plan, force = made.plan, given.force
    inputs = [p for p in (given.model, given.vehicle, given.diagnosis) if p is not None]
    files = [save_plan(plan, folder / "plan.yaml", inputs=inputs, force=force)]
    files += write_all(plan, folder, names_of(given.write), force=force)
    for line in unwritten(plan):
        say(line)
    if given.figures:
        files.append(folder / "plan.png")
        draw_figure(files[-1], sketch("plan", [figure_data(plan, leg, made.model) for leg in plan.legs]), force=force)
    return files


def _check_write(write: str | None, output: Path | None) -> None:
    """Raise UsageError for an unknown format, or for `--write` without `-o`: before the search, which takes time."""
    from fieldsid.errors import UsageError
    from fieldsid.face.arguments import names_of
    from fieldsid.planning.output.command_files import check_formats

    check_formats(names_of(write))
    if write is not None and output is None:
        raise UsageError("`--write` says what, `-o` where", found=f"--write {write}", hint="add `-o DIR`")


def _page(plan: Plan, noise: Noise, says: Iterable[str]) -> Page:
    factor, angle = angles().of("rad")
    rows = tuple(
        (
            number(leg.speed, 3),
            leg.candidate.maneuver,
            str(leg.passes),
            number(leg.duration_s / 60, 2),
            number(leg.distance_m, 3),
            f"{100 * leg.break_probability:.1f}%",
            *(number(v, 2) for v in _largest_excursions(leg.excursions, factor)),
        )
        for leg in plan.legs
    )
    columns = ("speed", "maneuver", "passes", "min", "m", "risk", f"angle {angle}", "side m")
    errors = tuple(
        (number(leg.speed, 3), name, *_expected_cells(e, leg.passes)) for leg in plan.legs for name, e in leg.expected.items()
    )
    heads = ("speed", "parameter", "expected", "error", "at worst", "pulses need")
    blocks: tuple[Block | str, ...] = (
        Block(f"{plan.vehicle}, {plan.axis.value}: what to fly", rows, columns, left=2),
        Block("what it buys", errors, heads, left=2),
        f"{plan.minutes:.1f} minutes, {plan.metres:.0f} m; risk of leaving the envelope at most {plan.break_probability:.1%}",
        f"errors as of a log at {plan.legs[0].rate_hz:g} Hz, the rate of the commands, with the noise believed: "
        + _in_words(noise),
        *_limits(plan),
        *says,
    )
    return Page("", blocks=blocks)


def _in_words(noise: Noise) -> str:
    """Return the noise of the sensors that were measured, and of the disturbance if any."""
    from fieldsid.planning.belief.prior_model import UNMEASURED

    sizes = ((noise.angle, "rad"), (noise.rate, "rad/s"), (noise.disturbance, "rad/s^2"))
    shown = [(size * angles().of(unit)[0], angles().of(unit)[1]) for size, unit in sizes if 0.0 < size < UNMEASURED]
    return ", ".join(f"{number(size, 2)} {unit}" for size, unit in shown)


def _limits(plan: Plan) -> Iterator[str]:
    """Yield every limit, those of a leg where they differ, and which of them are not part of the risk."""
    from fieldsid.models.axis import Axis
    from fieldsid.planning.safety.envelope import NOT_LIMITED, limits_said

    limits = limits_said(plan.envelope)
    yield "limits: " + "; ".join(f"{name} {words}" for name, words in limits.items())
    for leg in plan.legs:
        of_leg = limits_said(leg.envelope_in(plan.envelope))
        other = [f"{name} {words}" for name, words in of_leg.items() if words != limits[name]]
        if other:
            yield f"{leg.candidate.maneuver} at {leg.speed:g} m/s: {'; '.join(other)}"
    unseen = ("pitch", "depth") if plan.axis is Axis.YAW else ("heading", "track", "roll")
    watched = [name for name in unseen if limits[name] != NOT_LIMITED]
    if watched:
        yield f"not in the risk, only to be watched in flight: {', '.join(watched)}"


def _largest_excursions(excursions: Mapping[str, float], factor: float) -> tuple[float, float]:
    """Return the 95 % quantiles of heading or pitch (rad times the factor) and of the distance from the track or depth (m)."""
    angle = factor * max(excursions.get(k, 0.0) for k in ("heading", "pitch"))
    return angle, max(excursions.get(k, 0.0) for k in ("track", "depth"))


def _expected_cells(e: Expected, passes: int) -> tuple[str, str, str, str]:
    """Return a parameter's expected value, its standard error, that of the worst draws, and the time the paper's pulses need.

    That is the flying time for the same standard error, as a multiple of the maneuver's.
    """
    from fieldsid.planning.design.leg import error_in_words

    value, pulses = with_error(e.value, e.std_error), "-"
    if not isfinite(e.std_error):  # the maneuver does not excite it
        return value, "-", "-", pulses
    if isfinite(e.baseline) and e.baseline > 0 and e.std_error > 0:
        pulses = f"{(e.baseline / e.std_error) ** 2 / passes:.1f} x"
    at_worst = error_in_words(e.value, e.std_error_high, e.relative * e.std_error_high / e.std_error)
    return value, error_in_words(e.value, e.std_error, e.relative), at_worst, pulses
