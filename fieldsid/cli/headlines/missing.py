"""Headlines of the search for what is missing: diagnose, extend, effects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.cli.headlines.headline import Headline
from fieldsid.cli.headlines.typed import pasted, typed_with
from fieldsid.cli.headlines.words import first_names, next_use, records_in
from fieldsid.cli.voice import angles
from fieldsid.figures.bars import fall
from fieldsid.logs.several.run_names import stem_of
from fieldsid.page import counted
from fieldsid.rounding import times_noise
from fieldsid.trial_folder.patterns import repeated

if TYPE_CHECKING:
    from fieldsid.diagnosis import Diagnosis
    from fieldsid.models.effect import Effect
    from fieldsid.results.diagnoses import Diagnosed
    from fieldsid.results.effects import NewEffect
    from fieldsid.results.extensions import Extended, LeftOver, Undone

MODELS = "models"
LEAST_TO_HOLD_OUT = 3
"""Number of runs from which a whole one is held out: see diagnosis/data/holdout_split.py."""


@dataclass(frozen=True, slots=True)
class Searched:
    """What a diagnosis was given: the files fitted to, the unseen ones, the known model, and whether the search was thorough."""

    runs: Sequence[Path]
    unseen: Sequence[Path]
    model: Path | None
    thorough: bool


def headline_of_diagnosis(result: Diagnosed, searched: Searched) -> Headline:
    """Return the verdict with its numbers, and how far the next best effect lies behind."""
    rests = f"{_judged_by(result)}; {counted(len(result.found.candidates), 'hypothesis', 'hypotheses')} compared"
    return Headline(first_line(result.found), rests, _next_command(result, searched))


def first_line(found: Diagnosis) -> str:
    """Return the verdict of a diagnosis; for a named effect with the margin to the next best one."""
    margin = _margin(found) if found.verdict in ("effect", "undecided") else ""
    return f"{found.verdict}: {found.short}{margin}"


def _judged_by(result: Diagnosed) -> str:
    """Return the runs fitted to and the data that judged: the given runs, or what was held out of the others.

    Of LEAST_TO_HOLD_OUT runs or more a whole one is held out, of fewer the last part of each.
    """
    runs, names = result.runs, first_names(result.runs)
    fitted = f"{counted(len(runs), 'run')} fitted to ({names}), judged by"
    if result.validation_runs:
        return f"{fitted} {first_names(result.validation_runs)}"
    if any(note.code == "nothing_held_back" for note in result.found.notes):
        return f"{fitted} the same: too short to hold a part back"
    held_out = "one of them" if len(runs) >= LEAST_TO_HOLD_OUT else "the last part of each" if len(runs) > 1 else "its last part"
    return f"{counted(len(runs), 'run')} ({names}), {held_out} held back to judge by"


def _margin(found: Diagnosis) -> str:
    """Return how far the next best effect lies behind the named one, in nats of log evidence."""
    first, *others = found.candidates
    margins = [(first.score - c.score, c.effect) for c in others]
    nats, name = min((one for one in margins if one[0] > 0.0), default=(0.0, ""))
    return f"; next best: {name}, {nats:.0f} nats behind" if name else ""


def _next_command(result: Diagnosed, of: Searched) -> str:
    """Return the command that the verdict asks for."""
    found, axis = result.found, result.found.axis.value
    judged = repeated("--validate", of.unseen)
    if found.verdict == "undecided":  # such a diagnosis names effects too: the likeliest of the rivals
        return _plan_to_decide(result, axis)
    if result.applied:
        return next_use(axis, result.applied[-1].model)
    if found.effects:
        adds = repeated("--add", found.effects)
        return _command_on_model(of, axis, lambda model: pasted("extend", model, of.runs, *adds, *judged))
    if found.verdict == "unexplained":
        longer = ("--thorough", *(("--force",) if result.file or result.figure else ()))
        return pasted("effects", "new", "unexplained", "--axis", axis) if of.thorough else typed_with(*longer)
    if found.verdict == "disturbed":
        known = ("--effects", ",".join(result.known)) if result.known else ()
        joint = ("--joint",) if len(of.runs) > 1 else ()
        return pasted("identify", of.runs, "--axis", axis, *joint, *known, "--method", "pem", "-o", "models_pem/")
    return _command_on_model(of, axis, lambda model: next_use(axis, model))


def _plan_to_decide(result: Diagnosed, axis: str) -> str:
    """Return the command that plans a maneuver which tells the rival effects apart."""
    if result.file:
        return pasted("plan", "--from", result.file, "-o", "plan")
    fly = result.found.next_maneuver
    return f"{fly.command} --axis {axis} -o plan" if fly and fly.command else typed_with("-o", "diagnosis.yaml")


def _command_on_model(of: Searched, axis: str, then: Callable[[str], str]) -> str:
    """Return a command on the diagnosed model: the given one, one identified from the same runs, or one still to identify."""
    if (model := of.model or _identified_model(of.runs, axis)) is not None:
        return then(str(model))
    joint = ("--joint",) if len(of.runs) > 1 else ()
    stem = "joint" if joint else stem_of(of.runs[0])
    identify = pasted("identify", of.runs, "--axis", axis, *joint, "-o", f"{MODELS}/")
    return f"{identify} && {then(f'{MODELS}/{stem}_{axis}.yaml')}"


def _identified_model(runs: Sequence[Path], axis: str) -> Path | None:
    """Return the file of a model without effects that was fitted to exactly these runs, from `models` here or next to them."""
    wanted = {p.resolve() for p in runs}
    found = records_in([Path(MODELS), *(p.parent.parent / MODELS for p in runs[:1])], "model")
    return next((p for p, body, logs in found if logs == wanted and body.get("axis") == axis and not body.get("effects")), None)


def headline_of_extension(result: Extended) -> Headline:
    """Return whether the addition is kept, and how the error fell."""
    gain = result.found.gain
    word = (
        "kept"
        if result.found.pays
        else "kept because of --keep"
        if result.kept
        else "not kept, nothing was written (--keep overrules)"
    )
    says = f"{'+'.join(gain.added)} {word}: {fall([gain], angles())}"
    fitted = f"{counted(len(gain.learned_on), 'run')} fitted to ({first_names(gain.learned_on)})"
    is_split = gain.unseen and set(gain.judged_on) <= set(gain.learned_on)
    judged = "what was held back of them" if is_split else first_names(gain.judged_on) if gain.unseen else "the same"
    return Headline(says, f"{fitted}, judged by {judged}", result.next)


def headline_of_undoing(result: Undone) -> Headline:
    """Return the model that is valid again."""
    return Headline(
        f"undone: {result.model} counts again, with {', '.join(result.effects) or 'no effects'}",
        f"the parent that {result.undone} names, {result.parent.state}",
        pasted("history", result.model),
    )


def headline_of_catalogue(effects: Sequence[Effect]) -> Headline:
    """Return how many effects there are."""
    stages = [e.stage for e in effects]
    shares = ", ".join(f"{stages.count(s)} {s}" for s in dict.fromkeys(stages))
    user_effects = sum("/" in e.origin for e in effects)
    return Headline(
        f"{counted(len(effects), 'effect')}: {shares}",
        "what is built in" + (f" and {user_effects} of your own" if user_effects else "; your own go into effects/"),
        pasted("effects", "show", effects[0].name),
    )


def headline_of_effect(effect: Effect) -> Headline:
    """Return what an effect is; the next command plans the maneuver that shows it."""
    plan = pasted("plan", "--axis", effect.axes[0], "--separate", f"none,{effect.name}", "-o", "plan")
    return Headline(f"{effect.name}: {effect.says}", effect.source, plan)


def headline_of_new_effect(result: NewEffect, look: str) -> Headline:
    """Return the file that was written; look: the command that shows the effect."""
    says, rests = f"wrote {result.file}: edit its moment and coefficients", f"the template of an effect, for {result.axis}"
    return Headline(says, rests, look)


def left_in_words(left: LeftOver) -> str:
    """Return the error that the resulting model leaves on unseen and fitted runs, and whether that is more than the noise."""
    sides = ((left.unseen, "unseen data"), (left.fitted, "the runs fitted to"))
    errors = ", ".join(times_noise(error, f"the noise floor on {name}") for error, name in sides if isfinite(error))
    comes_to = "more is missing than the sensors' noise explains" if left.more_than_noise else "that is the noise"
    return f"left: {errors}: {comes_to}"
