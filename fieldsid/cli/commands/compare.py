"""sysid compare: a model against measurement and where it fails; before against after a swap."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fieldsid.cli.commands._other_data import fitted_to
from fieldsid.cli.console import complain, emit, table
from fieldsid.cli.options import FigurePlace, Figures, Force, FromS, JsonFlag, MappingFile, ToS, argument, option
from fieldsid.cli.progress import get_ready, refuse_place
from fieldsid.cli.session import drawing
from fieldsid.cli.voice import shown_in, shown_words
from fieldsid.errors import UsageError

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from fieldsid.comparison.compare import Comparison
    from fieldsid.models.model import Model

MOST_SHOWN = 6

First = Annotated[Path, argument("MODEL", "A model file, the folder of the models before a swap, or gains that were flown.")]
Others = Annotated[
    list[Path], argument("RUN...", "Runs or log files, more models before them; or the model or folder after a swap.")
]

MinFit = Annotated[float | None, option("--min-fit", "PERCENT", "Gate: exit 1 when a run's angle or rate fit is below this.")]
Top = Annotated[int, option("--top", "", "Conditions to show for each run.", min=1)]


def command(
    context: typer.Context,
    model: First,
    runs: Others,
    start: FromS = None,
    end: ToS = None,
    mapping: MappingFile = None,
    min_fit: MinFit = None,
    top: Top = MOST_SHOWN,
    output: FigurePlace = None,
    figures: Figures = True,
    force: Force = False,
    as_json: JsonFlag = False,
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
    from fieldsid.cli.commands._before_after import before_after, is_side

    refuse_place(output, force=force)
    from fieldsid.logs.unknown_file import own_kind

    if own_kind(model) == "schedule":
        from fieldsid.cli.commands._as_promised import as_promised

        return as_promised(model, runs, {"mapping": mapping, "start": start, "end": end}, as_json=as_json)
    sides = [p for p in (model, *runs) if is_side(p)]
    if len(sides) == len(runs) + 1 == 2:
        _refuse_part(start, end, mapping, min_fit)
        return before_after(sides[0], sides[1], output, figures=figures, force=force, as_json=as_json)
    from fieldsid.cli.inputs import model_first, read_runs
    from fieldsid.cli.skipped_logs import Skips
    from fieldsid.cli.user_effects import check_effects
    from fieldsid.models.model import load_model
    from fieldsid.models.record import left_out

    if len(sides) > 1:
        return _several(
            sides,
            [p for p in runs if p not in sides],
            start,
            end,
            mapping,
            min_fit,
            output if figures else None,
            force=force,
            as_json=as_json,
        )
    model, runs = model_first(model, runs)
    known = load_model(model)
    skips, ready = Skips(), partial(get_ready, "fieldsid.comparison.compare")
    effects = partial(check_effects, [(model, known)])
    logs = read_runs(runs, mapping=mapping, start=start, end=end, check=effects, meanwhile=ready, refused=skips.skip)
    from fieldsid.comparison.compare import compare
    from fieldsid.records.keys import body_of
    from fieldsid.results.comparisons import Compared, compared_run

    found = compare(known, logs, unfit=skips.skip)
    drawn = _drawn(known, model, found, output if figures else None, context, force=force)
    fitted = fitted_to(model, known, logs)
    compared = tuple(compared_run(c, figure, fitted) for c, figure in zip(found, drawn, strict=True))
    notes = left_out(logs, known.axis)
    body = body_of(Compared(model=str(model), axis=known.axis, runs=compared, warnings=notes, skipped_runs=tuple(skips.records)))
    entries = body["runs"]
    from fieldsid.cli.headlines.models import of_compare
    from fieldsid.cli.inputs import files_of
    from fieldsid.records.named_inputs import inputs_of

    headline = of_compare(body, files_of(logs), inputs_of(model))
    result = emit(body, as_json=as_json, render=lambda to: _render(to, entries, top), headline=headline, notes=notes)
    _gate(entries, min_fit)
    skips.end(len(entries))
    return result


def _refuse_part(*given: object) -> None:
    """Refuse options that are for runs, where there is none."""
    if any(g is not None for g in given):
        raise UsageError(
            "`--from`, `--to`, `--mapping` and `--min-fit` are for runs", found="two models and no run", hint="leave them out"
        )


def _several(
    models: Sequence[Path],
    runs: Sequence[Path],
    start: float | None,
    end: float | None,
    mapping: Path | None,
    min_fit: float | None,
    output: Path | None,
    *,
    force: bool,
    as_json: bool,
) -> Mapping[str, Any]:
    from fieldsid.cli.commands._several_models import several_models
    from fieldsid.cli.skipped_logs import Skips

    if not runs or any(p.is_dir() for p in models):
        found = ", ".join(str(p) for p in (*models, *runs))
        raise UsageError("several models are compared over runs", found=found, hint="sysid compare M1.yaml M2.yaml RUN")
    reading = {"mapping": mapping, "start": start, "end": end}
    body = several_models(models, runs, Skips(), reading=reading, output=output, force=force, as_json=as_json)
    for m in body["models"]:
        _gate(m["runs"], min_fit)
    return body


def _gate(entries: Sequence[Mapping[str, Any]], least: float | None) -> None:
    found = [(e["run"], name, e[f"{name}_fit_percent"]) for e in entries for name in e["over_floor"]]
    failed = [(run, name, fit) for run, name, fit in found if least is not None and not fit >= least]
    for run, name, fit in failed:
        complain(f"gate failed: {run} has {name} fit {fit:.1f} %, below {least:g} %")
    if failed:
        raise typer.Exit(1)


def _drawn(
    model: Model, name: Path, found: Sequence[Comparison], folder: Path | None, context: typer.Context, *, force: bool
) -> list[str | None]:
    if folder is None:
        return [None] * len(found)
    from fieldsid.figures.canvas import save
    from fieldsid.figures.compare import figure
    from fieldsid.figures.kinds import figure_at

    alone = len(found) == 1
    with drawing(context) as own:
        return [
            str(
                save(
                    figure(c, model, name.name),
                    figure_at(folder, f"{name.stem}_on_{c.run}", is_one=alone),
                    force=force,
                    tasks=own,
                )
            )
            for c in found
        ]


def _render(to: Console, entries: Sequence[Mapping[str, Any]], top: int) -> None:
    from fieldsid.rounding import number

    times, angle = shown_in("rad")
    rows = [
        (
            e["run"],
            number(e["speed_m_s"], 3),
            number(times * e["angle_rms_rad"], 2),
            number(times * e["noise_floor"]["angle_rad"], 2),
            number(e["angle_fit_percent"], 3),
            number(times * e["rate_rms_rad_s"], 2),
            number(times * e["noise_floor"]["rate_rad_s"], 2),
            number(e["rate_fit_percent"], 3),
        )
        for e in entries
    ]
    to.print(table("", ("run", "m/s", "angle rms", "noise", "fit %", "rate rms", "noise", "fit %"), rows))
    to.print(f"angle in {angle}, rate in {angle}/s")
    for e in entries:
        for flown in filter(None, (e["command_times"], e["own_speed"])):
            logged = [number(times * flown["as_logged"][name], 2) for name in ("angle_rms_rad", "rate_rms_rad_s")]
            to.print(f"{flown['says']}; angle rms {logged[0]}, rate rms {logged[1]} as logged", soft_wrap=True)
    for e in entries:
        _render_where(to, e, top)
    for e in entries:
        if e["figure"]:
            to.print(f"figure: {e['figure']}", soft_wrap=True)


def _render_where(to: Console, e: Mapping[str, Any], top: int) -> None:
    """Say where each channel fails, the worse one first, and which are down to their noise."""
    from fieldsid.comparison.compare import left_in_words

    over, failing = e["over_floor"], e["failing"]
    for fault in failing:
        name = fault["channel"]
        to.print()
        how = left_in_words(over[name], e[f"{name}_fit_percent"])
        to.print(_places(f"{e['run']}: where the {name} fails, {how}", fault["where"][:top]))
    quiet = [f"{name} {ratio:.2f} x" for name, ratio in over.items() if name not in {f["channel"] for f in failing}]
    if quiet:
        if not failing:
            to.print()
        pooled = "" if failing else f", {e['over_noise']:.2f} x"
        to.print(f"{e['run']}: down to the noise{pooled}: {', '.join(quiet)}", soft_wrap=True)
    if e["moves_with"]:
        said = ", ".join(f"{m['signal']} ({100 * m['explained']:.0f} %)" for m in e["moves_with"][:3])
        to.print(f"the missing moment moves with {said}")


def _places(title: str, where: Sequence[Mapping[str, Any]]) -> Table:
    rows = [
        (
            shown_words(w["condition"]),
            f"{100 * w['share_of_error']:.0f} %",
            f"{100 * w['share_of_samples']:.0f} %",
            f"{w['rms_ratio']:.2f}",
            f"{w['t_start_s']:.1f} .. {w['t_end_s']:.1f}",
        )
        for w in where
    ]
    return table(title, ("", "of error", "of time", "rms ratio", "worst, s"), rows)
