"""sysid schedule: gains per speed: design, verify, export."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fieldsid.cli.console import emit, messages, say, table
from fieldsid.cli.options import Force, JsonFlag, ModelFiles, OutputFile, VehicleFile
from fieldsid.cli.progress import refuse_figure
from fieldsid.cli.session import tasks_of

if TYPE_CHECKING:
    from rich.console import Console

    from fieldsid.plant.parameter_source import ParameterSource
    from fieldsid.schedule.record import Schedule
    from fieldsid.schedule.verify import Check, Verification

SLOWED_SHARE = 0.995
"""Below it a row's share is not printed as 1.00."""

command = typer.Typer(help="Gains per speed: design them, verify them, write them for the vehicle's software.")

ScheduleFile = Annotated[Path, typer.Argument(metavar="SCHEDULE", help="A schedule written by `sysid schedule design`.")]
Controller = Annotated[
    str | None,
    typer.Option("--controller", metavar="KIND", help="p, pd, pi, pid or lqr; pd where the runs have a rate, else p."),
]
Damping = Annotated[float, typer.Option("--damping", help="Damping ratio of the closed loop.")]
PhaseWanted = Annotated[str, typer.Option("--phase-margin", metavar="ANGLE", help="Phase margin to keep, `45deg`.")]
Speeds = Annotated[
    str | None, typer.Option("--speeds", metavar="LIST", help="Speeds of the rows, m/s; those of the models if not given.")
]
FinLimit = Annotated[
    str | None,
    typer.Option(
        "--fin-limit",
        metavar="ANGLE",
        help="Largest fin angle, `15deg`; if not given the vehicle's limit, else the models' largest.",
    ),
]
FinRate = Annotated[
    str | None, typer.Option("--fin-rate", metavar="ANGLE", help="Fastest fin per s; the vehicle's or model's if not given.")
]
FinLag = Annotated[
    float | None, typer.Option("--fin-lag", metavar="S", help="Time constant of the fin; the model's if not given.")
]
Delay = Annotated[
    float | None, typer.Option("--delay", metavar="S", help="Dead time from command to fin; the model's if not given.")
]
Latency = Annotated[
    float | None,
    typer.Option("--latency", metavar="S", help="The autopilot's own, sensor to command, with half its period."),
]
Depth = Annotated[bool, typer.Option("--depth", help="Add the depth loop above pitch.")]
OwnLaw = Annotated[
    list[str] | None, typer.Option("--law", metavar="NAME=c0[,c1]", help="A law of your own, c0 + c1 u^2, as `b2=-0.23,-0.33`.")
]
Models = Annotated[
    list[Path] | None,
    typer.Option("--model", metavar="MODEL", help="Models to verify on; those it was designed from if not given."),
]
MarginFigure = Annotated[
    Path | None, typer.Option("-o", "--output", metavar="FILE", help="Draw a figure: .png, .svg or .pdf, by the suffix.")
]
NeedPhase = Annotated[
    str | None, typer.Option("--require-phase-margin", metavar="ANGLE", help="Exit 1 when any speed has less, `40deg`.")
]
NeedGain = Annotated[float | None, typer.Option("--require-gain-margin", metavar="DB", help="Exit 1 when any speed has less.")]
NeedDelay = Annotated[float | None, typer.Option("--require-delay-margin", metavar="S", help="Exit 1 when any speed has less.")]
MostOvershoot = Annotated[float | None, typer.Option("--max-overshoot", metavar="PERCENT", help="Exit 1 when any step has more.")]
TARGETS = ", ".join(m.name for m in iter_modules([str(Path(__file__).parents[2] / "exports")]) if not m.name.startswith("_"))
To = Annotated[str, typer.Option("--to", metavar="TARGET", help=f"One of {TARGETS}.")]
Node = Annotated[
    str | None, typer.Option("--node", metavar="NAME", help="What the gains go under: node, section, prefix or process.")
]
Template = Annotated[
    Path | None, typer.Option("--template", metavar="FILE", help="A template of your own, see templates/exports/.")
]
Into = Annotated[Path | None, typer.Option("--into", metavar="YAML", help="An existing YAML file to put the gains into.")]
Key = Annotated[str | None, typer.Option("--key", metavar="A.B.C", help="The key in that file that holds the gains.")]
Write = Annotated[bool, typer.Option("--write", help="Change the file of `--into` (a backup is kept), not only show how.")]


