"""sysid diagnose: which physical effect is missing, how sure, what else it could be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.cli import options
from fieldsid.cli.console import Body, emit
from fieldsid.cli.inputs import AXIS_OPTION, files_of, mapping_behind, read_ready
from fieldsid.cli.progress import compiling_first, refuse_existing, refuse_figure, trying
from fieldsid.cli.session import draw_figure
from fieldsid.cli.voice import angles
from fieldsid.display import page_of
from fieldsid.errors import UsageError
from fieldsid.models.axis import Axis
from fieldsid.page import Block, Page, written
from fieldsid.records.keys import body_of
from fieldsid.views._words import times

if TYPE_CHECKING:
    from fieldsid.diagnosis import Diagnosis
    from fieldsid.diagnosis.records import Pair
    from fieldsid.logs.run import Run
    from fieldsid.models.model import Model, Noise
    from fieldsid.results.diagnoses import Applied, Diagnosed


class Options(options.Mapped, options.Judged, options.Runs):
    """What `sysid diagnose` takes."""

    axis: Axis | None = options.EXCITED_AXIS
    model: Path | None = options.option("--model MODEL", "A model whose effects are known already.")
    thorough: bool = options.flag(
        "--thorough", "Go on for as long as there is something to try, half a minute where much is left."
    )
    apply: bool = options.flag("--apply", "Add what is named, an effect at a time, each a model in `models/` with its errors.")
    output: Path | None = options.FILE
    figure: Path | None = options.FIGURE
    force: bool = options.FORCE


@options.takes(Options)
def command(given: Options) -> Body:
    """Say which physical effect the model is missing, how sure that is, and what else it could be.

    Every effect of the catalogue, and every one of your own in `effects/`, is added to a model fitted to all runs together, and
    judged by its free run on the `--validate` runs; without them a part of the runs is held back. With `-o FILE` the diagnosis
    is kept for `sysid plan --from FILE`; with `--apply` the model is extended by what is named, step by step.

    Example: sysid diagnose runs/pulses_*.parquet --axis yaw --validate runs/zigzag.parquet
    """
    from fieldsid.cli.skipped_logs import Skips

    model, force = given.model, given.force
    refuse_existing(given.output, force=force)
    refuse_figure(given.figure, force=force)
    known = _known_model(model, given.axis)
    skips, models = Skips(), {model: known} if model else {}
    groups = [given.runs, given.validate or []]
    training, unseen = read_ready(groups, skips, "fieldsid.diagnosis", models, mapping=given.mapping)
    from fieldsid.diagnosis import diagnose
    from fieldsid.face.arguments import axis_excited
    from fieldsid.results.diagnoses import Diagnosed

    axis = known.axis if known else given.axis or axis_excited(training, AXIS_OPTION)
    with compiling_first(), trying("diagnosing") as report:
        found = diagnose(training, axis, unseen, model=known, report=report, thorough=given.thorough, unfit=skips.skip)
    training, unseen = skips.without_skipped(training), skips.without_skipped(unseen)
    logs = files_of([*training, *unseen])
    result = Diagnosed(
        found=found,
        runs=tuple(r.name for r in training),
        validation_runs=tuple(r.name for r in unseen),
        model=None if model is None else str(model),
        known=() if known is None else known.effects,
        skipped_runs=tuple(skips.records),
    )
    file = _save_diagnosis(result, given.output, [*logs, *models], force=force)
    result = replace(result, file=file, figure=draw_figure(given.figure, found.plot, force=force))
    if given.apply:
        used = given.mapping or mapping_behind(models, logs)
        result = replace(result, applied=_add_effects(found, (known, model), training, unseen, used, force=force))
    from fieldsid.cli.headlines.missing import Searched, headline_of_diagnosis

    headline = headline_of_diagnosis(result, Searched(files_of(training), files_of(unseen), model, given.thorough))
    body = emit(result, render=_page(result), headline=headline, notes=found.notes)
    return skips.end(body, len(training) + len(unseen))


def _known_model(path: Path | None, axis: Axis | None) -> Model | None:
    """Return the model of a file, None without one; raises UsageError where it is of another axis than the one stated."""
    if path is None:
        return None
    from fieldsid.models.model import load_model

    model = load_model(path)
    if axis is not None and model.axis is not axis:
        raise UsageError(
            f"`{path}` is a {model.axis.value} model", found=f"--axis {axis.value}", hint=f"write `--axis {model.axis.value}`"
        )
    return model


def _save_diagnosis(result: Diagnosed, path: Path | None, inputs: Sequence[Path], *, force: bool) -> str | None:
    if path is None:
        return None
    from fieldsid.artifacts import save_record

    kept = {k: v for k, v in body_of(result).items() if k not in ("schema", "applied", "file", "figure")}
    return str(save_record(path, "fieldsid/diagnosis/1", kept, inputs=inputs, force=force))


def _add_effects(
    found: Diagnosis, model: tuple[Model | None, Path | None], training: Sequence[Run],
    unseen: Sequence[Run], mapping: Path | None, *, force: bool,
) -> tuple[Applied, ...]:  # fmt: skip
    """Extend the diagnosed model by each named effect in turn, write the model of each step, and return what it has changed.

    A base model that was given no file is written first, as the parent of the others.
    """
    from fieldsid.cli.commands.extend import step_files
    from fieldsid.cli.headlines.missing import MODELS
    from fieldsid.extension.extend import extend_in_steps, whole_of
    from fieldsid.extension.lineage import save_steps
    from fieldsid.models.model import save_model
    from fieldsid.results.diagnoses import Applied

    known, path = model
    if not found.effects:
        return ()
    if known is None or path is None:
        stem = "joint" if len(training) > 1 else training[0].name
        known, path = found.base_model, Path(MODELS) / f"{stem}_{found.axis.value}.yaml"
        if not path.exists() or force:
            save_model(known, path, inputs=files_of(training), mapping=mapping, force=force)
    with compiling_first(), trying("adding what was found") as report:
        steps = extend_in_steps(known, found.effects, training, unseen, found=found.model, report=report)
    names = whole_of(steps).gain.added
    targets = step_files(path, names, force=force)
    save_steps(steps, targets, path, (training, unseen), mapping=mapping, force=force)
    return tuple(
        Applied(step.gain, name, str(target), step.pays) for name, step, target in zip(names, steps, targets, strict=True)
    )


def _page(result: Diagnosed) -> Page:
    """Return the page of the diagnosis; where effects were added, with the error before the first and after each addition."""
    closing = written(model=[step.model for step in result.applied], file=result.file, figure=result.figure)
    return Page("", blocks=(*page_of(result.found, angles()).blocks, _error_by_step(result.applied)), closing=closing)


def _error_by_step(applied: Sequence[Applied]) -> Block:
    def row(name: str, errors: Pair, floor: Noise) -> tuple[str, ...]:
        return (name, *(times(side.over(floor)) for side in (errors.train, errors.validation)))

    rows = [row("as it is", step.gain.before, step.gain.noise_floor) for step in applied[:1]]
    rows += [row(f"+ {step.effect}", step.gain.after, step.gain.noise_floor) for step in applied]
    return Block("the error step by step, over the noise floor", tuple(rows), ("", "fitted", "unseen"))
