"""sysid history: a model's line, effect by effect, with the error before and after each addition."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.cli import options
from fieldsid.cli.console import Body, emit, say
from fieldsid.cli.progress import refuse_figure
from fieldsid.cli.session import draw_figure
from fieldsid.cli.voice import angles
from fieldsid.figures.bars import fall
from fieldsid.figures.sketch import sketch
from fieldsid.logs.run import Note
from fieldsid.page import Page, Whole, written
from fieldsid.views.extension import errors

if TYPE_CHECKING:
    from fieldsid.extension.lineage import Generation, Step
    from fieldsid.results.extensions import History

KEPT = {
    "unseen": "unseen data are predicted better",
    "evidence": "the evidence pays for it",
    "set": "kept for the set that it was added with",
    "--keep": "kept because of --keep",
}


class Options(options.OneModel):
    """What `sysid history` takes."""

    figure: Path | None = options.FIGURE
    force: bool = options.FORCE


@options.takes(Options)
def command(given: Options) -> Body:
    """Show how a model came about: its parents, the effects added, and how the error fell towards the noise floor.

    Every file's hash is checked against what its child and its data were when it was made.

    Example: sysid history models/joint_yaw+servo_lag.yaml --figure history.png
    """
    from fieldsid.cli.user_effects import read_model

    model, figure, force = given.model, given.figure, given.force
    refuse_figure(figure, force=force)
    known = read_model(model)
    from fieldsid.extension.lineage import history_of
    from fieldsid.results.extensions import History

    line = history_of(model)
    steps = [g.step for g in line if g.step]
    if figure is not None and not steps:
        say("nothing was added yet: there is no figure to draw")
    plot = sketch("history", line, model.name)
    result = History(
        model=str(model),
        axis=known.axis,
        generations=line,
        intact=all(g.state == "intact" and not (g.step and g.step.changed_data) for g in line),
        figure=draw_figure(figure if steps else None, plot, force=force),
    )
    from fieldsid.cli.headlines.models import headline_of_history
    from fieldsid.records.named_inputs import inputs_of

    headline = headline_of_history(result, inputs_of(model))
    return emit(result, render=_page(result, steps), headline=headline, notes=_notes(line))


def _notes(line: Sequence[Generation]) -> list[Note]:
    """Return a warning for each parent and each log that is missing or has changed since a model was made from it."""
    found: list[Note] = []
    for g in line:
        if g.state == "changed":
            found.append(Note("parent_changed", f"`{g.path}` has changed since its child was made from it", {}))
        elif g.state == "missing":
            found.append(Note("parent_missing", f"`{g.path}` is missing: the line is not known before it", {}))
        changed = g.step.changed_data if g.step else ()
        found += [Note("data_changed", f"`{p}` has changed since `{g.path.name}` was made from it", {}) for p in changed]
    return found


def _page(result: History, steps: Sequence[Step]) -> Page:
    """Return where the line starts, and the errors before and after each addition."""
    first = result.generations[0]
    starts = Whole(f"starts from {', '.join(first.effects) or 'the plain model'}: {first.path}")
    blocks = (replace(errors(step.gain, angles()), title=_reason(step)) for step in steps)
    return Page("", blocks=(starts, *blocks), closing=written(model=result.model, figure=result.figure))


def _reason(step: Step) -> str:
    """Return what was added, how the error fell, why it was kept, and what it was judged on."""
    gain = step.gain
    judged = ("judged on " if gain.unseen else "fitted to ") + ", ".join(gain.judged_on)
    return f"+ {', '.join(gain.added)}: {KEPT.get(step.kept_by, step.kept_by)}; {judged}; {fall([gain], angles())}"
