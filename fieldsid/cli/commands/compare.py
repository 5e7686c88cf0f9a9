"""sysid compare: a model against measurement and where it fails; before against after a swap."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.cli import options
from fieldsid.cli.console import Body, emit, gated
from fieldsid.cli.inputs import files_of, fitted_to, model_first, read_ready
from fieldsid.cli.progress import refuse_place
from fieldsid.cli.session import draw_figures
from fieldsid.cli.voice import angles
from fieldsid.errors import UsageError
from fieldsid.figures.sketch import sketch
from fieldsid.logs.several.run_names import short_names
from fieldsid.page import Block, Page, Whole, written
from fieldsid.rounding import DEGREES, number, number_against
from fieldsid.views._words import merit_blocks
from fieldsid.views.comparison import MOST_PLACES, blocks_of, verdict

if TYPE_CHECKING:
    from fieldsid.cli.headlines.headline import Headline
    from fieldsid.cli.skipped_logs import Skips
    from fieldsid.comparison.compare import Comparison
    from fieldsid.logs.run import Note
    from fieldsid.results.comparisons import ComparedRun
    from fieldsid.results.result import OfLogs


class Options(options.ToFolder, options.Part):
    """What `sysid compare` takes."""

    model: Path = options.argument("MODEL", "A model file, the folder of the models before a swap, or gains that were flown.")
    runs: list[Path] = options.argument(
        "RUN...", "Runs or log files, more models before them; or the model or folder after a swap."
    )
    min_fit: float | None = options.option("--min-fit PERCENT", "Gate: exit 1 when a run's angle or rate fit is below this.")
    top: int = options.option("--top", "Conditions to show for each run.", default=MOST_PLACES, min=1)
    output: Path | None = options.option(
        "-o --output PLACE", "Folder for the figures, or the name of one: .png, .svg or .pdf.", options.WRITTEN
    )


@options.takes(Options)
def command(given: Options) -> Body:
    """Compare a model with runs by free simulation, and show where it fails.

    The model is simulated from the run's fin alone; refitted are the initial state, the speed as far as the third of a percent
    that it is taken to be measured to lets it and, where a log rounds the jumps of its command to its samples, when they were
    made. The error of angle and rate is divided by phase, fin angle, rate, speed, heading, side, depth and time, that of the
    one further above its noise first. With `-o` one figure per run is drawn.

    Gains and the runs flown with them: whether each step of the goal went as `schedule verify` said.

    Two models, or two folders of models, and no run: what a swap has changed beyond the models' errors at the speeds that both
    were flown at, and what that does to the gains and the turning radius. Several models and runs: which follows them best.

    Example: sysid compare models/run7_yaw.yaml runs/zigzag.parquet

    Example: sysid compare before/models after/models -o figures/
    """
    from fieldsid.cli.commands._compare_states import compare_states, is_side
    from fieldsid.logs.unknown_file import own_kind

    refuse_place(given.output, force=given.force)
    if own_kind(given.model) == "schedule":
        from fieldsid.cli.commands._promised_steps import compare_steps

        return compare_steps(given.model, given.runs, given.reading)
    sides = [p for p in (given.model, *given.runs) if is_side(p)]
    others = [p for p in given.runs if p not in sides]
    if len(sides) == len(given.runs) + 1 == 2:
        if any(option is not None for option in (*given.reading.values(), given.min_fit)):
            raise UsageError(
                "`--from`, `--to`, `--mapping` and `--min-fit` are for runs", found="two models and no run", hint="leave them out"
            )
        return compare_states(sides[0], sides[1], given.drawn_to, force=given.force)
    if len(sides) > 1 and (not others or any(p.is_dir() for p in sides)):
        named = ", ".join(str(p) for p in (*sides, *others))
        raise UsageError("several models are compared over runs", found=named, hint="sysid compare M1.yaml M2.yaml RUN")
    if len(sides) > 1:
        return _compare_runs(given, sides, others)
    model, runs = model_first(given.model, given.runs)
    return _compare_runs(given, [model], runs)


def _compare_runs(given: Options, paths: Sequence[Path], runs: Sequence[Path]) -> Body:
    """Compare one model or several with runs, print that and return the JSON body."""
    from fieldsid.cli.skipped_logs import Skips
    from fieldsid.models.model import load_model
    from fieldsid.models.record import left_out

    models = [load_model(p) for p in paths]
    if len({m.axis for m in models}) > 1:
        present = ", ".join(f"{p.name}: {m.axis.value}" for p, m in zip(paths, models, strict=True))
        raise UsageError("the models are not of one axis", found=present, hint="compare those of one axis")
    skips, known = Skips(), dict(zip(paths, models, strict=True))
    (logs,) = read_ready([runs], skips, "fieldsid.comparison.compare", known, **given.reading)
    from fieldsid.comparison.compare import compare

    notes, files = left_out(logs, models[0].axis), files_of(logs)
    found, *more = (compare(m, logs, unfit=None if i else skips.skip) for i, m in enumerate(models))
    fitted = [fitted_to(p, m, logs) for p, m in known.items()]
    draw = partial(draw_figures, given.drawn_to, force=given.force)
    if more:
        from fieldsid.cli.commands._compare_several import several_models

        result, page, headline = several_models(paths, [found, *more], fitted, skips, files, draw)
    else:
        result, page, headline = _one_model(paths[0], found, fitted[0], skips, files, notes, draw, given.top)
    body = emit(result, render=page, headline=headline, notes=notes)
    below = _below(body.get("runs") or [run for m in body["models"] for run in m["runs"]], given.min_fit)
    return skips.end(gated(body, below, failed=bool(below)), len(found))


def _one_model(
    model: Path, found: Sequence[Comparison], fitted: Collection[str], skips: Skips, logs: Sequence[Path],
    notes: tuple[Note, ...], draw: Callable[[dict[str, Callable[[], object]]], Sequence[str]], top: int,
) -> tuple[OfLogs, Page, Headline]:  # fmt: skip
    """Return how a model follows the runs, from its comparisons and the runs it was fitted to."""
    from fieldsid.cli.headlines.models import headline_of_compare
    from fieldsid.records.named_inputs import inputs_of
    from fieldsid.results.comparisons import Compared, compared_run

    plots = {f"{model.stem}_on_{c.run}": sketch("compare", c, f"{model.name} on {verdict([c], DEGREES)}") for c in found}
    drawn: Sequence[str | None] = draw(plots) or [None] * len(found)
    compared = tuple(compared_run(c, file, fitted) for c, file in zip(found, drawn, strict=True))
    result = Compared(
        model=str(model), axis=found[0].model.axis, runs=compared, warnings=notes, skipped_runs=tuple(skips.records)
    )
    return result, _page(found, compared, top), headline_of_compare(result, found, logs, inputs_of(model))


def _below(entries: Sequence[Body], least: float | None) -> list[str]:
    """Return a sentence on each run whose angle or rate fit (per cent) is below the least one accepted."""
    if least is None:
        return []
    found = [(e["run"], name, e[f"{name}_fit_percent"]) for e in entries for name in e["over_floor"]]
    return [
        f"gate failed: {run} has {name} fit {number_against(fit, least)} %, below {least:g} %"
        for run, name, fit in found
        if not fit >= least
    ]


def _page(found: Sequence[Comparison], runs: Sequence[ComparedRun], top: int) -> Page:
    units, short = angles(), short_names([c.run for c in found])
    followed = ((short.of(c.run), c.shown.record.speed, c.merit, c.floor) for c in found)
    blocks: list[Block | str] = [*merit_blocks(followed, units), Whole(short.says)]
    for flown in (f for r in runs for f in (r.command_times, r.own_speed) if f is not None):
        angle, rate = (number(units.factor * v, 2) for v in (flown.as_logged.angle_rms_rad, flown.as_logged.rate_rms_rad_s))
        blocks.append(Whole(f"{flown.says}; angle rms {angle}, rate rms {rate} as logged"))
    blocks += [block for c in found for block in blocks_of(c, units, top)]
    return Page("", blocks=tuple(blocks), closing=written(figure=[r.figure for r in runs if r.figure]))