@command.command("design", short_help="Gains per speed from models, a fit file or a table.")
def design(
    models: ModelFiles,
    controller: Controller = None,
    damping: Damping = 0.7071,
    phase_margin: PhaseWanted = "45deg",
    speeds: Speeds = None,
    fin_limit: FinLimit = None,
    fin_rate: FinRate = None,
    fin_lag: FinLag = None,
    delay: Delay = None,
    latency: Latency = None,
    depth: Depth = False,
    law: OwnLaw = None,
    vehicle: VehicleFile = None,
    output: OutputFile = None,
    force: Force = False,
    as_json: JsonFlag = False,
) -> Mapping[str, Any]:
    """Design gains per speed: PD or P with feed-forward, PI, PID, LQR; heading or pitch, by the models' axis.

    Damping and phase margin hold with the fin's lag and delay, half of the margin for 95 % of the draws of the models' errors,
    and a step flown by them comes to rest: with the fin's limits and the speed lost in the turn. P and PI are slowed until they
    do; with a rate the gains are those that settle soonest. What none holds is refused. The feed-forward cancels the trim.

    Example: sysid schedule design law.yaml --fin-limit 0.26 -o gains.yaml
    """
    from fieldsid.angles import FIN, FIN_RATE, parse_angle, parse_margin
    from fieldsid.cli.user_effects import check_effects
    from fieldsid.face.arguments import runs_behind
    from fieldsid.face.speeds import speeds_of
    from fieldsid.plant.parameter_source import load_parameter_source
    from fieldsid.schedule.design import Wish
    from fieldsid.schedule.linear_plant import FinLimits
    from fieldsid.schedule.make import design_schedule, usual_controller
    from fieldsid.schedule.record import body_of, save_schedule
    from fieldsid.schedule.verify import STEP_ANGLE_RAD

    given = None if fin_limit is None else parse_angle(fin_limit, "--fin-limit", FIN)
    fastest = None if fin_rate is None else parse_angle(fin_rate, "--fin-rate", FIN_RATE)
    margin = parse_margin(phase_margin, "--phase-margin")
    source = load_parameter_source(models, laws=law or ())
    check_effects(zip(source.paths, source.models, strict=False))  # a table has no models
    limit, rate = _limits(given, fastest, vehicle, source)
    schedule = design_schedule(
        source,
        limit,
        speeds=speeds_of(speeds),
        wish=Wish(controller or usual_controller(source), damping, margin, STEP_ANGLE_RAD[source.axis]),
        limits=FinLimits(fin_lag, delay, rate, latency),
        depth=depth,
        runs=runs_behind(source, say),
    )
    body: dict[str, Any] = {"schema": "fieldsid/schedule/1", **body_of(schedule), "file": None}
    if output is not None:
        inputs = [p for p in source.paths if p.is_file()]
        body["file"] = str(save_schedule(schedule, output, inputs=inputs, force=force))
    return emit(body, as_json=as_json, render=lambda to: _render_design(to, schedule, source, body))


