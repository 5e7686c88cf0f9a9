"""The arguments that a command takes from its trial folder where they are not typed: runs, models, gains, the output folder.

Typed arguments are never replaced. The words are added behind them, so that the journal has a line that can be run anywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import MappingProxyType

from fieldsid.cli.trial.parsed import Parsed
from fieldsid.errors import FieldsidError
from fieldsid.logs.load import load_run
from fieldsid.logs.segments import may_show
from fieldsid.logs.unknown_file import own_kind
from fieldsid.models.axis import Axis
from fieldsid.trial_folder.make import LOGS, MODELS, RUNS
from fieldsid.trial_folder.next_step import chosen_models, diagnosed_runs, logs_to_import, root_of, run_words, unseen_runs
from fieldsid.trial_folder.patterns import FEW
from fieldsid.trial_folder.state import LOG, MODEL, RUN, FolderState, Item

Fill = Callable[[Parsed, FolderState], list[str]]


def words_from_folder(parsed: Parsed, state: Callable[[], FolderState]) -> list[str]:
    """Return the words that a trial folder adds to a command line; none for a command that takes nothing from it."""
    fill = FILLS.get(parsed.name)
    return [] if fill is None else fill(parsed, state())


def _runs(parsed: Parsed, state: FolderState) -> list[str]:
    """Return the folder's runs without those that excite the other plane only; none where runs are typed."""
    return [] if parsed.values.get("runs") else _runs_of_plane(parsed, state)


def _runs_of_plane(parsed: Parsed, state: FolderState) -> list[str]:
    """Return the runs that may excite the axis of the command, all of them where none does or no axis is stated."""
    axis = parsed.values.get("axis")
    places = {i.path: state.place(i) for i in state.of_kind(RUN)}
    excited = [
        path
        for path, place in places.items()
        if axis is None or _may_show(place, place.stat().st_mtime_ns, state.mapping_of(place), axis)
    ]
    return excited or run_words(state)


@cache
def _may_show(place: Path, _written_ns: int, mapping: Path | None, axis: Axis) -> bool:
    """Whether a run may excite an axis; True for one that cannot be read: the command itself reports that.

    _written_ns: the file's modification time in ns, by which the cache tells a file that was written anew.
    """
    try:
        return may_show(load_run(place, mapping, recognise=True), axis)
    except FieldsidError:
        return True


def runs_of_other_plane(parsed: Parsed, state: FolderState) -> list[str]:
    """Return the folder's runs that a command does not take because they excite the other plane only."""
    if parsed.name not in ("identify", "diagnose") or parsed.values.get("runs"):
        return []
    taken = set(_runs_of_plane(parsed, state))
    return [r for r in run_words(state) if r not in taken]


def _output(parsed: Parsed, folder: str) -> list[str]:
    return [] if parsed.values.get("output") else ["-o", folder]


def _diagnose(parsed: Parsed, state: FolderState) -> list[str]:
    """Return the runs, the plane of the models, and a free file name for the diagnosis, which the report and `plan` read."""
    axis, planes = parsed.values.get("axis"), {str(i.axis) for i in state.models}
    if axis is None and len(planes) == 1 and not parsed.paths("runs", "model"):
        axis = Axis(planes.pop())
        with_axis = Parsed(parsed.name, {**parsed.values, "axis": axis})
        return [*_diagnose(with_axis, state), "--axis", axis.value]
    name = f"{MODELS}/diagnosis{f'_{axis}' if axis else ''}"
    return [*_runs(parsed, state), *_output(parsed, _free(state, name, ".yaml"))]


def _plan(parsed: Parsed, state: FolderState) -> list[str]:
    """Return a free folder name for the plan, which `live` reads."""
    return _output(parsed, _free(state, "plan"))


def _free(state: FolderState, name: str, suffix: str = "") -> str:
    """Return a name that no file of the folder has, with a number where the plain name is taken."""
    names = (f"{name}{f'-{i}' if i > 1 else ''}{suffix}" for i in range(1, 10_000))
    return next(n for n in names if not (state.folder / n).exists())


def _import(parsed: Parsed, state: FolderState) -> list[str]:
    """Return the logs that were not imported yet (with `--force` all of them) and the folder of the runs."""
    logs = [] if parsed.values.get("logs") else logs_to_import(state, again=bool(parsed.values.get("force")))
    return [*logs, *_output(parsed, RUNS)]


def _identify(parsed: Parsed, state: FolderState) -> list[str]:
    return [*_runs(parsed, state), *_output(parsed, MODELS)]


def _model_and_runs(fitted: Callable[[FolderState, Item], list[str]]) -> Fill:
    """Return the fill of a command that takes a model and runs: the best model, and the runs that `fitted` returns for it."""

    def fill(parsed: Parsed, state: FolderState) -> list[str]:
        typed = [str(p) for p in parsed.paths("model", "runs")]
        if typed and not any(p.endswith((".yaml", ".yml")) or (state.folder / p).is_dir() for p in typed):
            return chosen_models(state)[:1]  # only runs were typed
        words = typed or chosen_models(state)[:1]
        model = next((i for i in state.of_kind(MODEL) if [i.path] == words), None)
        return [] if model is None else [*(() if typed else words), *fitted(state, model)]

    return fill


