"""`sysid compare M1 M2 ... RUN...`: several models over the same runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldsid.cli.commands._other_data import fitted_to
from fieldsid.cli.console import emit, table
from fieldsid.cli.progress import get_ready
from fieldsid.comparison.sufficient import pooled
from fieldsid.errors import UsageError

if TYPE_CHECKING:
    from rich.console import Console

    from fieldsid.cli.skipped_logs import Skips
    from fieldsid.comparison.compare import Comparison

CLOSE = 1.05
"""A ratio of two models' errors up to which neither is called the better."""


def several_models(
    paths: Sequence[Path],
    runs: Sequence[Path],
    skips: Skips,
    *,
    reading: Mapping[str, Any],
    output: Path | None,
    force: bool,
    as_json: bool,
) -> Mapping[str, Any]:
    """Compare several models with the same runs and print which follows them best; return the body.

    reading is what `read_runs` takes: mapping, start and end.
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
    logs = read_runs(runs, check=effects, meanwhile=ready, refused=skips.skip, **reading)
    from fieldsid.comparison.compare import compare
    from fieldsid.records.keys import body_of
    from fieldsid.results.comparisons import ComparedSeveral, OneOfSeveral, compared_run

    found_of = [compare(m, logs, unfit=skips.skip if i == 0 else None) for i, m in enumerate(models)]
    names = _names(paths)
    fitted_of = [fitted_to(p, m, logs) for p, m in zip(paths, models, strict=True)]
    figures = tuple(_drawn(found_of, names, output, force=force))
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
    body = body_of(
        ComparedSeveral(
            axis=models[0].axis, models=several, best=str(paths[least]), figures=figures, skipped_runs=tuple(skips.records)
        )
    )
    from fieldsid.cli.headlines.models import of_several
    from fieldsid.cli.inputs import files_of
    from fieldsid.records.named_inputs import inputs_of

    headline = of_several(body, names, files_of(logs), inputs_of(Path(str(body["best"]))), close=CLOSE)
    notes = left_out(logs, models[0].axis)
    result = emit(body, as_json=as_json, render=lambda to: _render(to, body, found_of, names), headline=headline, notes=notes)
    skips.end(len(found_of[0]))
    return result


def _names(paths: Sequence[Path]) -> list[str]:
    stems = [p.stem for p in paths]
    return [s if stems.count(s) == 1 else str(p) for s, p in zip(stems, paths, strict=True)]


def _drawn(found_of: Sequence[Sequence[Comparison]], names: Sequence[str], folder: Path | None, *, force: bool) -> list[str]:
    if folder is None:
        return []
    from fieldsid.figures.canvas import save
    from fieldsid.figures.kinds import figure_at
    from fieldsid.figures.several import figure
    from fieldsid.runtime.background_tasks import BackgroundTasks

    alone = len(found_of[0]) == 1
    with BackgroundTasks() as own:
        return [
            str(
                save(figure(of_run, names), figure_at(folder, f"models_on_{of_run[0].run}", is_one=alone), force=force, tasks=own)
            )
            for of_run in zip(*found_of, strict=True)
        ]


def _render(to: Console, body: Mapping[str, Any], found_of: Sequence[Sequence[Comparison]], names: Sequence[str]) -> None:
    runs = [c.run for c in found_of[0]]
    rows = [(run, *(f"{found[i].over_noise:.2f}" for found in found_of)) for i, run in enumerate(runs)]
    to.print(table("error over the noise", ("run", *names), rows))
    for path in body["figures"]:
        to.print(f"figure: {path}", soft_wrap=True)
