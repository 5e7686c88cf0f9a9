"""sysid identify: the parameters of the yaw or pitch model, with honest error bars."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldsid.cli import options
from fieldsid.cli.console import Body, emit, one_of_each_kind, progress
from fieldsid.cli.progress import compiling_first, refuse_closed
from fieldsid.cli.session import draw_figures
from fieldsid.cli.voice import angles
from fieldsid.display import line_of
from fieldsid.figures.sketch import sketch
from fieldsid.logs.run import Note
from fieldsid.logs.several.run_names import ShortNames, short_names
from fieldsid.models.axis import Axis
from fieldsid.page import Block, Page, Whole, paragraph, written
from fieldsid.views._words import merit_blocks, parameter_block

if TYPE_CHECKING:
    from fieldsid.cli.skipped_logs import Skips
    from fieldsid.fitting.fit import Fit
    from fieldsid.logs.run import Run
    from fieldsid.results.fits import FittedModel


MOST_DRAWN = 6
"""Number of runs of one model that are drawn, with two figures each: nobody looks through sixty."""


class Options(options.ToFolder, options.OfVehicle, options.Part, options.Runs):
    """What `sysid identify` takes."""

    axis: Axis | None = options.EXCITED_AXIS
    method: str = options.METHOD
    effects: str | None = options.option("--effects A,B", "Effects in the model: see `sysid effects list`.")
    joint: bool = options.flag("--joint", "One model for all runs: damping and trim shared, authority by speed.")
    whole: bool = options.flag("--whole", "Use whole runs, not only the part that excites the axis.")
    bandwidth: float = options.BANDWIDTH
    forgetting: float = options.FORGETTING


@options.takes(Options)
def command(given: Options) -> Body:
    """Identify the yaw or pitch model of each run, or one model of all of them.

    With `-o` each model is written to DIR/RUN_AXIS.yaml, with figures, of many runs those of the ones it follows least. `auto` is
    output error, and prediction error (pem) where a disturbance, and no missing effect, explains the residuals; it says why. Of
    several runs one that cannot be used is skipped with its reason, and the exit code is 1.

    Example: sysid identify runs/*.parquet --axis yaw -o models/
    """
    from fieldsid.cli.inputs import AXIS_OPTION, files_of, read_ready
    from fieldsid.cli.skipped_logs import Skips

    refuse_closed(given.output)
    skips = Skips()
    (known,) = read_ready([given.runs], skips, "fieldsid.fitting.identify", {}, **given.reading)
    from fieldsid.face.arguments import axis_excited
    from fieldsid.results.fits import Identified, fitted_model

    axis = given.axis or axis_excited(known, AXIS_OPTION)
    fits = _fits(given, known, axis, skips)
    used = skips.without_skipped(known)
    groups = [used] if given.joint else [[run] for run in used]
    files = [files_of(group) for group in groups]
    models = _save_models(fits, files, given)
    plots = {k: v for fit in fits for k, v in _plots(fit).items()}
    draw_figures(given.drawn_to, plots, force=given.force)
    entries = tuple(fitted_model(fit, model, of) for fit, model, of in zip(fits, models, groups, strict=True))
    result = Identified(axis=axis, fits=entries, skipped_runs=tuple(skips.records))
    from fieldsid.cli.headlines.models import headline_of_identify

    page, headline = _page(fits, entries, figures=given.figures), headline_of_identify(result, files)
    return skips.end(emit(result, render=page, headline=headline, notes=_warnings(entries)), len(used))


def _fits(given: Options, known: Sequence[Run], axis: Axis, skips: Skips) -> Sequence[Fit]:
    """Return the fit to each run, or to all of them; a run that cannot be fitted is skipped."""
    from fieldsid.face.fits import identify
    from fieldsid.fitting.identify import check_joint

    if given.joint:
        check_joint([run.name for run in known], len(given.runs))
    with compiling_first(), progress("fitting", 1 if given.joint else len(known)) as step:
        how = {"runs": known, "axis": axis, "mapping": None, "done": step, "unfit": skips.skip}
        return identify(**options.arguments_of(identify, given, **how))


def _save_models(fits: Sequence[Fit], sources: Sequence[list[Path]], given: Options) -> Sequence[Path | None]:
    """Write the model of each fit to the folder and return the files; None for each where there is no folder."""
    if (folder := given.output) is None:
        return [None] * len(fits)
    from fieldsid.models.model import save_model

    save = partial(save_model, mapping=given.mapping, force=given.force)
    return [save(fit.model, folder / f"{_stem(fit)}.yaml", inputs=logs) for fit, logs in zip(fits, sources, strict=True)]


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
