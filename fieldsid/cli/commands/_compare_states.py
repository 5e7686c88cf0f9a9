"""`sysid compare OLD NEW`: two states of a vehicle, each a model file or a folder of models."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.cli.console import Body, emit
from fieldsid.cli.headlines.headline import Headline
from fieldsid.cli.headlines.typed import typed_with
from fieldsid.cli.session import draw_figures
from fieldsid.errors import UsageError
from fieldsid.figures.sketch import sketch
from fieldsid.logs.run import Note
from fieldsid.logs.unknown_file import own_kind
from fieldsid.page import Page, counted, written
from fieldsid.records.named_inputs import inputs_of, sha256_of
from fieldsid.records.reading import read_yaml
from fieldsid.trial_folder.next_step import chosen_models
from fieldsid.trial_folder.state import state_of
from fieldsid.vehicle import find_vehicle
from fieldsid.views.change import blocks_of

if TYPE_CHECKING:
    from fieldsid.change.record import Change
    from fieldsid.results.comparisons import AxisChange


@dataclass(frozen=True, slots=True)
class Side:
    """One state of the vehicle: the path that was given, and the model files that describe it, by axis."""

    given: Path
    files: Mapping[str, list[Path]]


def is_side(path: Path) -> bool:
    """Whether a path is a model file or a folder that contains one; False where it cannot be read: reading it reports that."""
    try:
        return own_kind(path) == "model" if not path.is_dir() else any(own_kind(p) == "model" for p in path.rglob("*.yaml"))
    except PermissionError:
        return False


def compare_states(old: Path, new: Path, output: Path | None, *, force: bool) -> Body:
    """Compare two states axis by axis, print which parameters and effects have changed, and return the JSON body.

    Raises UsageError where no axis has models on both sides, or where both sides have the same models.
    """
    sides = (_side(old), _side(new))
    axes = [a for a in sides[0].files if a in sides[1].files]
    if not axes:
        present = " and ".join(", ".join(s.files) for s in sides)
        raise UsageError("there is no axis with models on both sides", found=present, hint="give two models of one axis")
    shared_logs = _shared_logs(sides)
    found = [_change_of(sides, axis) for axis in axes]
    from fieldsid.results.comparisons import AxisChange, BeforeAfter

    names = (f"before: {old}", f"after: {new}")
    plots = {f"before_after_{c.axis.value}": sketch("change", c, names) for c in found}
    drawn: Sequence[str | None] = draw_figures(output, plots, force=force) or [None] * len(found)
    changes = tuple(
        AxisChange(c, tuple(tuple(map(str, s.files[c.axis.value])) for s in sides), f, _next_command(c, sides))
        for c, f in zip(found, drawn, strict=True)
    )
    notes = [Note(n.code, f"{c.axis.value}: {n.message}", n.data) for c in found for n in c.notes]
    if shared_logs:
        said = f"both sides were fitted to {', '.join(shared_logs)}: a difference is one of the models alone"
        notes.append(Note("shared_runs", said, {}))
    blocks = (b for c in changes for b in blocks_of(c.change, c.change.axis.value if len(changes) > 1 else ""))
    page = Page("", blocks=tuple(blocks), closing=written(figure=[c.figure for c in changes if c.figure]))
    return emit(BeforeAfter(str(old), str(new), changes), render=page, headline=_headline(changes), notes=notes)


def _headline(changes: Sequence[AxisChange]) -> Headline:
    """Return what has changed, axis by axis, and the first command that a change asks for, else the one that draws figures."""
    by_axis = [f"{c.change.axis.value}: {c.change.line}" if len(changes) > 1 else c.change.line for c in changes]
    drawn = all(c.figure for c in changes)
    then = next((c.next for c in changes if c.next), "" if drawn else typed_with("-o", "figures/"))
    return Headline("; ".join(by_axis), "; ".join(map(_rests_on, changes)), then)


def _rests_on(axis_change: AxisChange) -> str:
    """Return the numbers of model files and of tests, and the speeds (m/s) that a comparison rests on."""
    before, after = map(len, axis_change.models)
    speeds = ", ".join(f"{s:.2f}" for s in axis_change.change.speeds)
    tests = sum(1 + (len(p.speeds) if len(p.speeds) > 1 else 0) for p in axis_change.change.parameters)
    return f"{counted(before, 'model file')} before, {after} after, at {speeds} m/s; {tests} tests at once"


def _side(path: Path) -> Side:
    """Return the state that a model file or a folder of models describes."""
    from fieldsid.models.model import load_model

    if path.is_file():
        return Side(path, {load_model(path).axis.value: [path]})

    state = state_of(path)
    files = {axis: [path / name for name in chosen_models(state, axis)] for axis in ("yaw", "pitch")}
    return Side(path, {axis: names for axis, names in files.items() if names})


def _shared_logs(sides: Sequence[Side]) -> list[str]:
    """Return the names of the logs that models of both sides were fitted to; raises UsageError for the same models twice."""
    files = [[p for names in s.files.values() for p in names] for s in sides]
    if {sha256_of(p) for p in files[0]} == {sha256_of(p) for p in files[1]}:
        raise UsageError(
            "the models of both sides are the same", found=", ".join(map(str, files[0])), hint="identify what was flown after"
        )
    logs = [{e["sha256"]: Path(e["path"]).name for p in names for e in read_yaml(p).get("inputs") or ()} for names in files]
    return sorted(name for digest, name in logs[0].items() if digest in logs[1])


def _change_of(sides: Sequence[Side], axis: str) -> Change:
    """Return what has changed in one axis, within the fin limits of the newer folder's vehicle, else of the older one's."""
    from fieldsid.cli.user_effects import read_source
    from fieldsid.face.arguments import UNKNOWN
    from fieldsid.face.trial import compare_models

    before, after = (read_source(s.files[axis]) for s in sides)
    folders = [s.given if s.given.is_dir() else Path() for s in reversed(sides)]
    vehicle = next((v for f in (*folders, Path()) if (v := find_vehicle(f)) is not None), UNKNOWN)
    return compare_models(before, after, vehicle=vehicle)


def _next_command(found: Change, sides: Sequence[Side]) -> str | None:
    """Return the command that a change asks for: new gains, the lacking effect in the other model, or another plan."""
    axis = found.axis.value
    old, new = (s.files[axis] for s in sides)
    speeds = ",".join(f"{s:.3g}" for s in found.speeds)
    if found.verdict == "needed":
        return shlex.join(["sysid", "schedule", "design", *map(str, new), "-o", "gains_after.yaml"])
    if found.verdict == "form":
        lacking, missing = (old, found.added) if found.added else (new, found.removed)
        made, others = lacking[0].with_name(f"{lacking[0].stem}+{'+'.join(missing)}.yaml"), new if found.added else old
        if made.exists():  # the model was extended by these effects before: compare the extended one
            pair = (made, others[0]) if found.added else (others[0], made)
            return None if made in others else shlex.join(["sysid", "compare", *map(str, pair)])
        return shlex.join(["sysid", "extend", str(lacking[0]), *_inputs(lacking[0]), *(w for e in missing for w in ("--add", e))])
    return f"sysid plan --axis {axis} --speeds {speeds}" if found.verdict == "unclear" else None


def _inputs(model: Path) -> list[str]:
    return [str(p) for p in inputs_of(model)]
