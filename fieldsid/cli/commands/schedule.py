"""sysid schedule: gains per speed: design, verify, export."""

from __future__ import annotations

from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING

import typer

from fieldsid.angles import FASTEST_FIN, FIN_RATE, HEADING, TILT, parse_angle, parse_margin
from fieldsid.artifacts import write_text
from fieldsid.cli import options
from fieldsid.cli.console import Body, emit, gated, print_file
from fieldsid.cli.headlines import gains as headlines
from fieldsid.cli.inputs import models_among
from fieldsid.cli.options import LIMITS, Text, argument, arguments_of, flag, option, takes
from fieldsid.cli.progress import refuse_existing, refuse_figure
from fieldsid.cli.session import draw_figure
from fieldsid.cli.voice import angles
from fieldsid.errors import UsageError
from fieldsid.face.quantities import BANDWIDTH, DECIBEL, parse_quantity, parse_share, parse_time
from fieldsid.figures.sketch import sketch
from fieldsid.page import Page, written
from fieldsid.schedule.record import Schedule, load_schedule, save_schedule
from fieldsid.schedule.wish import QUICKEST
from fieldsid.views.schedule import blocks_of as design_blocks
from fieldsid.views.verification import blocks_of as verify_blocks

if TYPE_CHECKING:
    from rich.console import Console

    from fieldsid.results.gains import Exported

command = typer.Typer(
    help="Gains per speed: design them, verify them, write them for the vehicle's software.\n\n"
    "Example: sysid schedule design models/*.yaml -o gains.yaml"
)

RESPONSE = "The answer asked"
SCHEDULE = argument("SCHEDULE", "A schedule written by `sysid schedule design`.")
TARGETS = ", ".join(m.name for m in iter_modules([str(Path(__file__).parents[2] / "exports")]) if not m.name.startswith("_"))


def _settling(text: str, option: str) -> float:
    """Return the settling time in s, that of the quickest response for `quickest`; raises UsageError."""
    return QUICKEST if text == "quickest" else parse_time(text, option, "4s")


class DesignOptions(options.ToFile, options.OfVehicle, options.Models):
    """What `sysid schedule design` takes."""

    controller: Text = option("--controller KIND", "p, pd, pi, pid or lqr; pd where the runs have a rate, else p.")
    settling: float | None = option(
        "--settling TIME", "Settle within this, `4s`, or `quickest`; else as the slowest speed can.", RESPONSE, parse=(_settling,)
    )
    bandwidth: float | None = option(
        "--bandwidth RATE", "Bandwidth in place of a time, `1rad/s`.", RESPONSE, parse=(parse_quantity, BANDWIDTH, "1rad/s")
    )
    overshoot: float | None = option("--overshoot SHARE", "The most overshoot, `10%`.", RESPONSE, parse=(parse_share,))
    step: float | None = option(
        "--step ANGLE", "The error that may ask for the whole fin; else 20 deg of yaw, 10 of pitch.", RESPONSE,
        parse=(parse_angle, TILT, HEADING),
    )  # fmt: skip
    fin_use: float | None = option("--fin-use SHARE", "Of the fin that step may ask for, `80%`.", RESPONSE, parse=(parse_share,))
    damping: float | None = option("--damping", "Damping ratio of the loop: that of the overshoot, else 0.7071.", RESPONSE)
    phase_margin: float = option(
        "--phase-margin ANGLE", "Phase margin to keep, `45deg`.", RESPONSE, default="45deg", parse=(parse_margin,)
    )
    speeds: Text = options.SPEEDS
    fin_limit: float | None = options.FIN_MAX
    fin_rate: float | None = option(
        "--fin-rate ANGLE", "Fastest fin per s; the vehicle's or model's if not given.", LIMITS,
        parse=(parse_angle, FIN_RATE, FASTEST_FIN),
    )  # fmt: skip
    fin_lag: float | None = option(
        "--fin-lag TIME", "Time constant, `0.2s`; the model's if not given.", LIMITS, parse=(parse_time,)
    )
    delay: float | None = option(
        "--delay TIME", "Dead time from command to fin; the model's if not given.", LIMITS, parse=(parse_time,)
    )
    latency: float | None = option(
        "--latency TIME", "The autopilot's own, sensor to command, with half its period.", LIMITS, parse=(parse_time,)
    )
    depth: bool = flag("--depth", "Add the depth loop above pitch.")
    law: list[str] | None = options.LAW