@command.command("verify", short_help="Margins and steps over the identified set.")
def verify(
    context: typer.Context,
    schedule: ScheduleFile,
    models: Models = None,
    require_phase_margin: NeedPhase = None,
    require_gain_margin: NeedGain = None,
    require_delay_margin: NeedDelay = None,
    max_overshoot: MostOvershoot = None,
    output: MarginFigure = None,
    force: Force = False,
    as_json: JsonFlag = False,
) -> Mapping[str, Any]:
    """Check a schedule at its knots and between, over the errors of the models, against the best one gain for all speeds.

    The first line is the verdict, the second what it rests on. Margins by python-control; steps of three sizes flown with the
    fin's limit, rate, lag and delay, the hull's drag in the turn and the speed lost in it; a straight leg in the disturbance of
    the models' runs. The least and the most are over 95 % of the draws. A gate that fails makes the exit code 1. With `-o FILE` a
    figure is drawn.

    Example: sysid schedule verify gains.yaml --require-phase-margin 40 -o gains.png
    """
    from fieldsid.angles import parse_margin
    from fieldsid.cli.user_effects import check_effects
    from fieldsid.face.arguments import designed_from, runs_behind
    from fieldsid.plant.parameter_source import load_parameter_source
    from fieldsid.schedule.record import load_schedule
    from fieldsid.schedule.verdict import against_constant, gates_of, rests_on, verdict_of
    from fieldsid.schedule.verify import verify_schedule

    refuse_figure(output, force=force)
    least = None if require_phase_margin is None else parse_margin(require_phase_margin, "--require-phase-margin")
    known = load_schedule(schedule)
    source = load_parameter_source(models or designed_from(known, str(schedule)))
    check_effects(zip(source.paths, source.models, strict=False))  # a table has no models
    checked = verify_schedule(known, source, runs=runs_behind(source, say))
    wanted = (least, require_gain_margin, require_delay_margin, max_overshoot)
    gates = gates_of(checked, dict(zip(checked.worst, wanted, strict=True)))
    verdict, says = verdict_of(checked, known, gates)
    body = {
        "schema": "fieldsid/verification/1",
        "verdict": verdict,
        "says": says,
        "rests_on": rests_on(checked, known, source),
        "against_constant": against_constant(checked),
        "constant_gains": {n: getattr(checked.constant_row.gains, n) for n in ("kp", "ki", "kd")},
        "axis": known.axis.value,
        "controller": known.kind,
        "worst": checked.worst,
        "scheduled": [c.record() for c in checked.scheduled],
        "constant": [c.record() for c in checked.constant],
        "gates": [g.record() for g in gates],
        "passed": all(g.passed for g in gates),
        "figure": None if output is None else _draw(known, checked, output, context, force=force),
    }
    emit(body, as_json=as_json, render=lambda to: _render_verify(to, checked, body))
    if not body["passed"]:
        raise typer.Exit(1)
    return body


@command.command("export", short_help="Write the gains for the vehicle's software.")
def export(
    schedule: ScheduleFile,
    to: To = "yaml",
    node: Node = None,
    template: Template = None,
    into: Into = None,
    key: Key = None,
    write: Write = False,
    output: OutputFile = None,
    force: Force = False,
    as_json: JsonFlag = False,
) -> Mapping[str, Any]:
    """Write a schedule as plain YAML, ROS 2 parameters, DUNE ini, ArduPilot .param or MOOS block; to stdout without `-o`.

    `--into FILE --key A.B.C` shows how an existing YAML file would change, comments and order kept, and changes it only with
    `--write`; the file as it was is kept as .bak.

    Example: sysid schedule export gains.yaml --to ros2 -o heading.yaml
    """
    from fieldsid.errors import UsageError
    from fieldsid.exports import pick_target
    from fieldsid.schedule.record import load_schedule

    known = load_schedule(schedule)
    if (into is None) != (key is None):
        raise UsageError(
            "`--into` and `--key` go together", found=f"into {into}, key {key}", hint="`--into vehicle.yaml --key a.b.c`"
        )
    if into is not None and key is not None:
        return _export_into(known, into, key, write=write, as_json=as_json)
    target = pick_target(to)
    text = target.render(known, node or target.node, template)
    body: dict[str, Any] = {"schema": "fieldsid/export/1", "target": target.name, "text": text, "file": None}
    if output is not None:
        from fieldsid.artifacts import write_text

        body["file"] = str(write_text(output, text, force=force))
    return emit(body, as_json=as_json, render=lambda out: _render_export(out, body))


