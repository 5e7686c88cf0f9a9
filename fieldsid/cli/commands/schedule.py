"""sysid schedule: gains per speed: design, verify, export."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fieldsid.cli.console import emit, print_file
from fieldsid.cli.headlines.gains import (
    caveat_of_loops,
    headline_of_design,
    headline_of_export,
    headline_of_patch,
    headline_of_verification,
)
from fieldsid.cli.options import (
    LIMITS,
    FinMax,
    Force,
    ModelFiles,
    OutputFile,
    OwnLaw,
    Speeds,
    Text,
    VehicleFile,
    argument,
    flag,
    option,
)
from fieldsid.cli.progress import refuse_existing, refuse_figure
from fieldsid.cli.session import draw_figure
from fieldsid.cli.voice import angles
from fieldsid.figures.sketch import sketch
from fieldsid.page import Page, written
from fieldsid.views.schedule import blocks_of as design_blocks
from fieldsid.views.verification import blocks_of as verify_blocks

if TYPE_CHECKING:
    from rich.console import Console

    from fieldsid.results.gains import Exported
    from fieldsid.schedule.record import Schedule

command = typer.Typer(
    help="Gains per speed: design them, verify them, write them for the vehicle's software.\n\n"
    "Example: sysid schedule design models/*.yaml -o gains.yaml"
)

RESPONSE = "The answer asked"
ScheduleFile = Annotated[Path, argument("SCHEDULE", "A schedule written by `sysid schedule design`.")]
TARGETS = ", ".join(m.name for m in iter_modules([str(Path(__file__).parents[2] / "exports")]) if not m.name.startswith("_"))


@command.command("design", short_help="Gains per speed from models, a fit file or a table.")
def design(
    models: ModelFiles,
    controller: Annotated[
        Text, option("--controller", "KIND", "p, pd, pi, pid or lqr; pd where the runs have a rate, else p.")
    ] = None,
    settling: Annotated[
        Text, option("--settling", "TIME", "Settle within this, `4s`, or `quickest`; else as the slowest speed can.", RESPONSE)
    ] = None,
    bandwidth: Annotated[Text, option("--bandwidth", "RATE", "Bandwidth in place of a time, `1rad/s`.", RESPONSE)] = None,
    overshoot: Annotated[Text, option("--overshoot", "SHARE", "The most overshoot, `10%`.", RESPONSE)] = None,
    step: Annotated[
        Text, option("--step", "ANGLE", "The error that may ask for the whole fin; else 20 deg of yaw, 10 of pitch.", RESPONSE)
    ] = None,
    fin_use: Annotated[Text, option("--fin-use", "SHARE", "Of the fin that step may ask for, `80%`.", RESPONSE)] = None,
    damping: Annotated[
        float | None, option("--damping", "", "Damping ratio of the loop: that of the overshoot, else 0.7071.", RESPONSE)
    ] = None,
    phase_margin: Annotated[str, option("--phase-margin", "ANGLE", "Phase margin to keep, `45deg`.", RESPONSE)] = "45deg",
    speeds: Speeds = None,
    fin_limit: FinMax = None,
    fin_rate: Annotated[
        Text, option("--fin-rate", "ANGLE", "Fastest fin per s; the vehicle's or model's if not given.", LIMITS)
    ] = None,
    fin_lag: Annotated[Text, option("--fin-lag", "TIME", "Time constant, `0.2s`; the model's if not given.", LIMITS)] = None,
    delay: Annotated[Text, option("--delay", "TIME", "Dead time from command to fin; the model's if not given.", LIMITS)] = None,
    latency: Annotated[
        Text, option("--latency", "TIME", "The autopilot's own, sensor to command, with half its period.", LIMITS)
    ] = None,
    depth: Annotated[bool, flag("--depth", "Add the depth loop above pitch.")] = False,
    law: OwnLaw = None,
    vehicle: VehicleFile = None,
    output: OutputFile = None,
    force: Force = False,
) -> Mapping[str, Any]:
    """Design gains per speed: PD or P with feed-forward, PI, PID, LQR; heading or pitch, by the models' axis.

    Damping and phase margin hold with the fin's lag and delay, half of the margin for 95 % of the draws of the models' errors,
    and a step flown by them comes to rest: with the fin's limits and the speed lost in the turn. With a rate all speeds settle
    alike, each with the least fin that does: as soon as asked, else as the slowest can. P and PI have the damping's gain. Each
    row says what binds it, and what none holds is refused with what is possible. The feed-forward cancels the trim.

    Example: sysid schedule design law.yaml --fin-max 15deg -o gains.yaml
    """
    from fieldsid.angles import FASTEST_FIN, FIN, FIN_RATE, HEADING, TILT, parse_angle, parse_margin
    from fieldsid.cli.inputs import models_among
    from fieldsid.cli.user_effects import read_source
    from fieldsid.face.arguments import vehicle_of
    from fieldsid.face.gains import design_schedule
    from fieldsid.face.quantities import BANDWIDTH, given, parse_quantity, parse_share, parse_time
    from fieldsid.results.gains import Design
    from fieldsid.schedule.record import save_schedule
    from fieldsid.schedule.verdict import left_out_of
    from fieldsid.schedule.wish import QUICKEST

    refuse_existing(output, force=force)
    limit, known = given(fin_limit, parse_angle, "--fin-max", FIN), vehicle_of(vehicle)
    fastest = given(fin_rate, parse_angle, "--fin-rate", FIN_RATE, FASTEST_FIN)
    margin = parse_margin(phase_margin, "--phase-margin")
    models = models_among(models)
    source = read_source(models, law or ())
    schedule = design_schedule(
        source,
        controller=controller,
        settling=QUICKEST if settling == "quickest" else given(settling, parse_time, "--settling", "4s"),
        bandwidth=given(bandwidth, parse_quantity, "--bandwidth", BANDWIDTH, "1rad/s"),
        overshoot=given(overshoot, parse_share, "--overshoot"),
        step=given(step, parse_angle, "--step", TILT, HEADING),
        fin_use=given(fin_use, parse_share, "--fin-use"),
        damping=damping,
        phase_margin=margin,
        speeds=speeds,
        fin_limit=limit,
        fin_rate=fastest,
        fin_lag=given(fin_lag, parse_time, "--fin-lag"),
        delay=given(delay, parse_time, "--delay"),
        latency=given(latency, parse_time, "--latency"),
        depth=depth,
        vehicle=known,
    )
    inputs = [p for p in source.paths if p.is_file()]
    written_to = None if output is None else str(save_schedule(schedule, output, inputs=inputs, force=force))
    result = Design(schedule, written_to)
    headline = headline_of_design(result, models, caveat_of_loops(source.models, models))
    page = Page("", blocks=tuple(design_blocks(schedule, angles(), left_out_of(source))), closing=written(schedule=written_to))
    return emit(result, render=page, headline=headline, notes=schedule.notes)


@command.command("verify", short_help="Margins and steps over the identified set.")
def verify(
    schedule: ScheduleFile,
    models: Annotated[
        list[Path] | None, option("--model", "MODEL", "Models to verify on; those it was designed from if not given.")
    ] = None,
    require_phase_margin: Annotated[
        Text, option("--require-phase-margin", "ANGLE", "Exit 1 when any speed has less, `40deg`.")
    ] = None,
    require_gain_margin: Annotated[Text, option("--require-gain-margin", "DB", "Exit 1 when any speed has less, `6dB`.")] = None,
    require_delay_margin: Annotated[
        Text, option("--require-delay-margin", "TIME", "Exit 1 when any speed has less, `0.3s`.")
    ] = None,
    max_overshoot: Annotated[Text, option("--max-overshoot", "SHARE", "Exit 1 when any step has more, `20%`.")] = None,
    output: Annotated[Path | None, option("-o --output", "FILE", "Draw a figure: .png, .svg or .pdf, by the suffix.")] = None,
    force: Force = False,
) -> Mapping[str, Any]:
    """Check a schedule at its knots and between, over the errors of the models, against the best one gain for all speeds.

    The first line is the verdict, the second what it rests on. Margins; steps of three sizes flown with the
    fin's limit, rate, lag and delay, the hull's drag in the turn and the speed lost in it; a straight leg in the disturbance of
    the models' runs. The least and the most are over 95 % of the draws. A gate that fails makes the exit code 1. With `-o FILE` a
    figure is drawn.

    Example: sysid schedule verify gains.yaml --require-phase-margin 40 -o gains.png
    """
    from fieldsid.angles import parse_margin
    from fieldsid.cli.user_effects import read_source
    from fieldsid.face.arguments import designed_from
    from fieldsid.face.gains import verify_schedule
    from fieldsid.face.quantities import DECIBEL, given, parse_quantity, parse_share, parse_time
    from fieldsid.results.gains import Verified
    from fieldsid.schedule.linear_plant import not_counted
    from fieldsid.schedule.record import load_schedule
    from fieldsid.schedule.verdict import against_constant, gates_of, rests_on, verdict_of

    refuse_figure(output, force=force)
    least = given(require_phase_margin, parse_margin, "--require-phase-margin")
    known = load_schedule(schedule)
    source = read_source(models or designed_from(known, str(schedule)))
    checked = verify_schedule(known, source)
    gain = given(require_gain_margin, parse_quantity, "--require-gain-margin", DECIBEL, "6dB")
    delay = given(require_delay_margin, parse_time, "--require-delay-margin", "0.3s")
    most = given(max_overshoot, parse_share, "--max-overshoot")
    wanted = (least, gain, delay, most and 100.0 * most)
    gates = gates_of(checked, dict(zip(checked.worst, wanted, strict=True)))
    verdict, says = verdict_of(checked, known, gates)
    result = Verified(
        verdict=verdict,
        says=says,
        rests_on=rests_on(checked, known, source),
        not_counted=not_counted(source.models),
        against_constant=against_constant(checked),
        constant_gains=checked.constant_row.gains,
        axis=known.axis,
        controller=known.kind,
        worst=checked.worst,
        checked=checked,
        gates=gates,
        figure=draw_figure(output, sketch("schedule", known, checked), force=force),
    )
    caveat = caveat_of_loops(source.models, source.paths)
    headline = headline_of_verification(result, schedule, known, models or source.paths, caveat)
    gates_said = (f"passed: {g.name} {g.found:.3g}, wanted {g.wanted:.3g}" for g in gates if g.passed and not result.passed)
    page = Page("", blocks=(*verify_blocks(checked), *gates_said), closing=written(figure=result.figure))
    body = emit(result, render=page, headline=headline)
    if not result.passed:
        raise typer.Exit(1)
    return body


@command.command("export", short_help="Write the gains for the vehicle's software.")
def export(
    schedule: ScheduleFile,
    to: Annotated[str, option("--to", "TARGET", f"One of {TARGETS}.")] = "yaml",
    node: Annotated[Text, option("--node", "NAME", "What the gains go under: node, section, prefix or process.")] = None,
    template: Annotated[Path | None, option("--template", "FILE", "A template of your own, see templates/exports/.")] = None,
    into: Annotated[Path | None, option("--into", "YAML", "An existing YAML file to put the gains into.")] = None,
    key: Annotated[Text, option("--key", "A.B.C", "The key in that file that holds the gains.")] = None,
    write: Annotated[bool, flag("--write", "Change the file of `--into` (a backup is kept), not only show how.")] = False,
    output: OutputFile = None,
    force: Force = False,
) -> Mapping[str, Any]:
    """Write a schedule as the vehicle's software reads it; to stdout without `-o`.

    `--into FILE --key A.B.C` shows how an existing YAML file would change, comments and order kept, and changes it only with
    `--write`. A file that is changed, or replaced by `-o FILE --force`, is kept as it was as .bak, and the difference is shown.

    Example: sysid schedule export gains.yaml --to ros2 -o heading.yaml
    """
    from fieldsid.errors import UsageError
    from fieldsid.exports import pick_target
    from fieldsid.results.gains import Exported
    from fieldsid.schedule.record import load_schedule

    known = load_schedule(schedule)
    if (into is None) != (key is None):
        raise UsageError(
            "`--into` and `--key` go together", found=f"into {into}, key {key}", hint="`--into vehicle.yaml --key a.b.c`"
        )
    if into is not None and key is not None:
        return _export_into(known, schedule, into, key, write=write)
    target = pick_target(to)
    text = target.render(known, node or target.node, template)
    result = Exported(target.name, text, *(() if output is None else _write_export(output, text, force=force)))
    headline, is_file = headline_of_export(result, schedule), result.file is None
    return emit(result, render=lambda out: _render_export(out, result), headline=headline, is_file=is_file)


def _write_export(output: Path, text: str, *, force: bool) -> tuple[str, str, str | None]:
    """Write an export and return its file; where it replaces one, the difference and the file of the backup too."""
    from fieldsid.artifacts import write_text
    from fieldsid.exports._patch import patch_text, write_patch

    if not (force and output.is_file()):
        return str(write_text(output, text, force=force)), "", None
    patch = patch_text(output, text)
    backup = str(write_patch(patch)) if patch.difference else None
    return str(output), patch.difference, backup


def _export_into(known: Schedule, schedule: Path, into: Path, key: str, *, write: bool) -> Mapping[str, Any]:
    from fieldsid.exports._patch import patch_yaml, write_patch
    from fieldsid.exports._target import columns_of
    from fieldsid.results.gains import Exported

    patch = patch_yaml(into, key, columns_of(known))
    backup = str(write_patch(patch)) if write else None
    result = Exported("into", None, str(into), patch.difference, backup)
    headline = headline_of_patch(result, schedule, key)
    return emit(result, render=lambda out: print_file(out, patch.difference), headline=headline, is_file=not write)


def _render_export(to: Console, result: Exported) -> None:
    """Print the text of an export; where it was written to a file, how that file has changed, and its name."""
    print_file(to, result.difference if result.file else result.text or "")
    if result.file:
        to.print(f"exported: {result.file}" + (f"; as it was: {result.backup}" if result.backup else ""), soft_wrap=True)