@command.command("design", short_help="Gains per speed from models, a fit file or a table.")
@takes(DesignOptions)
def design(given: DesignOptions) -> Body:
    """Design gains per speed: PD or P with feed-forward, PI, PID, LQR; heading or pitch, by the models' axis.

    Damping and phase margin hold with the fin's lag and delay, half of the margin for 95 % of the draws of the models' errors,
    and a step flown by them comes to rest: with the fin's limits and the speed lost in the turn. With a rate all speeds settle
    alike, each with the least fin that does: as soon as asked, else as the slowest can. P and PI have the damping's gain. Each
    row says what binds it, and what none holds is refused with what is possible. The feed-forward cancels the trim.

    Example: sysid schedule design law.yaml --fin-max 15deg -o gains.yaml
    """
    from fieldsid.cli.user_effects import read_source
    from fieldsid.face.gains import design_schedule
    from fieldsid.results.gains import Design
    from fieldsid.schedule.verdict import left_out_of

    refuse_existing(given.output, force=given.force)
    models = models_among(given.models)
    source = read_source(models, given.law or ())
    schedule = design_schedule(**arguments_of(design_schedule, given, models=source))
    inputs = [p for p in source.paths if p.is_file()]
    file = None if given.output is None else str(save_schedule(schedule, given.output, inputs=inputs, force=given.force))
    result = Design(schedule, file)
    headline = headlines.headline_of_design(result, models, headlines.caveat_of_loops(source.models, models))
    page = Page("", blocks=tuple(design_blocks(schedule, angles(), left_out_of(source))), closing=written(schedule=file))
    return emit(result, render=page, headline=headline, notes=schedule.notes)


class VerifyOptions(options.Options):
    """What `sysid schedule verify` takes."""

    schedule: Path = SCHEDULE
    models: options.Paths = option("--model MODEL", "Models to verify on; those it was designed from if not given.")
    require_phase_margin: float | None = option(
        "--require-phase-margin ANGLE", "Exit 1 when any speed has less, `40deg`.", parse=(parse_margin,)
    )
    require_gain_margin: float | None = option(
        "--require-gain-margin DB", "Exit 1 when any speed has less, `6dB`.", parse=(parse_quantity, DECIBEL, "6dB")
    )
    require_delay_margin: float | None = option(
        "--require-delay-margin TIME", "Exit 1 when any speed has less, `0.3s`.", parse=(parse_time, "0.3s")
    )
    max_overshoot: float | None = option("--max-overshoot SHARE", "Exit 1 when any step has more, `20%`.", parse=(parse_share,))
    output: Path | None = option("-o --output FILE", "Draw a figure: .png, .svg or .pdf, by the suffix.")
    force: bool = options.FORCE

    @property
    def wanted(self) -> tuple[float | None, ...]:
        """The limits of the gates: phase margin in deg, gain margin in dB, delay margin in s, overshoot in per cent."""
        most = self.max_overshoot and 100.0 * self.max_overshoot
        return self.require_phase_margin, self.require_gain_margin, self.require_delay_margin, most


@command.command("verify", short_help="Margins and steps over the identified set.")
@takes(VerifyOptions)
def verify(given: VerifyOptions) -> Body:
    """Check a schedule at its knots and between, over the errors of the models, against the best one gain for all speeds.

    The first line is the verdict, the second what it rests on. Margins; steps of three sizes flown with the
    fin's limit, rate, lag and delay, the hull's drag in the turn and the speed lost in it; a straight leg in the disturbance of
    the models' runs. The least and the most are over 95 % of the draws. A gate that fails makes the exit code 1. With `-o FILE` a
    figure is drawn.

    Example: sysid schedule verify gains.yaml --require-phase-margin 40 -o gains.png
    """
    from fieldsid.cli.user_effects import read_source
    from fieldsid.face.arguments import designed_from
    from fieldsid.face.gains import verify_schedule
    from fieldsid.results.gains import verified
    from fieldsid.schedule.verdict import gates_of

    refuse_figure(given.output, force=given.force)
    known = load_schedule(given.schedule)
    source = read_source(given.models or designed_from(known, str(given.schedule)))
    checked = verify_schedule(known, source)
    gates = gates_of(checked, dict(zip(checked.worst, given.wanted, strict=True)))
    figure = draw_figure(given.output, sketch("schedule", known, checked), force=given.force)
    result = verified(checked, source, gates, figure)
    caveat = headlines.caveat_of_loops(source.models, source.paths)
    headline = headlines.headline_of_verification(result, given.schedule, known, given.models or source.paths, caveat)
    gates_said = (f"passed: {g.name} {g.found:.3g}, wanted {g.wanted:.3g}" for g in gates if g.passed and not result.passed)
    page = Page("", blocks=(*verify_blocks(checked), *gates_said), closing=written(figure=figure))
    return gated(emit(result, render=page, headline=headline), failed=not result.passed)