def _export_into(schedule: Schedule, into: Path, key: str, *, write: bool, as_json: bool) -> Mapping[str, Any]:
    from fieldsid.exports._patch import patch_yaml, write_patch
    from fieldsid.exports._target import columns_of

    patch = patch_yaml(into, key, columns_of(schedule))
    backup = str(write_patch(patch)) if write else None
    body = {"schema": "fieldsid/export/1", "target": "into", "difference": patch.difference, "file": str(into), "backup": backup}
    emit(body, as_json=as_json, render=lambda out: out.out(patch.difference, end="", highlight=False))
    if write:
        say(f"written: {into}; as it was: {backup}")
    else:
        say("nothing was changed: add `--write`")
    return body


def _limits(
    fin_limit: float | None, fin_rate: float | None, vehicle: Path | None, source: ParameterSource
) -> tuple[float, float | None]:
    """Return fin limit and fin rate: the options, else the vehicle's, else the largest fin the models were trained on."""
    from fieldsid.face.arguments import fin_limits_of, vehicle_of

    return fin_limits_of(fin_limit, fin_rate, vehicle_of(vehicle), source, messages().print)


def _draw(schedule: Schedule, checked: Verification, path: Path, context: typer.Context, *, force: bool) -> str:
    from fieldsid.figures.canvas import save
    from fieldsid.figures.schedule import figure

    return str(save(figure(schedule, checked), path, force=force, tasks=tasks_of(context)))


def _render_design(to: Console, schedule: Schedule, source: ParameterSource, body: Mapping[str, Any]) -> None:
    from math import degrees, isfinite

    from fieldsid.rounding import number
    from fieldsid.schedule.verdict import fin_of, lost
    from fieldsid.schedule.verify import STEP_ANGLE_RAD

    extra = ("kz",) if schedule.depth else ()
    rows = [
        (
            number(r.speed, 3),
            number(r.gains.kp),
            number(r.gains.ki, 3),
            number(r.gains.kd, 3),
            number(r.feed_forward, 3),
            number(r.fin_limit, 3),
            *((number(r.depth_gain, 3),) if schedule.depth else ()),
            f"{r.phase_margin_deg:.0f}",
            f"{r.slowed:.2f}",
            f"{r.settling:.1f}" if isfinite(r.settling) else "never",
            f"{100 * r.draws_held:.0f}%",
            "yes" if r.supported else "no",
        )
        for r in schedule.rows
    ]
    columns = ("m/s", "kp", "ki", "kd", "forward", "fin", *extra, "phase", "slowed", "settle s", "held", "data")
    to.print(table(f"{schedule.axis.value}, {schedule.kind}: gains per speed", columns, rows, left=0))
    to.print(f"signs: {schedule.provenance['sign_convention']}")
    counted = (fin_of(schedule.actuator), str(schedule.provenance["speed_lost"]), *lost(source))
    to.print(f"counted with: {'; '.join(counted)}")
    to.print(
        f"phase, settle: the worst of 95 % of {schedule.provenance['draws']} draws of the models' errors; held: those that come "
        f"to rest from a {degrees(STEP_ANGLE_RAD[schedule.axis]):.0f} deg step"
    )
    if rejected := schedule.provenance["draws_rejected"]:
        to.print(f"up to {100 * rejected:.0f} % of the draws were rejected as outside what is physical, and drawn anew")
    slowed = [r for r in schedule.rows if r.slowed < SLOWED_SHARE]
    if slowed:
        to.print(
            f"{len(slowed)} of {len(schedule.rows)} rows were slowed for lag, delay, margin or the draws (1 is the formula's)"
        )
    if body["file"]:
        to.print(f"schedule: {body['file']}", soft_wrap=True)
    else:
        messages().print("nothing was written: add `-o gains.yaml` to verify and export it")


