"""Headlines of what is done with a model: identify, compare, simulate, history."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.cli.headlines.headline import Headline
from fieldsid.cli.headlines.typed import pasted, repeated, typed_with
from fieldsid.cli.headlines.words import MOST_NAMED, named, used
from fieldsid.cli.voice import angles
from fieldsid.comparison.left_by import left_by_addition
from fieldsid.comparison.sufficient import is_noise, pooled
from fieldsid.page import counted
from fieldsid.records.named_inputs import is_there
from fieldsid.rounding import MANY, noise_fall, number, times_noise

if TYPE_CHECKING:
    from fieldsid.models.model import Model
    from fieldsid.results.comparisons import Compared, ComparedSeveral
    from fieldsid.results.extensions import History
    from fieldsid.results.fits import FittedModel, Identified
    from fieldsid.results.logs import Simulation

CLOSE = 1.05
"""A ratio of two models' errors up to which neither is called the better."""
NO_NOISE, WHOLE_FIT = "filtered_sensor", 99.0
"""Code of the warning that a log shows no white noise, and the fit in per cent from which on nothing is missing of such a one."""


def of_identify(told: Identified, files: Sequence[Sequence[Path]]) -> Headline:
    """Return the parameters and what is left; files: of each fit."""
    fits, over = told.fits, [f.over_noise for f in told.fits]
    most = max(range(len(fits)), key=lambda i: over[i])
    left = _left(over[most], fits[most])
    if len(fits) == 1:
        says = f"{_parameters(fits[0])}; {left}"
    else:
        says = f"{counted(len(fits), 'model')}, {_span(fits)}; {left}, most in {fits[most].run}"
    runs = [r for f in fits for r in f.runs]
    seconds = sum(r.segment_s[1] - r.segment_s[0] for r in runs)
    methods = ", ".join(sorted({f.method for f in fits}))
    rests = f"{counted(len(runs), 'run')} fitted to, {seconds:.0f} s of {named([r.run for r in runs])}; {methods}"
    return Headline(says, rests, _after_fit(told, over, files))


def _left(over: float, fit: FittedModel) -> str:
    """Return what a fit leaves; of a log without noise, whose floor is that of its digits, how well it follows."""
    if over >= MANY or any(w.code == NO_NOISE for w in fit.warnings):
        fits = {n: f for n, f in (("angle", fit.merit.angle_fit), ("rate", fit.merit.rate_fit)) if isfinite(f)}
        followed = ", ".join(f"{n} fit {f:.1f} %" for n, f in fits.items())
        missing = ": something is missing" if min(fits.values()) < WHOLE_FIT else ""
        return f"{followed}, of a log with next to no noise{missing}"
    return f"what is left is {over:.2f} x the noise" + ("" if is_noise(over) else ": something is missing")


def _parameters(fit: FittedModel) -> str:
    """Return the numbers of a fit that are not of one run alone."""
    base = list(fit.parameters.values())[:MOST_NAMED]
    shown = [(p.shown, angles().estimate(e.value, e.std_error, e.interval95, e.unit)) for p in base for e in [p.estimate]]
    return ", ".join(f"{name} = {value} {unit}".rstrip() for name, (value, unit, _) in shown)


def _span(fits: Sequence[FittedModel]) -> str:
    name = next(iter(fits[0].parameters))
    values = sorted(f.parameters[name].estimate.value for f in fits if name in f.parameters)
    return f"{name} {number(values[0], 3)} .. {number(values[-1], 3)}"


def _after_fit(told: Identified, over: Sequence[float], files: Sequence[Sequence[Path]]) -> str:
    fits, axis = told.fits, told.axis.value
    written = [f.model for f in fits if f.model]
    if not written:
        return typed_with("-o", "models/")
    if not all(is_noise(o) for o in over):
        logs = [p for group in files for p in group]
        known = ("--model", written[0]) if len(written) == 1 and fits[0].effects else ()
        return pasted("diagnose", logs, "--axis", axis, *known)
    if len(written) > 1:
        return pasted("fit", written, "-o", f"law_{axis}.yaml")
    return used(axis, written[0])


def of_compare(told: Compared, model: Model, runs: Sequence[Path], inputs: Sequence[Path]) -> Headline:
    """Return what is left over all runs, the worst of them, and on what it was judged; inputs: what the model was fitted to."""
    entries, worst = told.runs, max(told.runs, key=lambda r: r.badness)
    over = pooled(r.over_noise for r in entries)
    error = f"error {worst.over_noise:.2f} x the noise, " if worst.over_noise < MANY else ""
    says = f"{worst.run}: {error}{worst.judged_by} fit {worst.fit:.1f} %"
    if len(entries) > 1 and over < MANY:
        says += f"; over all {len(entries)} runs {over:.2f} x"
    if is_noise(over):
        says += ": nothing is left but the noise"
    elif worst.where:
        says += f"; fails most at {angles().words(worst.where[0].condition)}"
    seen = [r.run for r in entries if r.fitted_to]
    judged = (
        "which it was not fitted to"
        if not seen
        else "which it was fitted to: no fair judge"
        if len(seen) == len(entries)
        else (f"{named(seen)} of them it was fitted to")
    )
    rests = f"a free run over {counted(len(entries), 'run')}, {judged}"
    return Headline(says, rests, after_compare(told.model, model, not is_noise(over), runs, inputs))


