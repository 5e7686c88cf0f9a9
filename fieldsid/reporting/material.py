"""The material of a report: the files of a folder, or given files, read and compared; with reasons for those not used."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar

from fieldsid.comparison.compare import Comparison, compare_one
from fieldsid.display import Brief
from fieldsid.errors import ArtifactError, FieldsidError, UsageError
from fieldsid.extension.lineage import Generation, Loop, history_of, loop_of
from fieldsid.logs import Run, load_run
from fieldsid.logs.segments import may_show
from fieldsid.models.model import Model, load_model
from fieldsid.plant.parameter_source import ParameterSource, load_parameter_source
from fieldsid.records.check import ShapeError, check
from fieldsid.records.kinds import DRAWN_DIAGNOSIS
from fieldsid.schedule.record import Schedule, load_schedule
from fieldsid.trial_folder.journal import relative_to
from fieldsid.trial_folder.next_step import chosen_models, next_step, single_models
from fieldsid.trial_folder.state import MODEL, RUN, FolderState, Item
from fieldsid.vehicle import Vehicle, find_vehicle

T = TypeVar("T")
MOST_RUNS, MOST_MODELS = 12, 4
"""Most runs and models whose free runs are drawn; the report names how many are left out."""


@dataclass(frozen=True, slots=True, repr=False)
class Shown(Brief):
    """One model with its path from the folder, and its comparisons with the runs, also with those it was fitted to."""

    path: str
    model: Model
    found: tuple[Comparison, ...]

    def was_fitted_to(self, run: str) -> bool:
        """Whether the model was fitted to a run."""
        return run in self.model.runs


@dataclass(frozen=True, slots=True, repr=False)
class AxisMaterial(Brief):
    """The material of one axis: models, the best first, their ancestry and loop, points over speed, the newest other files."""

    axis: str
    shown: tuple[Shown, ...]
    line: tuple[Generation, ...]
    loop: Loop | None
    source: ParameterSource | None
    diagnosis: Item | None
    turning: Item | None
    schedule: Item | None
    gains: Schedule | None


@dataclass(frozen=True, slots=True, repr=False)
class Material(Brief):
    """A folder's state, runs, axes, notes and vehicle; `skipped` names what could not be used, with the reason."""

    state: FolderState
    runs: tuple[Run, ...]
    axes: tuple[AxisMaterial, ...]
    notes: str
    vehicle: Vehicle | None
    skipped: tuple[str, ...]
    next_step: tuple[str, str]


def material_of(state: FolderState) -> Material:
    """Return the material of a report on a folder's files; raises UsageError where there is neither a run nor a model."""
    if not (state.of_kind(RUN) or state.of_kind(MODEL)):
        found = f"nothing but {', '.join(f'`{i.path}`' for i in state.items[:3])}" if state.items else "nothing"
        raise UsageError(
            f"there is nothing to report in `{state.folder}`", found=found, hint="begin with `sysid import LOG -o runs/`"
        )
    skipped = list(state.unreadable)
    vehicle = find_vehicle(state.folder)
    runs = _runs(state, vehicle, skipped)
    axes = tuple(a for axis in ("yaw", "pitch") if (a := _axis(state, axis, runs, skipped)) is not None)
    notes = state.folder / "notes.md"
    return Material(
        state, tuple(runs), axes, notes.read_text(encoding="utf-8", errors="replace") if notes.is_file() else "",
        vehicle, tuple(skipped), next_step(state),
    )  # fmt: skip


def _runs(state: FolderState, vehicle: Vehicle | None, skipped: list[str]) -> list[Run]:
    places = [state.place(i) for i in state.of_kind(RUN)]
    if not places:  # the runs that the models name
        sources = [s.path for i in state.of_kind(MODEL) for s in i.sources if s.path is not None]
        places = [p for p in dict.fromkeys(sources) if p.suffix not in (".yaml", ".yml")]
    if len(places) > MOST_RUNS:
        order = "those that the model was not fitted to come first, then others evenly by name"
        skipped.append(f"{len(places) - MOST_RUNS} of {len(places)} runs are not drawn: {order}")
        places = _selected_runs(places, _runs_of_best_models(state))
    limits = {} if vehicle is None else vehicle.signal_limits
    read = {p: partial(load_run, p, state.mapping_of(p), fin_max_rad=limits, recognise=True) for p in places}
    tried = (_read_or_skip(how, p.name, skipped) for p, how in read.items())
    return [run for run in tried if run is not None]


