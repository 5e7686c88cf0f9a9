"""The named effects added one at a time, so that a person watches the error fall."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from fieldsid.errors import FieldsidError
from fieldsid.extension.extend import Extension, extend, new_effects
from fieldsid.extension.lineage import save_extension
from fieldsid.logs.run import Run
from fieldsid.logs.several.sifting import Refused
from fieldsid.models.model import Model


def extend_in_steps(
    parent: Model,
    effects: Sequence[str],
    training: Sequence[Run],
    validation: Sequence[Run] = (),
    *,
    report: Callable[[str], None] = lambda _text: None,
    unfit: Refused[Run] | None = None,
) -> tuple[Extension, ...]:
    """Return an extension for each of some effects, each of the model before it, in their order.

    Every step is refitted to the training runs and judged by the validation runs as `extend` does, and raises what that raises;
    unfit is told of a run that cannot be fitted once.
    """
    names = [e.name for e in new_effects(parent, effects)]
    steps = list[Extension]()
    told = set[str]()

    def once(run: Run, error: FieldsidError) -> None:
        if unfit is not None and run.name not in told:
            told.add(run.name)
            unfit(run, error)

    for effect in names:
        known = steps[-1].model if steps else parent
        steps.append(extend(known, [effect], training, validation, report=report, unfit=None if unfit is None else once))
    return tuple(steps)


def whole_of(steps: Sequence[Extension]) -> Extension:
    """Return steps as one extension: from before the first to after the last."""
    first, last = steps[0].gain, steps[-1].gain
    gain = replace(last, added=tuple(name for s in steps for name in s.gain.added), before=first.before)
    notes = tuple({(n.code, n.message): n for s in steps for n in s.notes}.values())
    return replace(steps[-1], gain=gain, evidence=sum(s.evidence for s in steps), notes=notes)


def save_steps(
    steps: Sequence[Extension], files: Sequence[Path], parent: Path, data: tuple[Sequence[Run], Sequence[Run]], *, force: bool
) -> None:
    """Write each step's model with the one before it as its parent; data: training and unseen runs. Raises ArtifactError."""
    training, unseen = data
    for step, file, before in zip(steps, files, [parent, *files], strict=False):
        save_extension(step, file, parent=before, training=training, validation=unseen, force=force)
