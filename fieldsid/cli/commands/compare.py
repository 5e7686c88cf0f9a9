"""sysid compare: a model against measurement and where it fails; before against after a swap."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fieldsid.cli.console import complain, emit
from fieldsid.cli.inputs import fitted_to
from fieldsid.cli.options import FigurePlace, Figures, Force, FromS, MappingFile, ToS, argument, option
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
    from fieldsid.comparison.compare import Comparison
    from fieldsid.results.comparisons import ComparedRun


def command(
    model: Annotated[Path, argument("MODEL", "A model file, the folder of the models before a swap, or gains that were flown.")],
    runs: Annotated[
        list[Path], argument("RUN...", "Runs or log files, more models before them; or the model or folder after a swap.")
    ],
    start: FromS = None,
    end: ToS = None,
    mapping: MappingFile = None,
    min_fit: Annotated[
        float | None, option("--min-fit", "PERCENT", "Gate: exit 1 when a run's angle or rate fit is below this.")
    ] = None,
    top: Annotated[int, option("--top", "", "Conditions to show for each run.", min=1)] = MOST_PLACES,
    output: FigurePlace = None,
    figures: Figures = True,
    force: Force = False,
) -> Mapping[str, Any]:
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

    refuse_place(output, force=force)
    from fieldsid.logs.unknown_file import own_kind

    reading: dict[str, Any] = {"mapping": mapping, "start": start, "end": end}
    if own_kind(model) == "schedule":
        from fieldsid.cli.commands._promised_steps import compare_steps

        return compare_steps(model, runs, reading)
    sides = [p for p in (model, *runs) if is_side(p)]
    others, output = [p for p in runs if p not in sides], output if figures else None
    if len(sides) == len(runs) + 1 == 2:
        if any(option is not None for option in (start, end, mapping, min_fit)):
            raise UsageError(
                "`--from`, `--to`, `--mapping` and `--min-fit` are for runs", found="two models and no run", hint="leave them out"
            )
        return compare_states(sides[0], sides[1], output, force=force)
    if len(sides) > 1 and (not others or any(p.is_dir() for p in sides)):
        given = ", ".join(str(p) for p in (*sides, *others))
        raise UsageError("several models are compared over runs", found=given, hint="sysid compare M1.yaml M2.yaml RUN")
    from fieldsid.cli.inputs import files_of, model_first, read_ready
    from fieldsid.cli.skipped_logs import Skips
    from fieldsid.models.model import load_model
    from fieldsid.models.record import left_out

    model, runs = model_first(model, runs)
    paths, runs = (sides, others) if len(sides) > 1 else ([model], runs)
    models = [load_model(p) for p in paths]
    if len({m.axis for m in models}) > 1:
        present = ", ".join(f"{p.name}: {m.axis.value}" for p, m in zip(paths, models, strict=True))
        raise UsageError("the models are not of one axis", found=present, hint="compare those of one axis")
    skips, known = Skips(), dict(zip(paths, models, strict=True))
    (logs,) = read_ready([runs], skips, "fieldsid.comparison.compare", known, **reading)
    from fieldsid.comparison.compare import compare
    from fieldsid.records.named_inputs import inputs_of
    from fieldsid.results.comparisons import Compared, compared_run

    notes, files = left_out(logs, models[0].axis), files_of(logs)
    found, *more = (compare(m, logs, unfit=None if i else skips.skip) for i, m in enumerate(models))
    fitted = [fitted_to(p, m, logs) for p, m in zip(paths, models, strict=True)]
    if more:
        from fieldsid.cli.commands._compare_several import several_models

        draw = partial(draw_figures, output, force=force)
        several, page, headline = several_models(paths, [found, *more], fitted, skips, files, draw)
        body = emit(several, render=page, headline=headline, notes=notes)
        _gate([run for m in body["models"] for run in m["runs"]], min_fit)
        return skips.end(body, len(found))
    plots = {f"{model.stem}_on_{c.run}": sketch("compare", c, f"{model.name} on {verdict([c], DEGREES)}") for c in found}
    drawn: Sequence[str | None] = draw_figures(output, plots, force=force) or [None] * len(found)
    compared = tuple(compared_run(c, file, fitted[0]) for c, file in zip(found, drawn, strict=True))
    axis, skipped = models[0].axis, tuple(skips.records)
    result = Compared(model=str(model), axis=axis, runs=compared, warnings=notes, skipped_runs=skipped)
    from fieldsid.cli.headlines.models import headline_of_compare

    headline = headline_of_compare(result, found, files, inputs_of(model))
    body = emit(result, render=_page(found, compared, top), headline=headline, notes=notes)
    _gate(body["runs"], min_fit)
    return skips.end(body, len(compared))


def _gate(entries: Sequence[Mapping[str, Any]], least: float | None) -> None:
    """End the command with exit code 1 where a run's angle or rate fit (per cent) is below the least one accepted."""
    if least is None:
        return
    found = [(e["run"], name, e[f"{name}_fit_percent"]) for e in entries for name in e["over_floor"]]
    failed = [(run, name, fit) for run, name, fit in found if not fit >= least]
    for run, name, fit in failed:
        complain(f"gate failed: {run} has {name} fit {number_against(fit, least)} %, below {least:g} %")
    if failed:
        raise typer.Exit(1)


def _page(found: Sequence[Comparison], runs: Sequence[ComparedRun], top: int) -> Page:
    units, short = angles(), short_names([c.run for c in found])
    followed = ((short.of(c.run), c.shown.record.speed, c.merit, c.floor) for c in found)
    blocks: list[Block | str] = [*merit_blocks(followed, units), Whole(short.says)]
    for flown in (f for r in runs for f in (r.command_times, r.own_speed) if f is not None):
        angle, rate = (number(units.factor * v, 2) for v in (flown.as_logged.angle_rms_rad, flown.as_logged.rate_rms_rad_s))
        blocks.append(Whole(f"{flown.says}; angle rms {angle}, rate rms {rate} as logged"))
    blocks += [block for c in found for block in blocks_of(c, units, top)]
    return Page("", blocks=tuple(blocks), closing=written(figure=[r.figure for r in runs if r.figure]))