class ExportOptions(options.ToFile):
    """What `sysid schedule export` takes."""

    schedule: Path = SCHEDULE
    to: str = option("--to TARGET", f"One of {TARGETS}.", default="yaml")
    node: Text = option("--node NAME", "What the gains go under: node, section, prefix or process.")
    template: Path | None = option("--template FILE", "A template of your own, see templates/exports/.")
    into: Path | None = option("--into YAML", "An existing YAML file to put the gains into.")
    key: Text = option("--key A.B.C", "The key in that file that holds the gains.")
    write: bool = flag("--write", "Change the file of `--into` (a backup is kept), not only show how.")


@command.command("export", short_help="Write the gains for the vehicle's software.")
@takes(ExportOptions)
def export(given: ExportOptions) -> Body:
    """Write a schedule as the vehicle's software reads it; to stdout without `-o`.

    `--into FILE --key A.B.C` shows how an existing YAML file would change, comments and order kept, and changes it only with
    `--write`. A file that is changed, or replaced by `-o FILE --force`, is kept as it was as .bak, and the difference is shown.

    Example: sysid schedule export gains.yaml --to ros2 -o heading.yaml
    """
    from fieldsid.exports import pick_target
    from fieldsid.results.gains import Exported

    schedule, into, key = given.schedule, given.into, given.key
    known = load_schedule(schedule)
    if (into is None) != (key is None):
        raise UsageError(
            "`--into` and `--key` go together", found=f"into {into}, key {key}", hint="`--into vehicle.yaml --key a.b.c`"
        )
    if into is not None and key is not None:
        return _export_into(known, schedule, into, key, write=given.write)
    target = pick_target(given.to)
    text = target.render(known, given.node or target.node, given.template)
    result = Exported(target.name, text, *(() if given.output is None else _write_export(given.output, text, force=given.force)))
    headline, is_file = headlines.headline_of_export(result, schedule), result.file is None
    return emit(result, render=lambda out: _render_export(out, result), headline=headline, is_file=is_file)


def _write_export(output: Path, text: str, *, force: bool) -> tuple[str, str, str | None]:
    """Write an export and return its file; where it replaces one, the difference and the file of the backup too."""
    from fieldsid.exports._patch import patch_text, write_patch

    if not (force and output.is_file()):
        return str(write_text(output, text, force=force)), "", None
    patch = patch_text(output, text)
    backup = str(write_patch(patch)) if patch.difference else None
    return str(output), patch.difference, backup


def _export_into(known: Schedule, schedule: Path, into: Path, key: str, *, write: bool) -> Body:
    from fieldsid.exports._patch import patch_yaml, write_patch
    from fieldsid.exports._target import columns_of
    from fieldsid.results.gains import Exported

    patch = patch_yaml(into, key, columns_of(known))
    backup = str(write_patch(patch)) if write else None
    result = Exported("into", None, str(into), patch.difference, backup)
    headline = headlines.headline_of_patch(result, schedule, key)
    return emit(result, render=lambda out: print_file(out, patch.difference), headline=headline, is_file=not write)


def _render_export(to: Console, result: Exported) -> None:
    """Print the text of an export; where it was written to a file, how that file has changed, and its name."""
    print_file(to, result.difference if result.file else result.text or "")
    if result.file:
        to.print(f"exported: {result.file}" + (f"; as it was: {result.backup}" if result.backup else ""), soft_wrap=True)
