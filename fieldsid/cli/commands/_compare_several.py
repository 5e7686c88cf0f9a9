"""`sysid compare M1 M2 ... RUN...`: several models over the same runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldsid.cli.console import emit
from fieldsid.cli.inputs import fitted_to
from fieldsid.cli.progress import get_ready
from fieldsid.cli.session import draw_figures
from fieldsid.cli.voice import angles
from fieldsid.comparison.sufficient import pooled
from fieldsid.errors import UsageError
from fieldsid.figures.sketch import sketch
from fieldsid.logs.several.run_names import short_names
from fieldsid.page import Block, Page, Whole, written

if TYPE_CHECKING:
    from fieldsid.cli.skipped_logs import Skips
    from fieldsid.comparison.compare import Comparison
    from fieldsid.extension.lineage import Loop
    from fieldsid.results.comparisons import ComparedSeveral

MOST_PLACES = 3


def compare_several(
    paths: Sequence[Path],
    runs: Sequence[Path],
    skips: Skips,
    *,
    reading: Mapping[str, Any],
    output: Path | None,
    force: bool,
) -> Mapping[str, Any]:
    """Compare several models of one axis with the same runs, print which follows them best, and return the JSON body.

    reading: the keyword arguments of `read_runs` (mapping, start, end). Raises UsageError for models of several axes.
    """
    from fieldsid.cli.inputs import read_runs
    from fieldsid.cli.user_effects import check_effects
    from fieldsid.models.model import load_model
    from fieldsid.models.record import left_out

    models = [load_model(p) for p in paths]
    if len({m.axis for m in models}) > 1:
        found = ", ".join(f"{p.name}: {m.axis.value}" for p, m in zip(paths, models, strict=True))
        raise UsageError("the models are not of one axis", found=found, hint="compare those of one axis")
    effects = partial(check_effects, list(zip(paths, models, strict=True)))
    ready = partial(get_ready, "fieldsid.comparison.compare")
    logs = read_runs(runs, models=paths, check=effects, meanwhile=ready, refused=skips.skip, **reading)
    from fieldsid.comparison.compare import compare
    from fieldsid.results.comparisons import ComparedSeveral, OneOfSeveral, compared_run

    found_of = [compare(m, logs, unfit=skips.skip if i == 0 else None) for i, m in enumerate(models)]
    names = _names(paths)
    fitted_of = [fitted_to(p, m, logs) for p, m in zip(paths, models, strict=True)]
    loop = _loop(paths, found_of)
    plots = {} if loop is None else {"loop": sketch("loop", loop)}
    of_runs = zip(*found_of, strict=True)
    plots |= {f"models_on_{of_run[0].run}": sketch("several", of_run, names) for of_run in of_runs}
    figures = tuple(draw_figures(output, plots, force=force))
    least = min(range(len(paths)), key=lambda i: pooled(c.over_noise for c in found_of[i]))
    several = tuple(
        OneOfSeveral(
            str(p),
            pooled(c.over_noise for c in found),
            tuple(c.run for c in found if c.run in fitted),
            tuple(compared_run(c, None, fitted) for c in found),
        )
        for p, found, fitted in zip(paths, found_of, fitted_of, strict=True)
    )
    result = ComparedSeveral(
        axis=models[0].axis,
        models=several,
        best=str(paths[least]),
        loop=loop,
        figures=figures,
        skipped_runs=tuple(skips.records),
    )
    from fieldsid.cli.headlines.models import headline_of_several
    from fieldsid.cli.inputs import files_of
    from fieldsid.records.named_inputs import inputs_of

    headline = headline_of_several(result, names, models[least], files_of(logs), inputs_of(paths[least]))
    notes = left_out(logs, models[0].axis)
    body = emit(result, render=_page(result, found_of, names), headline=headline, notes=notes)
    return skips.end(body, len(found_of[0]))


def _loop(paths: Sequence[Path], found_of: Sequence[Sequence[Comparison]]) -> Loop | None:
    """Return the additions that lead from one of the models to a descendant among them; None where none descends from another.

    The model with the most ancestors is the last of the loop, its oldest ancestor among the models the first.
    """
    from fieldsid.extension.lineage import history_of, loop_of

    ancestries = {i: history_of(path) for i, path in enumerate(paths)}
    last = max(ancestries, key=lambda i: len(ancestries[i]))
    places = [path.resolve() for path in paths]
    first = next((i for i, g in enumerate(ancestries[last][:-1]) if g.path.resolve() in places), None)
    if first is None:
        return None
    line = ancestries[last][first:]
    return loop_of((replace(line[0], step=None), *line[1:]), found_of[places.index(line[0].path.resolve())], found_of[last])


def _loop_blocks(loop: Loop) -> tuple[Block | str, ...]:
    """Return the conditions where the first model fails most, and the error on fitted and unseen runs after each addition."""
    places = [f"{angles().words(p.condition)} (rms {p.rms_ratio:.2f} x)" for p in loop.where[:MOST_PLACES]]
    fails = Whole(f"{loop.before.run}: the {loop.start} fails most at {', '.join(places)}" if places else "")
    of = "" if loop.is_noiseless else ", over the noise floor"
    rows = tuple((s.added, *s.says) for s in loop.steps)
    return fails, Block(f"the error step by step{of}", rows, ("", "fitted", "unseen"))


def _names(paths: Sequence[Path]) -> list[str]:
    stems = [p.stem for p in paths]
    return [s if stems.count(s) == 1 else str(p) for s, p in zip(stems, paths, strict=True)]


def _page(result: ComparedSeveral, found_of: Sequence[Sequence[Comparison]], names: Sequence[str]) -> Page:
    short = short_names([c.run for c in found_of[0]])
    rows = tuple((short.of(of_run[0].run), *(f"{c.over_noise:.2f}" for c in of_run)) for of_run in zip(*found_of, strict=True))
    errors = Block("error over the noise", rows, ("run", *names))
    loop = () if result.loop is None else _loop_blocks(result.loop)
    return Page("", blocks=(*loop, errors, Whole(short.says)), closing=written(figure=result.figures))