def after_compare(path: str, model: Model, fails: bool, runs: Sequence[Path], inputs: Sequence[Path]) -> str:
    """Return what to do with a model that does or does not follow its runs; one may leave more on those it was extended on."""
    axis, more = model.axis.value, fails or not is_noise(left_by_addition(model.info))
    if not more or searched(Path(path)):
        return used(axis, path)
    fitted = [p for p in inputs if is_there(p)]
    unseen = [p for p in runs if p.resolve() not in {f.resolve() for f in fitted}]
    known = ("--model", path) if model.effects else ()
    judged = repeated("--validate", unseen) if fitted else []
    return pasted("diagnose", fitted or list(runs), "--axis", axis, *known, *judged)


def searched(model: Path) -> bool:
    """Whether a diagnosis beside a model asked since it was written what it lacks, and named nothing to add.

    A model without effects is what a diagnosis of its own runs begins with, whether it is named there or not.
    """
    from fieldsid.logs.unknown_file import own_kind
    from fieldsid.records.named_inputs import inputs_of
    from fieldsid.records.reading import read_yaml

    own = {p.resolve() for p in inputs_of(model)} if not read_yaml(model).get("effects") else set()

    def asks_of(path: Path) -> bool:
        inputs = {p.resolve() for p in inputs_of(path)}
        return model.resolve() in inputs or (bool(own) and inputs == own)

    return any(
        own_kind(path) == "diagnosis"
        and path.stat().st_mtime_ns >= model.stat().st_mtime_ns
        and asks_of(path)
        and not read_yaml(path).get("effects")
        for path in model.parent.glob("*.yaml")
    )


def of_several(
    told: ComparedSeveral, names: Sequence[str], best: Model, runs: Sequence[Path], inputs: Sequence[Path]
) -> Headline:
    """Return which of several models follows the runs best, if any; inputs: what that one was fitted to."""
    scores = sorted(zip((m.over_floor for m in told.models), names, strict=True))
    (least, first), (second, _) = scores[:2]
    others = ", ".join(f"{n} at {f'{s:.2f} x' if s < MANY else times_noise(s)}" for s, n in scores[1:])
    word = "follows no better than the next" if second <= CLOSE * least else "follows best"
    fitted = [(n, named(m.fitted_to)) for n, m in zip(names, told.models, strict=True) if m.fitted_to]
    seen = [f"{n} was fitted to {to}: no fair judge of it" for n, to in fitted]
    if len(fitted) == len(names) and len({to for _, to in fitted}) == 1:
        seen = [f"every one was fitted to {fitted[0][1]}: no fair judge"]
    rests = "; ".join([f"{counted(len(told.models[0].runs), 'run')}, angle and rate pooled", *seen])
    then = after_compare(told.best, best, not is_noise(least), runs, inputs)
    return Headline(f"{first} {word}: {times_noise(least)}; {others}", rests, then)


def of_simulation(told: Simulation, axis: str, maneuver: str | None, run: Path | None) -> Headline:
    """Return how far a simulated motion goes."""
    reach = told.signals["yaw_rad" if axis == "yaw" else "pitch_rad"]
    how = f"the maneuver {maneuver}" if maneuver else f"the fin of {run}"
    times, unit = angles().of("rad")
    swing = f"{number(times * reach.low, 3)} .. {number(times * reach.high, 3)} {unit}"
    says = f"{told.seconds:.1f} s, {axis} {swing} under {how}"
    rests = f"{told.model}, {counted(told.samples, 'sample')}"
    if told.file is None:
        return Headline(says, rests, typed_with("-o", "simulated.parquet"))
    if run is None:
        return Headline(says, rests, pasted("identify", told.file, "--axis", axis, "-o", "models/"))
    return Headline(says, rests, pasted("compare", told.model, run))


def of_history(told: History, inputs: Sequence[Path]) -> Headline:
    """Return how the error fell along a model's line; inputs: what it was fitted to."""
    gains = [g.step.gain for g in told.generations if g.step]
    axis, model = told.axis.value, told.model
    is_searched = searched(Path(model))
    logs = [] if is_searched else [p for p in inputs if is_there(p)]
    if not gains:
        next_ = used(axis, model) if is_searched else pasted("diagnose", logs, "--axis", axis) if logs else pasted("status")
        return Headline("nothing was added yet", f"{model}, whose line begins with itself", next_)
    first, last = gains[0].over_floor[0], gains[-1].over_floor[1]
    added = ", then ".join("+".join(g.added) for g in gains)
    says = f"with {added} the error fell from {noise_fall(first, last)}"
    state = "every file is as it was" if told.intact else "not every file is as it was"
    more = not is_noise(last) and logs
    next_ = pasted("diagnose", logs, "--axis", axis, "--model", model) if more else used(axis, model)
    return Headline(says, f"{counted(len(told.generations), 'model')}, each hash checked: {state}", next_)
