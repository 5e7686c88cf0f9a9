"""sysid extend: add an effect, refit, and keep it only if the error on unseen runs falls."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.artifacts import replacing
from fieldsid.cli import options
from fieldsid.cli.console import Body, emit
from fieldsid.cli.headlines.missing import headline_of_extension, headline_of_undoing, left_in_words
from fieldsid.cli.headlines.typed import pasted
from fieldsid.cli.headlines.words import next_use
from fieldsid.cli.inputs import files_of, mapping_behind, model_first, read_ready
from fieldsid.cli.progress import compiling_first, refuse_existing, trying
from fieldsid.cli.skipped_logs import Skips
from fieldsid.cli.voice import angles
from fieldsid.comparison.sufficient import is_noise
from fieldsid.display import page_of
from fieldsid.errors import ArtifactError, UsageError
from fieldsid.page import Page, paragraph, written
from fieldsid.trial_folder.patterns import repeated

if TYPE_CHECKING:
    from fieldsid.extension.extend import Extension
    from fieldsid.models.model import Model
    from fieldsid.results.extensions import Extended, LeftOver


class Options(options.ToFile, options.Mapped, options.Judged, options.OneModel):
    """What `sysid extend` takes."""

    runs: options.Paths = options.argument("RUN...", "The runs that the model and the effects are fitted to.", None)
    add: list[str] | None = options.option("--add EFFECT", "An effect to add: see `sysid effects list`; may repeat.")
    keep: bool = options.flag("--keep", "Keep the addition even where the error on unseen runs does not fall.")
    undo: bool = options.flag("--undo", "Go back: give the model that this one was extended from.")


@options.takes(Options)
def command(given: Options) -> Body:
    """Add an effect to a model, refit everything, and watch the error fall.

    Before and after are both refitted to the runs and judged by their free run on the `--validate` runs; without them a part of
    the runs is held back. The extended model is written to its parent's folder, or to `-o FILE`, where the error on unseen runs
    falls, or with `--keep`; of several effects each is a step, with a model of its own. `--undo` gives the parent back;
    `sysid history MODEL` shows the whole line.

    Example: sysid extend model.yaml runs/pulses_*.parquet --add servo_lag --validate runs/zigzag.parquet
    """
    if given.undo:
        if given.runs or given.add or given.validate or given.keep:
            raise UsageError(
                "`--undo` takes the model alone", found="runs or other options with it", hint=f"sysid extend {given.model} --undo"
            )
        return _restore_parent(given.model, given.output, force=given.force)
    from fieldsid.models.model import load_model

    path, runs = model_first(given.model, given.runs or [])
    if not runs:
        raise UsageError(
            "there is no run to fit to", found=f"sysid extend {path}", hint=f"sysid extend {path} RUN... --add EFFECT"
        )
    return _extend(given, path, load_model(path), runs)


def _extend(given: Options, path: Path, known: Model, runs: Sequence[Path]) -> Body:
    """Extend the model of a file, write the model of each step where it is kept, print that and return the JSON body."""
    from fieldsid.face.arguments import names_of

    skips, validate = Skips(), given.validate or []
    names = list(dict.fromkeys(n for listed in given.add or [] for n in names_of(listed)))
    targets = step_files(path, names, given.output, force=given.force) if names else []
    check, module = partial(_check_request, known, names), "fieldsid.extension.extend"
    training, unseen = read_ready([runs, validate], skips, module, {path: known}, check=check, mapping=given.mapping)
    from fieldsid.extension.extend import extend_in_steps, whole_of
    from fieldsid.extension.lineage import INTACT, Parent, kept_by, save_steps
    from fieldsid.records.named_inputs import sha256_of
    from fieldsid.results.extensions import Extended

    with compiling_first(), trying("extending") as report:
        steps = extend_in_steps(known, names, training, unseen, report=report, unfit=skips.skip)
    found = whole_of(steps)
    training, unseen = skips.without_skipped(training), skips.without_skipped(unseen)
    kept = found.pays or given.keep
    if kept:
        used = given.mapping or mapping_behind([path], files_of([*training, *unseen]))
        save_steps(steps, targets, path, (training, unseen), mapping=used, force=given.force)
    now = targets[-1] if kept else path
    left, next_ = _remaining_error(found, now, known, runs, validate, kept=kept)
    result = Extended(
        found=found,
        kept=kept,
        kept_by=kept_by(found) if kept else None,
        model=str(now),
        effects=found.model.effects if kept else known.effects,
        parent=Parent(path, sha256_of(path), INTACT),
        left=left,
        next=next_,
        skipped_runs=tuple(skips.records),
    )
    body = emit(result, render=_page(result), headline=headline_of_extension(result), notes=found.notes)
    return skips.end(body, len(runs) + len(validate) - len(skips.records))


def step_files(parent: Path, effects: Sequence[str], last: Path | None = None, *, force: bool = False) -> list[Path]:
    """Return the file of the model after each added effect, in the folder of the last one or of the parent.

    Raises ArtifactError for a file that exists, unless forced.
    """
    stems = [f"{parent.stem}+{'+'.join(effects[: i + 1])}" for i in range(len(effects))]
    files = [(last or parent).with_name(f"{stem}.yaml") for stem in stems]
    files[-1] = last or files[-1]
    for file in files:
        refuse_existing(file, force=force)
    return files


def _check_request(model: Model, names: Sequence[str]) -> None:
    """Raise an error for an effect that is unknown, of the other axis, or in the model already."""
    from fieldsid.extension.extend import new_effects

    new_effects(model, names)


def _remaining_error(
    found: Extension, model: Path, parent: Model, runs: Sequence[Path], validate: Sequence[Path], *, kept: bool
) -> tuple[LeftOver, str]:
    """Return the error that the resulting model leaves, over the noise floor, and the command that comes next."""
    from fieldsid.results.extensions import LeftOver

    fitted, unseen = found.gain.left(kept=kept)
    left = LeftOver(fitted, unseen, not all(is_noise(error) for error in (fitted, unseen)))
    if not left.more_than_noise:
        return left, next_use(parent.axis.value, str(model))
    judged = repeated("--validate", validate)
    longer = () if kept else ("--thorough",)  # the effect that the usual search named did not pay: search longer
    return left, pasted("diagnose", runs, "--axis", parent.axis.value, "--model", str(model), *judged, *longer)


def _restore_parent(path: Path, output: Path | None, *, force: bool) -> Body:
    """Give back the model that one was extended from, copied to the output where that is given; print and return the body.

    Raises UsageError for a model without a parent, ArtifactError where the parent is missing or, unless forced, has changed.
    """
    from fieldsid.extension.lineage import CHANGED, MISSING, history_of, parent_of
    from fieldsid.models.model import load_model
    from fieldsid.results.extensions import Undone

    parent = parent_of(path)
    if parent is None:
        raise UsageError(f"`{path}` was not extended from another model", found="no parent", hint="there is nothing to undo")
    if parent.state == MISSING:
        raise ArtifactError(f"the parent of `{path}` is gone", found=str(parent.path), hint="put it back next to the model")
    if parent.state == CHANGED and not force:
        raise ArtifactError(
            f"the parent of `{path}` has changed since", found=str(parent.path), hint="add `--force` to take it as it is now"
        )
    back = parent.path
    if output is not None:
        with replacing(output, force=force) as temporary:
            shutil.copyfile(parent.path, temporary)
        back = output
    step = history_of(path)[-1].step
    undone = Undone(
        gain=step.gain if step else None, undone=str(path), model=str(back), effects=load_model(back).effects, parent=parent
    )
    page = Page("", closing=(f"model: {back}; {path} stays where it is",))
    return emit(undone, render=page, headline=headline_of_undoing(undone))


def _page(result: Extended) -> Page:
    blocks = (*page_of(result.found, angles()).blocks, *paragraph([left_in_words(result.left)]))
    return Page("", blocks=blocks, closing=written(model=result.model))
