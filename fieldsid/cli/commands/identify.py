"""sysid identify: the parameters of the yaw or pitch model, with honest error bars."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from fieldsid.cli import options
from fieldsid.cli.console import emit, one_of_each_kind, progress
from fieldsid.cli.progress import compiling_first, refuse_closed
from fieldsid.cli.session import draw_figures
from fieldsid.cli.voice import angles
from fieldsid.display import line_of
from fieldsid.figures.sketch import sketch
from fieldsid.logs.run import Note
from fieldsid.logs.several.run_names import ShortNames, short_names
from fieldsid.page import Block, Page, Whole, paragraph, written
from fieldsid.views._words import merit_blocks, parameter_block

if TYPE_CHECKING:
    from fieldsid.fitting.fit import Fit
    from fieldsid.results.fits import FittedModel


MOST_DRAWN = 6
"""Number of runs of one model that are drawn, with two figures each: nobody looks through sixty."""


def command(
    runs: options.RunFiles,
    axis: options.ExcitedAxis = None,
    method: options.Method = "auto",
    effects: options.EffectNames = None,
    joint: Annotated[
        bool, options.flag("--joint", "One model for all runs: damping and trim shared, authority by speed.")
    ] = False,
    whole: Annotated[bool, options.flag("--whole", "Use whole runs, not only the part that excites the axis.")] = False,
    start: options.FromS = None,
    end: options.ToS = None,
    bandwidth: options.Bandwidth = 4.0,
    forgetting: options.Forgetting = 1.0,
    mapping: options.MappingFile = None,
    vehicle: options.VehicleFile = None,
    output: options.OutputDir = None,
    figures: options.Figures = True,
    force: options.Force = False,
) -> Mapping[str, Any]:
    """Identify the yaw or pitch model of each run, or one model of all of them.

    With `-o` each model is written to DIR/RUN_AXIS.yaml, with figures, of many runs those of the ones it follows least. `auto` is
    output error, and prediction error (pem) where a disturbance, and no missing effect, explains the residuals; it says why. Of
    several runs one that cannot be used is skipped with its reason, and the exit code is 1.

    Example: sysid identify runs/*.parquet --axis yaw -o models/
    """
    from fieldsid.cli.inputs import AXIS_OPTION, files_of, read_ready
    from fieldsid.cli.skipped_logs import Skips

    refuse_closed(output)
    skips = Skips()
    (known,) = read_ready([runs], skips, "fieldsid.fitting.identify", {}, mapping=mapping, start=start, end=end)
    from fieldsid.face.arguments import axis_excited, names_of, vehicle_of
    from fieldsid.fitting.identify import check_joint, identify
    from fieldsid.fitting.problem.estimator import Options
    from fieldsid.results.fits import Identified, fitted_model

    axis = axis or axis_excited(known, AXIS_OPTION)
    if joint:
        check_joint([run.name for run in known], len(runs))
    with compiling_first(), progress("fitting", 1 if joint else len(known)) as step:
        fits = identify(
            known,
            axis,
            method=method,
            effects=names_of(effects),
            joint=joint,
            vehicle=vehicle_of(vehicle),
            whole=whole or start is not None or end is not None,
            options=Options(bandwidth, forgetting),
            done=step,
            unfit=skips.skip,
        )
    used = skips.without_skipped(known)
    groups = [used] if joint else [[run] for run in used]
    files = [files_of(group) for group in groups]
    models = _save_models(fits, files, mapping, output, force=force)
    draw_figures(output if figures else None, {k: v for fit in fits for k, v in _plots(fit).items()}, force=force)
    entries = tuple(fitted_model(fit, model, of) for fit, model, of in zip(fits, models, groups, strict=True))
    result = Identified(axis=axis, fits=entries, skipped_runs=tuple(skips.records))
    from fieldsid.cli.headlines.models import headline_of_identify

    page, headline = _page(fits, entries, figures=figures), headline_of_identify(result, files)
    return skips.end(emit(result, render=page, headline=headline, notes=_warnings(entries)), len(used))


def _save_models(
    fits: Sequence[Fit], sources: Sequence[list[Path]], mapping: Path | None, folder: Path | None, *, force: bool
) -> Sequence[Path | None]:
    """Write the model of each fit to the folder and return the files; None for each where there is no folder."""
    if folder is None:
        return [None] * len(fits)
    from fieldsid.models.model import save_model

    pairs = zip(fits, sources, strict=True)
    return [
        save_model(fit.model, folder / f"{_stem(fit)}.yaml", inputs=inputs, mapping=mapping, force=force) for fit, inputs in pairs
    ]


def _plots(fit: Fit) -> dict[str, Callable[[], Any]]:
    """Return a function that draws each figure of a fit, by the figure's name."""
    plots, stem = {}, _stem(fit)
    for i in _runs_to_draw(fit):
        name = stem if len(fit.predictions) == 1 else f"{stem}_{fit.predictions[i].record.name}"
        plots[name] = sketch("identify", fit, i, line_of(fit))
        plots[f"{name}_residuals"] = sketch("identify", fit, i, draw="residual_figure")
    if fit.history is not None:
        plots[f"{stem}_over_time"] = sketch("identify", fit, fit.history, draw="history_figure")
    return plots


def _runs_to_draw(fit: Fit) -> list[int]:
    """Return the indices of at most MOST_DRAWN runs: those with the largest error over the noise floor."""
    from fieldsid.fitting.predict.goodness_of_fit import goodness_of_fit
    from fieldsid.results.fits import over_noise_of

    over = [over_noise_of(goodness_of_fit([p]), fit.floor) for p in fit.predictions]
    least = sorted(range(len(over)), key=lambda i: (isnan(over[i]), -over[i]))
    return sorted(least[:MOST_DRAWN])


def _stem(fit: Fit) -> str:
    run = fit.model.runs[0] if len(fit.model.runs) == 1 else "joint"
    return f"{run}_{fit.model.axis.value}"


def _warnings(entries: Sequence[FittedModel]) -> list[Note]:
    """Return one warning of each kind for a model, with the numbers of the first run that has it."""
    return one_of_each_kind((w.code, _label(e), w) for e in entries for w in e.warnings)


def _reasons(entries: Sequence[FittedModel]) -> Iterator[str]:
    """Yield why `auto` chose each of its methods, with the numbers of the first run that it was chosen for."""
    weighed = [e for e in entries if e.method_reason is not None]
    for method in sorted({e.method for e in weighed}):
        first, *others = (e for e in weighed if e.method == method)
        more = f" ({method} for {len(others)} more too: `--json`)" if others else ""
        yield Whole(f"{_label(first)}: {first.method_reason}{more}")


def _label(entry: FittedModel, short: ShortNames | None = None) -> str:
    """Return the run's name, shortened if asked, or how many runs a joint fit has."""
    name = entry.run if short is None else short.of(entry.run)
    return name if len(entry.runs) == 1 else f"{len(entry.runs)} runs"


def _page(fits: Sequence[Fit], entries: Sequence[FittedModel], *, figures: bool) -> Page:
    short = short_names([r.run for e in entries for r in e.runs])
    parameters = parameter_block(((_label(e, short), fit.model) for e, fit in zip(entries, fits, strict=True)), angles())
    runs = ((short.of(r.run), r.speed_m_s, r.merit, e.noise_floor) for e in entries for r in e.runs)
    merits, units = merit_blocks(runs, angles())
    said = paragraph([f"method: {', '.join(sorted({e.method for e in entries}))}; {units}"])
    blocks: tuple[Block | str, ...] = (parameters, merits, *said, Whole(short.says), *_reasons(entries))
    closing: list[str] = []
    for e in (e for e in entries if e.model):
        closing += written(model=e.model)
        if figures and len(e.runs) > MOST_DRAWN:
            closing.append(f"figures: of the {MOST_DRAWN} runs it follows least; `sysid compare {e.model} RUN -o DIR` draws any")
    return Page("", blocks=blocks, closing=tuple(closing))
