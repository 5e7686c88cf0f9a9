"""The next step in a trial: the first command of the usual sequence that has not been run, or must be run again."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from contextlib import chdir
from itertools import takewhile
from pathlib import Path

from fieldsid.comparison.left_by import left_by_addition
from fieldsid.comparison.sufficient import is_noise
from fieldsid.logs.load import maps_anything, needs_mapping, to_map
from fieldsid.logs.segments import may_show, plane_of
from fieldsid.logs.several.run_names import stem_of
from fieldsid.logs.several.sifting import attempt
from fieldsid.models.axis import Axis
from fieldsid.records.named_inputs import sha256_of
from fieldsid.rounding import MANY
from fieldsid.trial_folder.journal import Entry, is_trial, made_by
from fieldsid.trial_folder.make import LOGS, MAPPING, RUNS
from fieldsid.trial_folder.patterns import repeated, shortened
from fieldsid.trial_folder.state import LOG, MODEL, RUN, FolderState, Item, state_of
from fieldsid.vehicle import find_vehicle

DONE_ALL = ("everything rests on what is there", "")
REPORT = "sysid report"
PORT = 14550
"""The UDP port that a ground station usually listens on."""
TAKES_ALL_RUNS = ("identify", "diagnose")
"""Commands that use all runs of their trial folder where none is given."""


def next_step(state: FolderState) -> tuple[str, str]:
    """Return the reason and the command to run next, ready to paste; the command is empty where nothing remains to be done."""
    return (
        _remake_stale(state)
        or _compare_trials(state)
        or _import_logs(state)
        or _identify_or_extend(state)
        or _design_and_verify(state)
    ) or DONE_ALL


def step_before(command: str, state: FolderState) -> tuple[str, str]:
    """Return why a command has no input in this folder, and what to run first; empty where nothing would help."""
    if (
        command in ("schedule verify", "schedule export")
        and not state.of_kind("schedule")
        and (step := _design_and_verify(state)) is not None
    ):
        return step
    if command == "turn-radius" and state.models and not chosen_models(state, Axis.YAW.value):
        runs = [i for i, run in state.readable_runs() if may_show(run, Axis.YAW)]
        if not runs:
            return "there is no model of the yaw, and no run with a rudder", ""
        return "there is no model of the yaw yet", _line("identify", "--axis", "yaw", *_joint(runs))
    return next_step(state)


def _remake_stale(state: FolderState) -> tuple[str, str] | None:
    """Return how to make the first stale file again; files that depend on a stale one come after it."""
    stale = [i for i in state.items if i.stale]
    if not stale:
        return None
    order = (RUN, MODEL)  # all others are made from these
    first = min(stale, key=lambda i: (i.stale.endswith(" is stale"), order.index(i.kind) if i.kind in order else len(order)))
    maker = made_by(state.entries, first.path)
    return f"{first.path}: {first.stale}", _remake(state, first) if maker is None else _line_with_force(_words(state, maker))


def _line(*words: str) -> str:
    """Return the line of a command, ready to paste."""
    return shlex.join(["sysid", *words])


def _line_with_force(words: Sequence[str]) -> str:
    """Return the line of an earlier command with `--force`, so that it replaces its outputs."""
    return shlex.join([*words, *([] if "--force" in words else ["--force"])])


def _words(state: FolderState, entry: Entry) -> list[str]:
    """Return the words of a command to be repeated, without its runs where these are the default in its trial folder."""
    words = [w for w in entry.command if w != "--json"]
    runs = [w for w in words if w in run_words(state)]
    takes_all = words[1] in TAKES_ALL_RUNS and "--validate" not in words and is_trial(state.folder)
    return [w for w in words if w not in runs] if takes_all and sorted(runs) == sorted(run_words(state)) else words


def _remake(state: FolderState, item: Item) -> str:
    """Return how to make a file again that is not in the journal, from what the file records."""
    axis, folder = item.axis or "yaw", str(Path(item.path).parent)
    named = [s.named for s in item.sources]
    mappings = [name for name in named if name.endswith((".yaml", ".yml"))]
    logs = [name for name in named if name not in mappings]
    if item.kind == RUN and logs:  # a run that was piped in does not name its log
        return _line("import", *logs, *repeated("--mapping", mappings), "-o", folder, "--force")
    if item.kind == MODEL:
        mapping = item.body.get("mapping")
        read = [*run_words(state), *([] if mapping is None else ["--mapping", str(mapping["path"])])]
        return _line("identify", *read, "--axis", axis, "-o", folder, "--force")
    if item.kind == "diagnosis":
        return _line("diagnose", *run_words(state), "--axis", axis, "-o", item.path, "--force")
    return _line("history", item.path)


def _compare_trials(state: FolderState) -> tuple[str, str] | None:
    """Return the next step in a folder that contains trials but no data: a model in each trial, then their comparison."""
    if not state.sides or any(i.kind in (LOG, RUN, MODEL) for i in state.items):
        return None
    for side in state.sides:
        inner = state_of(state.folder / side)
        why, line = next_step(inner)
        if not inner.models and line:
            return f"{side}: {why}", f"cd {shlex.quote(side)} && {line}"
    if len(state.sides) == 2 and not any(e.name == "compare" and set(state.sides) <= set(e.command) for e in state.entries):
        why, line = f"{' and '.join(state.sides)} have models", _line("compare", *state.sides)
        return (why, line) if is_trial(state.folder) else (f"{why}; no journal here says whether `{line}` was run", "")
    return _design_and_verify(state) or DONE_ALL


def _import_logs(state: FolderState) -> tuple[str, str] | None:
    runs, logs = state.of_kind(RUN), state.of_kind(LOG)
    if runs or state.of_kind(MODEL):
        return None
    if logs:
        new = logs_to_import(state)
        mappings = [i.path for i in state.of_kind("mapping") if maps_anything(state.place(i))]
        foreign = next((log for log in new if attempt(needs_mapping, state.folder / log) is True), "") if not mappings else ""
        if foreign:
            with chdir(state.folder):
                return f"{foreign} needs a mapping: its own names do not say what its numbers are", to_map(Path(foreign))
        reading = ["--mapping", mappings[-1]] if mappings and MAPPING not in mappings else []
        words = ["sysid", "import", *_unless_default(state, *new, "-o", RUNS), *reading]
        return "there is no run of the logs yet", shortened(words, state.folder)
    if plans := state.of_kind("plan"):
        axis, path = plans[-1].axis or Axis.YAW.value, plans[-1].path
        live = _line("live", "--axis", axis, "--udp", str(PORT), *_unless_default(state, "--plan", path))
        return f"there is no log yet: fly {path} and put the logs in {LOGS}/", live
    return "there is no log yet", f"sysid plan --axis yaw --speeds {_speeds(state.folder)}"


def _speeds(folder: Path) -> str:
    vehicle = find_vehicle(folder)
    if vehicle is None or vehicle.speed_min_m_s is None or vehicle.speed_max_m_s is None:
        return "1.0,1.4,1.8"
    low, high = vehicle.speed_min_m_s, vehicle.speed_max_m_s
    return ",".join(f"{s:g}" for s in (round(low, 2), round(0.5 * (low + high), 2), round(high, 2)) if s > 0)


def _identify_or_extend(state: FolderState) -> tuple[str, str] | None:
    axis = _axis(state)
    if not state.of_kind(MODEL):
        runs = _unless_default(state, *run_words(state))
        return "there is no model of the runs yet", _line("identify", *runs, "--axis", axis, *_joint(state.of_kind(RUN)))
    diagnosis = next(reversed(state.done("diagnose")), None)
    saved = state.newest(state.of_kind("diagnosis"))
    if diagnosis is None and saved is None:
        if not (words := run_words(state)):
            return None
        return "no diagnosis yet", _line("diagnose", *_unless_default(state, *words), "--axis", axis)
    since = "" if diagnosis is None else diagnosis.time
    extended = any(e.time >= since for e in state.done("extend"))
    if not extended and (unsettled := _follow_up(state, diagnosis)) is not None:
        return unsettled
    best = state.models[0]
    named = () if (made := _diagnosis_of(state, best)) is None else made.effects
    lacking = [e for e in named if e not in best.effects]
    if lacking and not extended:
        fitted, judged = diagnosed_runs(state, best)
        typed = _unless_default(state, best.path, *fitted, *repeated("--validate", judged))
        return f"the diagnosis names {', '.join(lacking)}", _line("extend", *typed, *repeated("--add", lacking))
    return _diagnose_extended(state, best)


def _diagnose_extended(state: FolderState, best: Item) -> tuple[str, str] | None:
    """Return the diagnosis of an extended model with a remaining error, where none has been run since it was made."""
    error = left_by_addition(best.body.get("info") or {})
    if is_noise(error):
        return None
    place = state.place(best)
    now = sha256_of(place)
    was_diagnosed = (s.sha256 == now for e in state.done("diagnose") for s in e.inputs)
    asking = (s.path == place.resolve() for i in state.of_kind("diagnosis") for s in i.sources)
    if any(was_diagnosed) or any(asking):
        return None
    says = f"{error:.2f} x the noise" if error < MANY else "more than the noise"
    line = _line("diagnose", *_unless_default(state, *run_words(state)), "--axis", _axis(state), "--model", best.path)
    return f"{best.path} leaves {says}", line


def _follow_up(state: FolderState, diagnosis: Entry | None) -> tuple[str, str] | None:
    """Return the next step after a diagnosis without a certain result; None where it was certain or the step has been done.

    A longer search, or the flight that distinguishes between the candidates, comes before gains for a model known to be wrong.
    """
    if diagnosis is None:
        return None
    verdict, words = diagnosis.verdict.partition(":")[0], _words(state, diagnosis)
    written = {"-o", "--output", "--figure"} & set(words)
    if verdict == "unexplained" and "--thorough" not in words:
        longer = shlex.join([*words, "--thorough", *(["--force"] if written and "--force" not in words else [])])
        return "the diagnosis explains not all, and a longer search may", longer
    planned = any(e.time >= diagnosis.time for e in state.done("plan"))
    saved = [s.path for s in diagnosis.outputs if s.path.endswith((".yaml", ".yml"))]
    if verdict == "undecided" and saved and not planned:
        return "the diagnosis is undecided, and a maneuver would tell", _line("plan", "--from", saved[0], "-o", "plan")
    return None


def _design_and_verify(state: FolderState) -> tuple[str, str] | None:
    schedules = state.of_kind("schedule")
    models = chosen_models(state)
    design = ["schedule", "design", *_unless_default(state, *models), "-o"]
    if not schedules:
        return ("no gains yet", _line(*design, "gains.yaml")) if models else None
    gains = schedules[-1]
    if models and (old := _extended_since(state, gains)):
        return f"{gains.path} rests on {old}, which was extended since", _line(*design, gains.path, "--force")
    if not is_trial(state.folder):
        return f"{gains.path} is there; no journal says whether it is verified", ""
    if verification_of(state, gains) is None:
        return "the gains are not verified", "sysid schedule verify"
    return _write_report(state)


def _extended_since(state: FolderState, gains: Item) -> str:
    """Return the first model behind a schedule that has been extended since; empty without one."""
    used = {s.path for s in gains.sources}
    last = {i.path for i in state.models}
    return next((i.path for i in state.of_kind(MODEL) if state.place(i).resolve() in used and i.path not in last), "")


def verification_of(state: FolderState, gains: Item) -> Entry | None:
    """Return the last journal entry of a verification of this version of a schedule."""
    done = state.done("schedule verify")
    now = sha256_of(state.place(gains)) if done else ""
    return next((e for e in reversed(done) if not e.inputs or now in {s.sha256 for s in e.inputs}), None)


def _write_report(state: FolderState) -> tuple[str, str] | None:
    """Return the command for the report, where there is none or a later command has made something."""
    reports = state.done("report")
    if not reports:
        return "there is no report yet", REPORT
    after = takewhile(lambda e: e is not reports[-1], reversed(state.entries))
    made = [e for e in after if any(s.path.endswith((".yaml", ".yml", ".parquet")) for s in e.outputs)]
    if not made:
        return None
    return f"the report is older than what `sysid {made[0].name}` made", _line_with_force(_words(state, reports[-1]))


def chosen_models(state: FolderState, axis: str = "") -> list[str]:
    """Return the best models of one axis: the joint model that has not been extended, else those of single runs.

    Empty where both planes have models and no axis is given.
    """
    models = [i for i in state.models if not axis or i.axis == axis]
    if len({i.axis for i in models}) > 1:
        return []
    joint = [i for i in models if len(i.runs) > 1]
    if joint:
        return [max(joint, key=lambda i: (len(i.effects), state.place(i).stat().st_mtime_ns)).path]
    return [i.path for i in models]


def single_models(state: FolderState, axis: str) -> list[str]:
    """Return the single-run models with the largest number of effects: the points of the laws over speed."""
    models = [i for i in state.models if i.axis == axis and len(i.runs) == 1]
    most = max((len(i.effects) for i in models), default=0)
    return [i.path for i in models if len(i.effects) == most]


def root_of(state: FolderState, model: str) -> str:
    """Return the oldest ancestor of a model in the folder."""
    models = {state.place(i).resolve(): i for i in state.of_kind(MODEL)}
    item, seen = next(i for i in models.values() if i.path == model), set[str]()
    while item.path not in seen:
        seen.add(item.path)
        item = next((models[s.path] for s in state.parents(item) if s.path in models), item)
    return item.path


def unseen_runs(state: FolderState, model: Item) -> list[str]:
    """Return the runs of a folder to which a model was not fitted; all runs where it was fitted to every one."""
    fitted = set(trained_runs(state, model))
    runs = run_words(state)
    return [r for r in runs if r not in fitted] or runs


def trained_runs(state: FolderState, model: Item) -> list[str]:
    """Return the runs of a folder to which a model was fitted."""
    named = {s.path for s in model.sources if s.path is not None}
    return [i.path for i in state.of_kind(RUN) if state.place(i).resolve() in named and Path(i.path).stem in model.runs]


def diagnosed_runs(state: FolderState, model: Item) -> tuple[list[str], list[str]]:
    """Return the training and the validation runs for an addition to a model, as in the diagnosis that named it.

    Runs of the diagnosis that are no longer in the folder are left out. Without a diagnosis of the model's plane, or where none
    of its training runs remains, the training runs are those to which the model was fitted, and there are no validation runs.
    """
    made = _diagnosis_of(state, model)
    if made is not None:
        named = {stem_of(Path(r)): r for r in run_words(state)}
        of_diagnosis = ([str(r) for r in made.body.get(key) or ()] for key in ("runs", "validation_runs"))
        fitted, judged = ([named[r] for r in runs if r in named] for runs in of_diagnosis)
        if fitted:
            return fitted, judged
    return trained_runs(state, model), []


def _diagnosis_of(state: FolderState, model: Item) -> Item | None:
    """Return the newest diagnosis of a model's plane."""
    return state.newest(i for i in state.of_kind("diagnosis") if i.axis == model.axis)


def logs_to_import(state: FolderState, *, again: bool = False) -> list[str]:
    """Return the logs of a folder from which no run was made; all logs with `again`, or where all have a run.

    Where the folder `logs` has any, tables elsewhere do not count as logs.
    """
    logs = [i for i in state.of_kind(LOG) if i.path.startswith(f"{LOGS}/")] or list(state.of_kind(LOG))
    used = set() if again else {s.path for i in state.of_kind(RUN) for s in i.sources}
    new = [i.path for i in logs if state.place(i).resolve() not in used]
    return new or [i.path for i in logs]


def _unless_default(state: FolderState, *words: str) -> tuple[str, ...]:
    """Return no words in a trial folder, where a command finds these files itself, else the words."""
    return () if is_trial(state.folder) else words


def run_words(state: FolderState) -> list[str]:
    """Return the runs of a folder as words of a command line."""
    return [i.path for i in state.of_kind(RUN)]


def _joint(runs: Sequence[Item]) -> list[str]:
    return ["--joint"] if len(runs) > 1 else []


def _axis(state: FolderState) -> str:
    """Return the plane of the models, else the plane that most runs excite."""
    if state.models:
        return state.models[0].axis or "yaw"
    return plane_of([run for _, run in state.readable_runs()])
