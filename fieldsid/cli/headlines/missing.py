"""Headlines of the search for what is missing: diagnose, extend, effects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.cli.headlines.headline import Headline
from fieldsid.cli.headlines.typed import pasted, repeated, typed_with
from fieldsid.cli.headlines.words import named, used
from fieldsid.cli.voice import angles
from fieldsid.page import counted
from fieldsid.rounding import MANY, noise_fall, times_noise

if TYPE_CHECKING:
    from fieldsid.diagnosis import Diagnosis
    from fieldsid.extension.extend import Gain
    from fieldsid.models.effect import Effect
    from fieldsid.results.diagnoses import Diagnosed
    from fieldsid.results.effects import NewEffect
    from fieldsid.results.extensions import Extended, LeftOver, Undone

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


def of_diagnosis(told: Diagnosed, searched: Searched) -> Headline:
    """Return the verdict with its numbers and how far the next best lies behind."""
    rests = f"{_judged(told)}; {counted(len(told.found.candidates), 'hypothesis', 'hypotheses')} compared"
    return Headline(first_line(told.found), rests, _after(told, searched))


def first_line(found: Diagnosis) -> str:
    """Return what is said first of a diagnosis."""
    sure = _sure(found) if found.verdict in ("effect", "undecided") else ""
    return f"{found.verdict}: {found.short}{sure}"


def _judged(told: Diagnosed) -> str:
    """Return the runs and what judged; without a run given for it one of three or more did, or the last part of each."""
    runs, names = told.runs, named(told.runs)
    fitted = f"{counted(len(runs), 'run')} fitted to ({names}), judged by"
    if told.validation_runs:
        return f"{fitted} {named(told.validation_runs)}"
    if any(note.code == "nothing_held_back" for note in told.found.notes):
        return f"{fitted} the same: too short to hold a part back"
    kept = "one of them" if len(runs) >= LEAST_TO_SPARE_ONE else "the last part of each" if len(runs) > 1 else "its last part"
    return f"{counted(len(runs), 'run')} ({names}), {kept} held back to judge by"


def _sure(found: Diagnosis) -> str:
    """Return how clear the first candidate is; the evidence is no judge where it is for another, as in a log without noise."""
    first, *others = found.candidates
    if any(c.probability > first.probability for c in others):
        return "; named by the error on unseen runs, not by the evidence"
    behind = [(first.score - c.score, c.effect) for c in others]
    nats, name = min((one for one in behind if one[0] > 0.0), default=(0.0, ""))
    return f"; next best: {name}, {nats:.0f} nats behind" if name else ""


def _after(told: Diagnosed, of: Searched) -> str:
    found, axis = told.found, told.found.axis.value
    judged = repeated("--validate", of.unseen)
    if found.verdict == "undecided":  # it names effects too: the likeliest of the rivals
        return _deciding(told, axis)
    if told.applied:
        return used(axis, told.applied[-1].model)
    if found.effects:
        adds = repeated("--add", found.effects)
        return _on_model(of, axis, lambda model: pasted("extend", model, of.runs, *adds, *judged))
    if found.verdict == "unexplained":
        longer = ("--thorough", *(("--force",) if told.file or told.figure else ()))
        return pasted("effects", "new", "unexplained", "--axis", axis) if of.thorough else typed_with(*longer)
    if found.verdict == "disturbed":
        known = ("--effects", ",".join(told.known)) if told.known else ()
        joint = ("--joint",) if len(of.runs) > 1 else ()
        return pasted("identify", of.runs, "--axis", axis, *joint, *known, "--method", "pem", "-o", "models_pem/")
    return _on_model(of, axis, lambda model: used(axis, model))


def _deciding(told: Diagnosed, axis: str) -> str:
    """Return how a maneuver is planned that tells the rivals apart."""
    if told.file:
        return pasted("plan", "--from", told.file, "-o", "plan")
    fly = told.found.next_maneuver
    return f"{fly.command} --axis {axis} -o plan" if fly and fly.command else typed_with("-o", "diagnosis.yaml")


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


def of_extension(told: Extended) -> Headline:
    """Return whether the addition is kept, and how the error fell."""
    gain = told.gain
    word = "kept" if told.pays else "kept because of --keep" if told.kept else "not kept"
    where = "unseen data" if gain.unseen else "the runs fitted to"
    says = f"{'+'.join(gain.added)} {word}: the error on {where} goes from {_before_to_after(gain)}"
    fitted = f"{counted(len(gain.learned_on), 'run')} fitted to ({named(gain.learned_on)})"
    parted = gain.unseen and set(gain.judged_on) <= set(gain.learned_on)
    judged = "what was held back of them" if parted else named(gain.judged_on) if gain.unseen else "the same"
    return Headline(says, f"{fitted}, judged by {judged}", told.next)


def _before_to_after(gain: Gain) -> str:
    """Return the error over the noise floor; of a log without noise, whose floor is that of its digits, in its own units."""
    before, after = gain.over_floor
    if before < MANY:
        return noise_fall(before, after)
    factor, angle = angles().of("rad")
    return " to ".join(errors.sized(angle, factor) for errors in gain.judged)


def of_undoing(told: Undone) -> Headline:
    """Return which model counts again."""
    return Headline(
        f"undone: {told.model} counts again, with {', '.join(told.effects) or 'no effects'}",
        f"the parent that {told.undone} names, {told.parent.state}",
        pasted("history", told.model),
    )


def of_catalogue(effects: Sequence[Effect]) -> Headline:
    """Return how many effects there are."""
    stages = [e.stage for e in effects]
    shares = ", ".join(f"{stages.count(s)} {s}" for s in dict.fromkeys(stages))
    own = sum("/" in e.origin for e in effects)
    return Headline(
        f"{counted(len(effects), 'effect')}: {shares}",
        "what is built in" + (f" and {own} of your own" if own else "; your own go into effects/"),
        pasted("effects", "show", effects[0].name),
    )


def of_effect(effect: Effect) -> Headline:
    """Return what an effect is, and the maneuver that shows it."""
    plan = pasted("plan", "--axis", effect.axes[0], "--separate", f"none,{effect.name}", "-o", "plan")
    return Headline(f"{effect.name}: {effect.says}", effect.source, plan)


def of_new_effect(told: NewEffect, look: str) -> Headline:
    """Return what was written; look: the line to look at it."""
    says, rests = f"wrote {told.file}: edit its moment and coefficients", f"the template of an effect, for {told.axis}"
    return Headline(says, rests, look)


def left_says(left: LeftOver) -> str:
    """Return what the model as it now is leaves."""
    sides = ((left.unseen, "unseen data"), (left.fitted, "the runs fitted to"))
    said = ", ".join(times_noise(error, f"the noise floor on {name}") for error, name in sides if isfinite(error))
    comes_to = "more is missing than the sensors' noise explains" if left.more_than_noise else "that is the noise"
    return f"left: {said}: {comes_to}"
