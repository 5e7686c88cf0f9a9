"""`sysid compare OLD NEW`: two states of a vehicle, each a model file or a folder of models."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldsid.cli.console import emit
from fieldsid.cli.headlines.headline import Headline
from fieldsid.cli.headlines.typed import typed_with
from fieldsid.cli.session import drawn_in
from fieldsid.errors import UsageError
from fieldsid.figures.kinds import sketch
from fieldsid.logs.run import Note
from fieldsid.logs.unknown_file import own_kind
from fieldsid.page import Block, Page, Whole, counted, written
from fieldsid.views.change import blocks_of

if TYPE_CHECKING:
    from fieldsid.change.record import Change
    from fieldsid.results.comparisons import AxisChange


@dataclass(frozen=True, slots=True)
class Side:
    """One state: what was given, and by axis the model files that say most of it."""

    given: Path
    files: Mapping[str, list[Path]]


def is_side(path: Path) -> bool:
    """Whether a path is a model, or a folder with models in it; one that cannot be reached is left to what reads it."""
    try:
        return own_kind(path) == "model" if not path.is_dir() else any(own_kind(p) == "model" for p in path.rglob("*.yaml"))
    except PermissionError:
        return False


def before_after(old: Path, new: Path, output: Path | None, *, force: bool) -> Mapping[str, Any]:
    """Compare two states and print what has changed; return the body."""
    sides = (_side(old), _side(new))
    axes = [a for a in sides[0].files if a in sides[1].files]
    if not axes:
        there = " and ".join(", ".join(s.files) for s in sides)
        raise UsageError("there is no axis with models on both sides", found=there, hint="give two models of one axis")
    twice = _in_both(sides)
    found = [_compared(sides, axis) for axis in axes]
    from fieldsid.results.comparisons import AxisChange, BeforeAfter

    names = (f"before: {old}", f"after: {new}")
    plots = {f"before_after_{c.axis.value}": sketch("change", c, names) for c in found}
    drawn: Sequence[str | None] = drawn_in(output, plots, force=force) or [None] * len(found)
    told = tuple(
        AxisChange(c, tuple(tuple(map(str, s.files[c.axis.value])) for s in sides), f, _next(c, sides))
        for c, f in zip(found, drawn, strict=True)
    )
    notes = [Note(n.code, f"{c.axis.value}: {n.message}", n.data) for c in found for n in c.notes]
    if twice:
        said = f"both sides were fitted to {', '.join(twice)}: a difference is one of the models alone"
        notes.append(Note("shared_runs", said, {}))
    page = Page("", blocks=tuple(b for t in told for b in _blocks(t, title=t.change.axis.value if len(told) > 1 else "")))
    return emit(BeforeAfter(str(old), str(new), told), render=page, headline=_headline(told), notes=notes)


def _headline(told: Sequence[AxisChange]) -> Headline:
    """Return what has changed, axis by axis, and what to do about the first change that asks for something."""
    by_axis = [f"{t.change.axis.value}: {t.change.line}" if len(told) > 1 else t.change.line for t in told]
    drawn = all(t.figure for t in told)
    then = next((t.next for t in told if t.next), "" if drawn else typed_with("-o", "figures/"))
    return Headline("; ".join(by_axis), "; ".join(map(_rests_on, told)), then)


def _rests_on(told: AxisChange) -> str:
    before, after = map(len, told.models)
    speeds = ", ".join(f"{s:.2f}" for s in told.change.speeds)
    tests = sum(1 + (len(p.speeds) if len(p.speeds) > 1 else 0) for p in told.change.parameters)
    return f"{counted(before, 'model file')} before, {after} after, at {speeds} m/s; {tests} tests at once"


def _side(path: Path) -> Side:
    from fieldsid.models.model import load_model

    if path.is_file():
        return Side(path, {load_model(path).axis.value: [path]})
    from fieldsid.trial_folder.next_step import chosen_models
    from fieldsid.trial_folder.state import state_of

    state = state_of(path)
    files = {axis: [path / name for name in chosen_models(state, axis)] for axis in ("yaw", "pitch")}
    return Side(path, {axis: names for axis, names in files.items() if names})


def _in_both(sides: Sequence[Side]) -> list[str]:
    """Return the logs that models of both sides were fitted to; raises UsageError where the models themselves are the same."""
    from fieldsid.records.named_inputs import sha256_of
    from fieldsid.records.reading import read_yaml

    files = [[p for names in s.files.values() for p in names] for s in sides]
    if {sha256_of(p) for p in files[0]} == {sha256_of(p) for p in files[1]}:
        raise UsageError(
            "the models of both sides are the same", found=", ".join(map(str, files[0])), hint="identify what was flown after"
        )
    logs = [{e["sha256"]: Path(e["path"]).name for p in names for e in read_yaml(p).get("inputs") or ()} for names in files]
    return sorted(name for digest, name in logs[0].items() if digest in logs[1])


def _compared(sides: Sequence[Side], axis: str) -> Change:
    from fieldsid.change.compare import compare_models
    from fieldsid.cli.user_effects import read_source
    from fieldsid.face.arguments import UNKNOWN
    from fieldsid.schedule.linear_plant import FinLimits
    from fieldsid.vehicle import find_vehicle

    before, after = (read_source(s.files[axis]) for s in sides)
    folders = [s.given if s.given.is_dir() else Path() for s in reversed(sides)]
    vehicle = next((v for f in (*folders, Path()) if (v := find_vehicle(f)) is not None), UNKNOWN)
    stated = FinLimits(rate=vehicle.fin_rate_rad_s)
    return compare_models(before, after, fin_limit=vehicle.fin_max_rad(axis), stated=stated)


def _next(found: Change, sides: Sequence[Side]) -> str | None:
    axis = found.axis.value
    old, new = (s.files[axis] for s in sides)
    speeds = ",".join(f"{s:.3g}" for s in found.speeds)
    if found.verdict == "needed":
        return shlex.join(["sysid", "schedule", "design", *map(str, new), "-o", "gains_after.yaml"])
    if found.verdict == "form":
        lacking, add = (old, found.added) if found.added else (new, found.removed)
        made, others = lacking[0].with_name(f"{lacking[0].stem}+{'+'.join(add)}.yaml"), new if found.added else old
        if made.exists():  # it was extended so already: that one can be compared
            pair = (made, others[0]) if found.added else (others[0], made)
            return None if made in others else shlex.join(["sysid", "compare", *map(str, pair)])
        return shlex.join(["sysid", "extend", str(lacking[0]), *_runs(lacking[0]), *(w for e in add for w in ("--add", e))])
    return f"sysid plan --axis {axis} --speeds {speeds}" if found.verdict == "unclear" else None


def _runs(model: Path) -> list[str]:
    from fieldsid.records.named_inputs import inputs_of

    return [str(p) for p in inputs_of(model)]


def _blocks(told: AxisChange, *, title: str) -> Iterator[Block | str]:
    yield from blocks_of(told.change, title)
    yield from map(Whole, written(figure=told.figure))
