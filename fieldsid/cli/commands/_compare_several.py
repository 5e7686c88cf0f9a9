"""`sysid compare M1 M2 ... RUN...`: several models over the same runs."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldsid.cli.voice import angles
from fieldsid.comparison.sufficient import pooled
from fieldsid.figures.sketch import sketch
from fieldsid.logs.several.run_names import short_names
from fieldsid.page import Block, Page, Whole, written

if TYPE_CHECKING:
    from fieldsid.cli.headlines.headline import Headline
    from fieldsid.cli.skipped_logs import Skips
    from fieldsid.comparison.compare import Comparison
    from fieldsid.extension.lineage import Loop
    from fieldsid.results.comparisons import ComparedSeveral
    from fieldsid.results.result import OfLogs

MOST_PLACES = 3


def several_models(
    paths: Sequence[Path],
    found_of: Sequence[Sequence[Comparison]],
    fitted_of: Sequence[Collection[str]],
    skips: Skips,
    logs: Sequence[Path],
    draw: Callable[[Mapping[str, Callable[[], Any]]], Sequence[str]],
) -> tuple[OfLogs, Page, Headline]:
    """Return which of several models follows the runs best, from their comparisons and the runs each was fitted to."""
    from fieldsid.cli.headlines.models import headline_of_several
    from fieldsid.records.named_inputs import inputs_of
    from fieldsid.results.comparisons import ComparedSeveral, OneOfSeveral, compared_run

    names, loop = _names(paths), _loop(paths, found_of)
    plots = {} if loop is None else {"loop": sketch("loop", loop)}
    plots |= {f"models_on_{one[0].run}": sketch("several", one, names) for one in zip(*found_of, strict=True)}
    over = [pooled(c.over_noise for c in found) for found in found_of]
    least = over.index(min(over))
    several = tuple(
        OneOfSeveral(
            str(p), error, tuple(c.run for c in found if c.run in fitted), tuple(compared_run(c, None, fitted) for c in found)
        )
        for p, error, found, fitted in zip(paths, over, found_of, fitted_of, strict=True)
    )
    result = ComparedSeveral(
        axis=found_of[0][0].model.axis,
        models=several,
        best=str(paths[least]),
        loop=loop,
        figures=tuple(draw(plots)),
        skipped_runs=tuple(skips.records),
    )
    headline = headline_of_several(result, names, found_of[least][0].model, logs, inputs_of(paths[least]))
    return result, _page(result, found_of, names), headline


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
