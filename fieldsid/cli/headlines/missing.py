"""Headlines of the search for what is missing: diagnose, extend, effects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from fieldsid.cli.headlines.headline import Headline
from fieldsid.cli.headlines.typed import pasted, repeated, typed_with
from fieldsid.cli.headlines.words import Body, named, used
from fieldsid.cli.voice import angles
from fieldsid.comparison.sufficient import is_noise
from fieldsid.page import counted
from fieldsid.rounding import MANY, noise_fall, number, times_noise

MODELS = "models"
LEAST_TO_SPARE_ONE = 3
"""Runs from which a whole one is held back: see diagnosis/data/holdout_split.py."""


@dataclass(frozen=True, slots=True)
class Searched:
    """What was searched: the training files, those that judged, the known model, how long."""

    runs: Sequence[Path]
    unseen: Sequence[Path]
    model: Path | None
    thorough: bool


def of_diagnosis(body: Body, searched: Searched) -> Headline:
    """Return the verdict with its numbers and how far the next best lies behind."""
    rests = f"{_judged(body)}; {counted(len(body['candidates']), 'hypothesis', 'hypotheses')} compared"
    return Headline(first_line(body), rests, _after(body, searched))


def first_line(body: Body) -> str:
    """Return what is said first of a diagnosis."""
    sure = _sure(body) if body["verdict"] in ("effect", "undecided") else ""
    return f"{body['verdict']}: {body['short']}{sure}"


def _judged(body: Body) -> str:
    """Return the runs and what judged; without a run given for it one of three or more did, or the last part of each."""
    runs, names = body["runs"], named(body["runs"])
    fitted = f"{counted(len(runs), 'run')} fitted to ({names}), judged by"
    if body["validation_runs"]:
        return f"{fitted} {named(body['validation_runs'])}"
    if any(note["code"] == "nothing_held_back" for note in body["notes"]):
        return f"{fitted} the same: too short to hold a part back"
    kept = "one of them" if len(runs) >= LEAST_TO_SPARE_ONE else "the last part of each"
    return f"{counted(len(runs), 'run')} ({names}), {kept} held back to judge by"


def _sure(body: Body) -> str:
    """Return how clear the first candidate is; the evidence is no judge where it is for another, as in a log without noise."""
    first, *others = body["candidates"]
    if any(float(c["probability"]) > float(first["probability"]) for c in others):
        return "; named by the error on unseen runs, not by the evidence"
    behind = [(float(first["log_evidence"]) - float(c["log_evidence"]), str(c["effect"])) for c in others]
    nats, name = min((one for one in behind if one[0] > 0.0), default=(0.0, ""))
    return f"; next best: {name}, {nats:.0f} nats behind" if name else ""


def _after(body: Body, of: Searched) -> str:
    axis = str(body["axis"])
    judged = repeated("--validate", of.unseen)
    if body["verdict"] == "undecided":  # it names effects too: the likeliest of the rivals
        return _deciding(body, axis)
    if body["applied"]:
        return used(axis, body["applied"][-1]["model"])
    if body["effects"]:
        adds = repeated("--add", body["effects"])
        return _on_model(of, axis, lambda model: pasted("extend", model, of.runs, *adds, *judged))
    if body["verdict"] == "unexplained":
        longer = ("--thorough", *(("--force",) if body["file"] or body["figure"] else ()))
        return pasted("effects", "new", "unexplained", "--axis", axis) if of.thorough else typed_with(*longer)
    if body["verdict"] == "disturbed":
        known = ("--effects", ",".join(body["known"])) if body["known"] else ()
        joint = ("--joint",) if len(of.runs) > 1 else ()
        return pasted("identify", of.runs, "--axis", axis, *joint, *known, "--method", "pem", "-o", "models_pem/")
    return _on_model(of, axis, lambda model: used(axis, model))


def _deciding(body: Body, axis: str) -> str:
    """Return how a maneuver is planned that tells the rivals apart."""
    if body["file"]:
        return pasted("plan", "--from", body["file"], "-o", "plan")
    fly = body["next_maneuver"] or {}
    return f"{fly['command']} --axis {axis} -o plan" if "command" in fly else typed_with("-o", "diagnosis.yaml")


def _on_model(of: Searched, axis: str, then: Callable[[str], str]) -> str:
    """Return a line on the model that was diagnosed: one known, one that was identified of the same runs, or one still to be."""
    if (model := of.model or _identified(of.runs, axis)) is not None:
        return then(str(model))
    joint = ("--joint",) if len(of.runs) > 1 else ()
    stem = "joint" if joint else _stem(of.runs[0])
    made = pasted("identify", of.runs, "--axis", axis, *joint, "-o", f"{MODELS}/")
    return f"{made} && {then(f'{MODELS}/{stem}_{axis}.yaml')}"


def _stem(log: Path) -> str:
    from fieldsid.logs.several.run_names import stem_of

    return stem_of(log)


def _identified(runs: Sequence[Path], axis: str) -> Path | None:
    """Return a model without effects that was fitted to just these runs, in `models` here or beside them."""
    from fieldsid.logs.unknown_file import own_kind
    from fieldsid.records.named_inputs import inputs_of
    from fieldsid.records.reading import read_yaml

    wanted = {p.resolve() for p in runs}
    places = dict.fromkeys([Path(MODELS), *(p.parent.parent / MODELS for p in runs[:1])])
    for path in (p for place in places for p in sorted(place.glob("*.yaml"))):
        if own_kind(path) == "model" and {p.resolve() for p in inputs_of(path)} == wanted:
            body = read_yaml(path)
            if body.get("axis") == axis and not body.get("effects"):
                return path
    return None


def of_extension(body: Body) -> Headline:
    """Return whether the addition is kept, and how the error fell."""
    word = "kept" if body["pays"] else "kept because of --keep" if body["kept"] else "not kept"
    where = "unseen data" if body["unseen"] else "the runs fitted to"
    says = f"{'+'.join(body['added'])} {word}: the error on {where} goes from {_before_to_after(body)}"
    fitted = counted(len(body["learned_on"]), "run")
    return Headline(says, f"{fitted} fitted to ({named(body['learned_on'])}), judged by {named(body['judged_on'])}", body["next"])


def _before_to_after(body: Body) -> str:
    """Return the error over the noise floor; of a log without noise, whose floor is that of its digits, in its own units."""
    before, after = body["over_floor"]["before"], body["over_floor"]["after"]
    if before < MANY:
        return noise_fall(before, after)
    side = "validation" if body["unseen"] else "train"
    return " to ".join(_rms(body[when][side]) for when in ("before", "after"))


def _rms(errors: Body) -> str:
    factor, angle = angles().of("rad")
    parts = ((errors["angle_rms_rad"], angle), (errors["rate_rms_rad_s"], f"{angle}/s"))
    return " and ".join(f"{number(factor * float(rms), 2)} {unit}" for rms, unit in parts if rms is not None and isfinite(rms))


def of_undoing(body: Body) -> Headline:
    """Return which model counts again."""
    return Headline(
        f"undone: {body['model']} counts again, with {', '.join(body['effects']) or 'no effects'}",
        f"the parent that {body['undone']} names, {body['parent']['state']}",
        pasted("history", body["model"]),
    )


def of_catalogue(body: Body) -> Headline:
    """Return how many effects there are."""
    effects = body["effects"]
    stages = [str(e["stage"]) for e in effects]
    shares = ", ".join(f"{stages.count(s)} {s}" for s in dict.fromkeys(stages))
    own = sum("/" in str(e["origin"]) for e in effects)
    return Headline(
        f"{counted(len(effects), 'effect')}: {shares}",
        "what is built in" + (f" and {own} of your own" if own else "; your own go into effects/"),
        pasted("effects", "show", effects[0]["name"]),
    )


def of_effect(body: Body) -> Headline:
    """Return what an effect is, and the maneuver that shows it."""
    name, axis = str(body["name"]), str(body["axes"][0])
    return Headline(
        f"{name}: {body['says']}", str(body["source"]), pasted("plan", "--axis", axis, "--separate", f"none,{name}", "-o", "plan")
    )


def of_new_effect(body: Body, look: str) -> Headline:
    """Return what was written; look: the line to look at it."""
    says, rests = f"wrote {body['file']}: edit its moment and coefficients", f"the template of an effect, for {body['axis']}"
    return Headline(says, rests, look)


def left_says(body: Body) -> str:
    """Return what the model as it now is leaves."""
    sides = (("unseen data", body["left"]["unseen"]), ("the runs fitted to", body["left"]["fitted"]))
    said = ", ".join(times_noise(error, f"the noise floor on {name}") for name, error in sides if isfinite(error))
    quiet = all(is_noise(error) for _, error in sides if isfinite(error))
    return f"left: {said}: " + ("that is the noise" if quiet else "more is missing than the sensors' noise explains")
