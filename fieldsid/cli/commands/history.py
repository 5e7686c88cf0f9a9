"""sysid history: a model's line, effect by effect, with the error before and after each addition."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from fieldsid.cli.console import emit, say, table
from fieldsid.cli.options import FigureFile, Force, JsonFlag, ModelFile
from fieldsid.cli.progress import refuse_figure
from fieldsid.cli.session import tasks_of
from fieldsid.cli.voice import shown_in
from fieldsid.logs.run import Note

if TYPE_CHECKING:
    from rich.console import Console

    from fieldsid.extension import Generation

KEPT = {"unseen": "unseen data are predicted better", "evidence": "the evidence pays for it", "--keep": "kept because of --keep"}


def command(
    context: typer.Context, model: ModelFile, figure: FigureFile = None, force: Force = False, as_json: JsonFlag = False
) -> Mapping[str, Any]:
    """Show how a model came about: its parents, the effects added, and how the error fell towards the noise floor.

    Every file's hash is checked against what its child and its data were when it was made.

    Example: sysid history models/joint_yaw+servo_lag.yaml --figure history.png
    """
    from fieldsid.cli.user_effects import read_model

    refuse_figure(figure, force=force)
    known = read_model(model)
    from fieldsid.extension import history_of
    from fieldsid.records.keys import body_of
    from fieldsid.results.extensions import History

    line = history_of(model)
    body = body_of(
        History(
            model=str(model),
            axis=known.axis,
            generations=line,
            intact=all(g.state == "intact" and not (g.step and g.step.changed_data) for g in line),
            figure=_drawn(line, model, figure, context, force=force),
        )
    )
    from fieldsid.cli.headlines.models import of_history
    from fieldsid.records.named_inputs import inputs_of

    headline = of_history(body, inputs_of(model))
    return emit(body, as_json=as_json, render=lambda to: _render(to, line, body), headline=headline, notes=_notes(line))


def _drawn(line: Sequence[Generation], model: Path, path: Path | None, context: typer.Context, *, force: bool) -> str | None:
    if path is None:
        return None
    if not any(g.step for g in line):
        say("nothing was added yet: there is no figure to draw")
        return None
    from fieldsid.figures.canvas import save
    from fieldsid.figures.history import figure

    return str(save(figure(line, model.name), path, force=force, tasks=tasks_of(context)))


def _notes(line: Sequence[Generation]) -> list[Note]:
    found: list[Note] = []
    for g in line:
        if g.state == "changed":
            found.append(Note("parent_changed", f"`{g.path}` has changed since its child was made from it", {}))
        elif g.state == "missing":
            found.append(Note("parent_missing", f"`{g.path}` is missing: the line is not known before it", {}))
        changed = g.step.changed_data if g.step else ()
        found += [Note("data_changed", f"`{p}` has changed since `{g.path.name}` was made from it", {}) for p in changed]
    return found


def _render(to: Console, line: Sequence[Generation], body: Mapping[str, Any]) -> None:
    first = line[0]
    to.print(f"starts from {', '.join(first.effects) or 'the plain model'}: {first.path}", soft_wrap=True)
    to.print()
    rows = [row for g in line if g.step for row in _rows(g)]
    if rows:
        to.print(table("", ("added", "error of", "before", "after", "noise", "x floor"), rows, left=2))
    to.print()
    for g in line:
        if g.step:
            judged = ("judged on " if g.step.gain.unseen else "fitted to ") + ", ".join(g.step.gain.judged_on)
            kept = KEPT.get(g.step.kept_by, g.step.kept_by)
            to.print(f"+ {', '.join(g.step.gain.added)}: {kept}; {judged}", soft_wrap=True)
    to.print(f"model: {body['model']}", soft_wrap=True)
    if body["figure"]:
        to.print(f"figure: {body['figure']}", soft_wrap=True)


def _rows(g: Generation) -> list[tuple[str, ...]]:
    """Return a row for each channel of one addition, the pooled error over the floor on the first."""
    from fieldsid.rounding import number

    if g.step is None:
        return []
    gain, (times, angle) = g.step.gain, shown_in("rad")
    before, after = (p.validation if gain.unseen else p.train for p in (gain.before, gain.after))
    channels = [
        (name, b, a, floor)
        for name, b, a, floor in (
            (f"angle, {angle}", before.angle_rms_rad, after.angle_rms_rad, gain.noise_floor.angle),
            (f"rate, {angle}/s", before.rate_rms_rad_s, after.rate_rms_rad_s, gain.noise_floor.rate),
        )
        if isfinite(b)
    ]
    words = [f"+ {n}" for n in gain.added]
    words += [""] * (len(channels) - len(words))
    over = [f"{gain.over_floor[0]:.2f} -> {gain.over_floor[1]:.2f}", *([""] * (len(words) - 1))]
    channels += [("", float("nan"), float("nan"), float("nan"))] * (len(words) - len(channels))
    return [
        (w, name, *(number(times * v, 3) if name else "" for v in (b, a, floor)), x)
        for w, (name, b, a, floor), x in zip(words, channels, over, strict=True)
    ]