def _compare(parsed: Parsed, state: FolderState) -> list[str]:
    """Return the model and runs; where nothing is typed and the model was extended, the first of its ancestors before it."""
    typed = parsed.paths("model", "runs")
    if any(own_kind(state.folder / p) == "schedule" for p in typed):
        return run_words(state) if len(typed) == 1 else []
    words = _model_and_runs(unseen_runs)(parsed, state)
    if typed or not words:
        return words
    first = root_of(state, words[0])
    return words if first == words[0] else [first, *words, *_output(parsed, _free(state, "figures"))]


def _extend(parsed: Parsed, state: FolderState) -> list[str]:
    """Return the model, and the fitted and the held-out runs of the diagnosis that named the effect to add."""
    if parsed.values.get("undo"):
        return []
    typed = [str(p) for p in parsed.paths("validate")]

    def runs(state: FolderState, model: Item) -> list[str]:
        fitted, judged = diagnosed_runs(state, model)
        return [r for r in fitted if r not in typed] + [w for r in judged if not typed for w in ("--validate", r)]

    return _model_and_runs(runs)(parsed, state)


def _unless_typed(parameter: str, files: Callable[[FolderState], list[str]]) -> Fill:
    """Return the fill of a command that takes files of the folder unless a parameter gives them."""
    return lambda parsed, state: [] if parsed.values.get(parameter) else files(state)


def _turn_radius(parsed: Parsed, state: FolderState) -> list[str]:
    """Return the yaw models, the runs that are turning circles, and a free output folder, which the report reads."""
    models = [] if parsed.values.get("models") else chosen_models(state, "yaw")
    circles = [] if parsed.values.get("measured") else _circles(state)
    return [*models, *_output(parsed, _free(state, "turning")), *[w for c in circles for w in ("--measured", c)]]


def _circles(state: FolderState) -> list[str]:
    """Return the runs that settle on a circle."""
    from fieldsid.turning.measured.measured_turn import is_circle

    return [item.path for item, run in state.readable_runs() if is_circle(run)]


def _gains(state: FolderState) -> list[str]:
    return [i.path for i in state.of_kind("schedule")[-1:]]


def _live(parsed: Parsed, state: FolderState) -> list[str]:
    """Return the newest run, or log, where no source is typed, and the latest plan of the axis where no goal is typed."""
    newest = state.newest(state.of_kind(RUN) or state.of_kind(LOG))  # logs where none was imported
    runs = [] if newest is None or parsed.values.get("log") or parsed.values.get("udp") else [newest.path]
    axis, is_stated = parsed.values.get("axis"), parsed.values.get("plan") or parsed.values.get("want")
    plans = [] if is_stated else [i.path for i in state.of_kind("plan") if i.axis == axis]
    return [*runs, *[word for plan in plans[-1:] for word in ("--plan", plan)]]


def _batch(parsed: Parsed, state: FolderState) -> list[str]:
    """Return the folder's logs, or its runs where there are none, and the vehicle file, which `batch` does not look for."""
    logs = [] if parsed.values.get("logs") else [i.path for i in state.of_kind(LOG) or state.of_kind(RUN)]
    vehicle = [] if parsed.values.get("vehicle") else [w for i in state.of_kind("vehicle")[:1] for w in ("--vehicle", i.path)]
    return [*logs, *vehicle]


FILLS: Mapping[str, Fill] = MappingProxyType(
    {
        "plan": _plan,
        "import": _import,
        "identify": _identify,
        "compare": _compare,
        "diagnose": _diagnose,
        "extend": _extend,
        "history": _unless_typed("model", lambda state: chosen_models(state)[:1]),
        "simulate": _unless_typed("model", lambda state: chosen_models(state)[:1]),
        "fit": _unless_typed("models", chosen_models),
        "turn-radius": _turn_radius,
        "schedule design": _unless_typed("models", chosen_models),
        "schedule verify": _unless_typed("schedule", _gains),
        "schedule export": _unless_typed("schedule", _gains),
        "live": _live,
        "batch": _batch,
    }
)
"""The function that returns what each command takes from its folder."""


def in_words(added: Sequence[str]) -> str:
    """Return the words taken from the folder, with the runs and logs shortened to their number."""
    many = {kind: [w for w in added if w.startswith(f"{kind}/")] for kind in (LOGS, RUNS)}
    words = dict.fromkeys(w for w in added if not any(w in files for files in many.values()))
    shown = [w for kind, files in many.items() for w in (files if len(files) <= FEW else [files[0], f"... {len(files)} {kind}"])]
    return " ".join([*words, *shown])
