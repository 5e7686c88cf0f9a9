"""sysid identify: the parameters of the yaw or pitch model, with honest error bars."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fieldsid.cli.console import alike, emit, progress, table
from fieldsid.cli.options import (
    Bandwidth,
    EffectNames,
    ExcitedAxis,
    Figures,
    Force,
    FromS,
    JsonFlag,
    MappingFile,
    Method,
    OutputDir,
    RunFiles,
    ToS,
    VehicleFile,
    flag,
    names_of,
    option,
)
from fieldsid.cli.progress import compiling_first, get_ready, refuse_closed
from fieldsid.cli.session import drawing
from fieldsid.cli.voice import shown_estimate, shown_in
from fieldsid.logs.run import Note
from fieldsid.records.keys import body_of

if TYPE_CHECKING:
    from rich.console import Console

    from fieldsid.fitting.fit import Fit
    from fieldsid.results.fits import FittedModel
    from fieldsid.runtime.background_tasks import BackgroundTasks

Joint = Annotated[bool, flag("--joint", "One model for all runs: damping and trim shared, authority by speed.")]
Whole = Annotated[bool, flag("--whole", "Use whole runs, not only the part that excites the axis.")]
Forgetting = Annotated[float, option("--forgetting", "", "Forgetting factor of svf_rls.", min=0.5, max=1.0)]

MOST_DRAWN = 6
"""Runs of one model that are drawn: two figures each, and nobody looks through sixty."""


def command(
    context: typer.Context,
    runs: RunFiles,
    axis: ExcitedAxis = None,
    method: Method = "auto",
    effects: EffectNames = None,
    joint: Joint = False,
    whole: Whole = False,
    start: FromS = None,
    end: ToS = None,
    bandwidth: Bandwidth = 4.0,
    forgetting: Forgetting = 1.0,
    mapping: MappingFile = None,
    vehicle: VehicleFile = None,
    output: OutputDir = None,
    figures: Figures = True,
    force: Force = False,
    as_json: JsonFlag = False,
) -> Mapping[str, Any]:
    """Identify the yaw or pitch model of each run, or one model of all of them.

    With `-o` each model is written to DIR/RUN_AXIS.yaml, with figures, of many runs those of the ones it follows least. `auto` is
    output error, and prediction error (pem) where a disturbance, and no missing effect, explains the residuals; it says why. Of
    several runs one that cannot be used is skipped with its reason, and the exit code is 1.

    Example: sysid identify runs/*.parquet --axis yaw -o models/
    """
    from fieldsid.cli.inputs import axis_excited, files_of, read_runs
    from fieldsid.cli.skipped_logs import Skips

    refuse_closed(output)
    skips, ready = Skips(), partial(get_ready, "fieldsid.fitting.identify")
    known = read_runs(runs, mapping=mapping, start=start, end=end, meanwhile=ready, refused=skips.skip)
    axis = axis or axis_excited(known)
    from fieldsid.fitting.identify import check_joint, identify
    from fieldsid.fitting.problem.estimator import Options
    from fieldsid.records.keys import body_of
    from fieldsid.results.fits import Identified, fitted_model
    from fieldsid.vehicle import find_vehicle, load_vehicle

    if joint:
        check_joint([run.name for run in known], len(runs))
    with compiling_first(context), progress("fitting", 1 if joint else len(known)) as step:
        fits = identify(
            known,
            axis,
            method=method,
            effects=names_of(effects),
            joint=joint,
            vehicle=load_vehicle(vehicle) if vehicle is not None else find_vehicle(Path()),
            whole=whole or start is not None or end is not None,
            options=Options(bandwidth, forgetting),
            done=step,
            unfit=skips.skip,
        )
    used = skips.left_of(known)
    groups = [used] if joint else [[run] for run in used]
    models = _written(fits, [files_of(group) for group in groups], output, context, figures=figures, force=force)
    entries = tuple(fitted_model(fit, model, of) for fit, model, of in zip(fits, models, groups, strict=True))
    body = body_of(Identified(axis=axis, fits=entries, skipped_runs=tuple(skips.records)))
    from fieldsid.cli.headlines.models import of_identify

    headline = of_identify(body, [files_of(group) for group in groups])
    result = emit(
        body,
        as_json=as_json,
        render=lambda to: _render(to, body["fits"], figures=figures),
        headline=headline,
        notes=_warnings(entries),
    )
    skips.end(len(used))
    return result


def _written(
    fits: Sequence[Fit],
    sources: Sequence[list[Path]],
    folder: Path | None,
    context: typer.Context,
    *,
    figures: bool,
    force: bool,
) -> list[Path | None]:
    if folder is None:
        return [None] * len(fits)
    from fieldsid.models.model import save_model

    paths: list[Path | None] = []
    with drawing(context) as own:
        for fit, inputs in zip(fits, sources, strict=True):
            stem = _stem(fit)
            paths.append(save_model(fit.model, folder / f"{stem}.yaml", inputs=inputs, force=force))
            if figures:
                _draw(fit, folder, stem, own, force=force)
    return paths


def _draw(fit: Fit, folder: Path, stem: str, tasks: BackgroundTasks, *, force: bool) -> None:
    from fieldsid.figures.canvas import save
    from fieldsid.figures.identify import figure, history_figure, residual_figure

    for i in _drawn(fit):
        name = stem if len(fit.predictions) == 1 else f"{stem}_{fit.predictions[i].record.name}"
        save(figure(fit, i), folder / f"{name}.png", force=force, tasks=tasks)
        save(residual_figure(fit, i), folder / f"{name}_residuals.png", force=force, tasks=tasks)
    if fit.history is not None:
        save(history_figure(fit, fit.history), folder / f"{stem}_over_time.png", force=force, tasks=tasks)


def _drawn(fit: Fit) -> list[int]:
    """Return the places of the runs that are drawn: all of a few, of many those that the model follows least."""
    from fieldsid.comparison.sufficient import over_noise
    from fieldsid.fitting.predict.goodness_of_fit import goodness_of_fit
    from fieldsid.records.keys import body_of

    over = [over_noise(body_of(goodness_of_fit([p])), body_of(fit.floor)) for p in fit.predictions]
    least = sorted(range(len(over)), key=lambda i: (isnan(over[i]), -over[i]))
    return sorted(least[:MOST_DRAWN])


def _stem(fit: Fit) -> str:
    run = fit.model.runs[0] if len(fit.model.runs) == 1 else "joint"
    return f"{run}_{fit.model.axis.value}"


def _warnings(entries: Sequence[FittedModel]) -> list[Note]:
    """Return each kind of warning once, with the numbers of the first run that has it."""
    return alike((w.code, _label(body_of(e)), w) for e in entries for w in e.warnings)


def _render_reasons(to: Console, entries: Sequence[Mapping[str, Any]]) -> None:
    """Say why `auto` took each method it had to choose between, with the numbers of the first run it took it for."""
    weighed = [e for e in entries if e["method_reason"] is not None]
    for method in sorted({e["method"] for e in weighed}):
        first, *others = (e for e in weighed if e["method"] == method)
        more = f" ({method} for {len(others)} more too: `--json`)" if others else ""
        to.print(f"{_label(first)}: {first['method_reason']}{more}", soft_wrap=True)


def _label(entry: Mapping[str, Any]) -> str:
    """Return the run's name, or how many runs a joint fit has."""
    return str(entry["run"]) if len(entry["runs"]) == 1 else f"{len(entry['runs'])} runs"


def _render(to: Console, entries: Sequence[Mapping[str, Any]], *, figures: bool) -> None:
    from fieldsid.rounding import number

    rows = [
        (_label(e) if i == 0 else "", p["shown"], *shown_estimate(p["value"], p["std_error"], p["interval95"], p["unit"]))
        for e in entries
        for i, p in enumerate(e["parameters"].values())
    ]
    times, angle = shown_in("rad")
    to.print(table("", ("run", "parameter", "value", "unit", "95 % interval"), rows, left=2))
    to.print()
    merits = [
        (
            r["run"],
            number(r["speed_m_s"], 3),
            number(times * r["angle_rms_rad"], 2),
            number(times * e["noise_floor"]["angle_rad"], 2),
            number(r["angle_fit_percent"], 3),
            number(times * r["rate_rms_rad_s"], 2),
            number(times * e["noise_floor"]["rate_rad_s"], 2),
            number(r["rate_fit_percent"], 3),
        )
        for e in entries
        for r in e["runs"]
    ]
    columns = ("run", "m/s", "angle rms", "noise", "fit %", "rate rms", "noise", "fit %")
    to.print(table("", columns, merits))
    to.print()
    to.print(f"method: {', '.join(sorted({e['method'] for e in entries}))}; angle in {angle}, rate in {angle}/s")
    _render_reasons(to, entries)
    for e in entries:
        if e["model"]:
            to.print(f"model: {e['model']}", soft_wrap=True)
            if figures and len(e["runs"]) > MOST_DRAWN:
                draws = f"`sysid compare {e['model']} RUN -o DIR` draws any"
                to.print(f"figures: of the {MOST_DRAWN} runs it follows least; {draws}", soft_wrap=True)