def _render_verify(to: Console, checked: Verification, body: Mapping[str, Any]) -> None:
    from math import degrees

    from rich.text import Text

    to.print(Text(f"{body['verdict']}: {body['says']}", style="bold"), soft_wrap=True)
    to.print(Text(body["rests_on"]), soft_wrap=True)
    to.print()
    small, usual, large = (degrees(step.size) for step in checked.scheduled[0].steps)
    columns = (
        "m/s", "phase", "least", "dB", "delay", "over", "most", f"{small:.0f}", f"{usual:.0f}", "most", f"{large:.0f}", "const",
        "knot",
    )  # fmt: skip
    rows = [_verify_row(a, b) for a, b in zip(checked.scheduled, checked.constant, strict=True)]
    to.print(table("deg, dB, s of margin; overshoot %; s to settle by step in deg", columns, rows, left=0))
    to.print(body["against_constant"], soft_wrap=True)
    bent = max(abs(c.bent_error) for c in checked.scheduled)
    unknown = max(abs(c.bent_error_unknown) for c in checked.scheduled)
    to.print(f"a fin 3 deg off: steady error {degrees(bent):.2f} deg with the feed-forward, {degrees(unknown):.2f} deg without")
    if checked.spread:
        off = max(c.steps[1].off for c in checked.scheduled)
        to.print(f"the trim is known so far that a straight course is held to {degrees(off):.2f} deg by 95 % of the draws")
    if checked.disturbance > 0:
        rms, fin = max(c.leg_rms for c in checked.scheduled), max(c.leg_fin_rms for c in checked.scheduled)
        to.print(f"a straight leg in that disturbance: {degrees(rms):.2f} deg rms with {degrees(fin):.2f} deg rms of fin")
    slowest = min(checked.scheduled, key=lambda c: c.speed_least / c.speed)
    if slowest.speed_least < 0.99 * slowest.speed:
        to.print(f"in the {large:.0f} deg step the speed falls from {slowest.speed:.2f} to {slowest.speed_least:.2f} m/s at most")
    depth = [c for c in checked.scheduled if c.depth_settling == c.depth_settling]
    if depth:
        over, settle = max(100 * c.depth_overshoot for c in depth), max(c.depth_settling for c in depth)
        to.print(f"depth step of 2 m: overshoot up to {over:.0f} %, settled within {settle:.0f} s")
    for gate in body["gates"] if not body["passed"] else ():
        if gate["passed"]:
            to.print(f"passed: {gate['gate']} {gate['found']:.3g}, wanted {gate['wanted']:.3g}")
    if body["figure"]:
        to.print(f"figure: {body['figure']}", soft_wrap=True)


def _verify_row(check: Check, constant: Check) -> tuple[str, ...]:
    from fieldsid.rounding import number

    gain = "none" if check.gain_least_db == float("inf") else f"{check.gain_least_db:.1f}"
    return (
        number(check.speed, 3),
        f"{check.phase_deg:.0f}",
        f"{check.phase_least_deg:.0f}",
        gain,
        f"{check.delay_least_s:.2f}",
        f"{100 * check.overshoot:.0f}",
        f"{100 * check.overshoot_most:.0f}",
        _settles(check.steps[0].settling),
        _settles(check.settling),
        _settles(check.settling_most),
        _settles(check.steps[2].settling),
        _settles(constant.settling),
        "knot" if check.knot else "",
    )


def _settles(seconds: float) -> str:
    return f"{seconds:.1f}" if seconds != float("inf") else "never"


def _render_export(to: Console, body: Mapping[str, Any]) -> None:
    if body["file"]:
        to.print(f"exported: {body['file']}", soft_wrap=True)
    else:
        to.out(body["text"], end="", highlight=False)
