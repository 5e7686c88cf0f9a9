"""sysid history: a model's line, effect by effect, with the error before and after each addition."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import zip_longest
from typing import TYPE_CHECKING, Any

from fieldsid.cli.console import emit, say
from fieldsid.cli.options import FigureFile, Force, ModelFile
from fieldsid.cli.progress import refuse_figure
from fieldsid.cli.session import draw_figure
from fieldsid.cli.voice import angles
from fieldsid.figures.sketch import sketch
from fieldsid.logs.run import Note
from fieldsid.page import Block, Page, Whole, paragraph, written
from fieldsid.rounding import number
from fieldsid.views.extension import channels_of

if TYPE_CHECKING:
    from fieldsid.extension.extend import Gain
    from fieldsid.extension.lineage import Generation, Step
    from fieldsid.results.extensions import History

KEPT = {
    "unseen": "unseen data are predicted better",
    "evidence": "the evidence pays for it",
    "set": "kept for the set that it was added with",
    "--keep": "kept because of --keep",
}


def command(model: ModelFile, figure: FigureFile = None, force: Force = False) -> Mapping[str, Any]:
    """Show how a model came about: its parents, the effects added, and how the error fell towards the noise floor.

    Every file's hash is checked against what its child and its data were when it was made.

    Example: sysid history models/joint_yaw+servo_lag.yaml --figure history.png
    """
    from fieldsid.cli.user_effects import read_model

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
    first = result.generations[0]
    added = [row for step in steps for row in _rows(step.gain)]
    reasons = []
    for step in steps:
        judged = ("judged on " if step.gain.unseen else "fitted to ") + ", ".join(step.gain.judged_on)
        reasons.append(f"+ {', '.join(step.gain.added)}: {KEPT.get(step.kept_by, step.kept_by)}; {judged}")
    blocks: tuple[Block | str, ...] = (
        Whole(f"starts from {', '.join(first.effects) or 'the plain model'}: {first.path}"),
        Block("", tuple(added), ("added", "error of", "before", "after", "noise", "x floor"), left=2),
        *paragraph(reasons, Whole),
    )
    return Page("", blocks=blocks, closing=written(model=result.model, figure=result.figure))


def _rows(gain: Gain) -> Iterator[tuple[str, ...]]:
    """Yield a row for each channel of one addition; the first row has the pooled error over the noise floor too."""
    judged = "unseen" if gain.unseen else "fitted"
    channels = [r for r in channels_of(gain) if r["runs"] == judged]
    over = f"{gain.over_floor[0]:.2f} -> {gain.over_floor[1]:.2f}"
    for name, r in zip_longest((f"+ {n}" for n in gain.added), channels, fillvalue=None):
        times, unit = angles().of(r["unit"]) if r else (1.0, "")
        errors = [number(times * r[k], 3) if r else "" for k in ("before", "after", "noise_floor")]
        yield name or "", f"{r['channel']}, {unit}" if r else "", *errors, over
        over = ""