def _read_or_skip(read: Callable[[], T], what: str, skipped: list[str]) -> T | None:
    """Return the value of `read`; None where it fails, with the reason added to `skipped`."""
    try:
        return read()
    except FieldsidError as error:
        skipped.append(f"{what}: {error.what}{f'; {error.found}' if isinstance(error, ArtifactError) else ''}")
        return None


def _runs_of_best_models(state: FolderState) -> set[str]:
    """Return the names of the runs to which the best models were fitted."""
    best = {path for axis in ("yaw", "pitch") for path in chosen_models(state, axis)}
    return {r for i in state.of_kind(MODEL) if i.path in best for r in i.runs}


def _selected_runs(places: Sequence[Path], fitted: set[str]) -> list[Path]:
    """Return the runs to be drawn: those to which no model was fitted first, then others spread evenly over the list."""
    unseen = [p for p in places if p.stem not in fitted][:MOST_RUNS]
    others = [p for p in places if p not in unseen]
    count = MOST_RUNS - len(unseen)
    spread = {others[round(i * (len(others) - 1) / max(count - 1, 1))] for i in range(count)}
    return [*unseen, *(p for p in others if p in spread)]


def _axis(state: FolderState, axis: str, runs: Sequence[Run], skipped: list[str]) -> AxisMaterial | None:
    best = chosen_models(state, axis)
    if not best:
        return None
    best_model = state.folder / best[0]
    found = _read_or_skip(partial(history_of, best_model), f"no history of {best_model.name}", skipped) if len(best) == 1 else ()
    line = found or ()
    ancestors = [g.path for g in reversed(line[:-1]) if g.state != "missing"]
    between = MOST_MODELS - 2
    ancestors = [*ancestors[:between], *ancestors[between:][-1:]]
    paths = [*(state.folder / b for b in best), *ancestors][:MOST_MODELS]
    if len(best) > MOST_MODELS:
        skipped.append(f"{len(best) - MOST_MODELS} of {len(best)} {axis} models are not drawn")
    singles = [state.folder / p for p in single_models(state, axis)]
    points = singles if len(singles) > 1 else [state.folder / b for b in best]
    shown = tuple(s for p in paths if (s := _shown(state, p, runs, skipped)) is not None)
    if not shown:
        return None
    kinds = ("diagnosis", "turn-radius", "schedule")
    diagnosis, turning, schedule = (_newest_complete(state, kind, axis, skipped) for kind in kinds)
    gains = None if schedule is None else _read_or_skip(partial(load_schedule, state.place(schedule)), schedule.path, skipped)
    return AxisMaterial(
        axis,
        shown,
        line,
        loop_of(line, shown[-1].found, shown[0].found) if ancestors and len(shown) == len(paths) else None,
        _read_or_skip(lambda: load_parameter_source(points), "no laws over speed", skipped),
        diagnosis,
        turning,
        schedule,
        gains,
    )


def _shown(state: FolderState, path: Path, runs: Sequence[Run], skipped: list[str]) -> Shown | None:
    if (model := _read_or_skip(partial(load_model, path), path.name, skipped)) is None:
        return None
    mine = [run for run in runs if may_show(run, model.axis)]
    tried = (_read_or_skip(partial(compare_one, model, run), f"{path.name} on {run.name}", skipped) for run in mine)
    found = [one for one in tried if one is not None]
    return Shown(relative_to(path, state.folder), model, tuple(found))


def _newest_complete(state: FolderState, kind: str, axis: str, skipped: list[str]) -> Item | None:
    """Return the newest complete file of a kind for an axis; a turning radius belongs to the yaw axis."""
    return state.newest(i for i in state.of_kind(kind) if (i.axis or "yaw") == axis and _is_complete(i, skipped))


def _is_complete(item: Item, skipped: list[str]) -> bool:
    try:
        check(item.body, DRAWN_DIAGNOSIS if item.kind == "diagnosis" else {})
    except ShapeError as error:
        skipped.append(f"{item.path}: {error}")
        return False
    return True
