"""sysid fit: b2 and d2 against u^2, damping and trim against speed."""

from __future__ import annotations

from pathlib import Path

from fieldsid.cli import options
from fieldsid.cli.console import Body, emit
from fieldsid.cli.progress import refuse_existing
from fieldsid.cli.session import draw_figure
from fieldsid.page import Page, written
from fieldsid.views.laws import blocks_of


class Options(options.ToFolder, options.Models):
    """What `sysid fit` takes."""

    unweighted: bool = options.flag("--unweighted", "Let every point count alike, standard errors or not.")
    output: Path | None = options.FILE


@options.takes(Options)
def command(given: Options) -> Body:
    """Fit the laws that carry a model from one speed to the next: authority against u^2, damping and trim against u.

    Takes model files of one axis, or one CSV table with speed_m_s and any of a22,b2,C0,c22,c23,d2,Cb (`<name>_std_error` where
    known; `-` is standard input). With `-o FILE` the laws are written for `turn-radius` and `schedule`, the models with their
    effects and errors inside, and a figure next to them.

    Example: sysid fit models/*.yaml -o law.yaml
    """
    from fieldsid.cli.headlines.gains import headline_of_fit
    from fieldsid.cli.inputs import models_among
    from fieldsid.errors import UsageError
    from fieldsid.plant.laws.axis_laws import law_notes, save_laws
    from fieldsid.plant.parameter_source import load_parameter_source
    from fieldsid.results.turning import FittedLaws

    output, force = given.output, given.force
    figure = given.drawn_to and given.drawn_to.with_suffix(".png")
    refuse_existing(output, figure, force=force)
    models = models_among(given.models)
    source = load_parameter_source(models)
    if source.is_fit_file:
        raise UsageError("this is a fit file already", found=str(models[0]), hint="give models or a table")
    laws = source.fitted(weighted=not given.unweighted)
    file = None
    if output is not None:
        inputs = [p for p in source.paths if p.is_file()]
        file = str(save_laws(laws, output, models=inputs if source.models else (), inputs=inputs, force=force))
    drawn = draw_figure(figure, laws.plot, force=force)
    result = FittedLaws(laws=laws, file=file, figure=drawn)
    notes = (*source.notes, *law_notes(laws))
    page = Page("", blocks=tuple(blocks_of(laws)), closing=written(file=file, figure=drawn))
    return emit(result, render=page, headline=headline_of_fit(result), notes=notes)
