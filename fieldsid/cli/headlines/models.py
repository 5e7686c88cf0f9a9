"""Headlines about a model: identify, compare, simulate, history."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.cli.headlines.headline import Headline
from fieldsid.cli.headlines.typed import pasted, typed_with
from fieldsid.cli.headlines.words import MOST_NAMED, first_names, next_use, records_in
from fieldsid.cli.voice import angles
from fieldsid.comparison.left_by import left_by_addition
from fieldsid.comparison.sufficient import is_noise, pooled
from fieldsid.page import counted
from fieldsid.records.named_inputs import inputs_of, is_there
from fieldsid.records.reading import read_yaml
from fieldsid.rounding import MANY, noise_fall, number, times_noise
from fieldsid.trial_folder.patterns import repeated
from fieldsid.views.comparison import verdict

if TYPE_CHECKING:
    from fieldsid.comparison.compare import Comparison
    from fieldsid.models.model import Model
    from fieldsid.results.comparisons import Compared, ComparedSeveral
    from fieldsid.results.extensions import History
    from fieldsid.results.fits import FittedModel, Identified
    from fieldsid.results.logs import Simulation

CLOSE = 1.05
"""Ratio of two models' errors up to which neither counts as better."""
NO_NOISE, WHOLE_FIT = "filtered_sensor", 99.0
"""Code of the warning that a log shows no white noise, and the fit (per cent) above which nothing is missing in such a log."""


def headline_of_identify(result: Identified, files: Sequence[Sequence[Path]]) -> Headline:
    """Return the parameters and the error over the noise; files: the logs of each fit."""
    fits, over = result.fits, [f.over_noise for f in result.fits]
    most = max(range(len(fits)), key=lambda i: over[i])
    left = _error_in_words(over[most], fits[most])
    if len(fits) == 1:
        says = f"{_parameters(fits[0])}; {left}"
    else:
        says = f"{counted(len(fits), 'model')}, {_range_in_words(fits)}; {left}, most in {fits[most].run}"
    runs = [r for f in fits for r in f.runs]
    seconds = sum(r.segment_s[1] - r.segment_s[0] for r in runs)
    methods = ", ".join(sorted({f.method for f in fits}))
    rests = f"{counted(len(runs), 'run')} fitted to, {seconds:.0f} s of {first_names([r.run for r in runs])}; {methods}"
    return Headline(says, rests, _next_command(result, over, files))


def _error_in_words(over: float, fit: FittedModel) -> str:
    """Return the error of a fit over the noise; for a log without noise but rounding, the fit of angle and rate in per cent."""
    if over >= MANY or any(w.code == NO_NOISE for w in fit.warnings):
        fits = {n: f for n, f in (("angle", fit.merit.angle_fit), ("rate", fit.merit.rate_fit)) if isfinite(f)}
        followed = ", ".join(f"{n} fit {f:.1f} %" for n, f in fits.items())
        missing = ": something is missing" if min(fits.values()) < WHOLE_FIT else ""
        return f"{followed}, of a log with next to no noise{missing}"
    return f"what is left is {over:.2f} x the noise" + ("" if is_noise(over) else ": something is missing")


def _parameters(fit: FittedModel) -> str:
    """Return the first few parameters of a fit with their standard errors."""
    base = list(fit.parameters.values())[:MOST_NAMED]
    shown = [(p.shown, angles().estimate(e.value, e.std_error, e.interval95, e.unit)) for p in base for e in [p.estimate]]
    return ", ".join(f"{name} = {value} {unit}".rstrip() for name, (value, unit, _) in shown)


def _range_in_words(fits: Sequence[FittedModel]) -> str:
    name = next(iter(fits[0].parameters))
    values = sorted(f.parameters[name].estimate.value for f in fits if name in f.parameters)
    return f"{name} {number(values[0], 3)} .. {number(values[-1], 3)}"


def _next_command(result: Identified, over: Sequence[float], files: Sequence[Sequence[Path]]) -> str:
    fits, axis = result.fits, result.axis.value
    written = [f.model for f in fits if f.model]
    if not written:
        return typed_with("-o", "models/")
    if not all(is_noise(o) for o in over):
        logs = [p for group in files for p in group]
        known = ("--model", written[0]) if len(written) == 1 and fits[0].effects else ()
        return pasted("diagnose", logs, "--axis", axis, *known)
    if len(written) > 1:
        return pasted("fit", written, "-o", f"law_{axis}.yaml")
    return next_use(axis, written[0])


def headline_of_compare(result: Compared, found: Sequence[Comparison], runs: Sequence[Path], inputs: Sequence[Path]) -> Headline:
    """Return the error of the worst run and over all runs; inputs: the logs that the model was fitted to."""
    seen, over = [r.comparison.run for r in result.runs if r.fitted_to], pooled(c.over_noise for c in found)
    judged = f"{first_names(seen)} of them it was fitted to" if seen else "which it was not fitted to"
    judged = "which it was fitted to: no fair judge" if len(seen) == len(found) else judged
    rests = f"a free run over {counted(len(found), 'run')}, {judged}"
    then = command_after_compare(result.model, found[0].model, not is_noise(over), runs, inputs)
    return Headline(verdict(found, angles()), rests, then)


def command_after_compare(path: str, model: Model, fails: bool, runs: Sequence[Path], inputs: Sequence[Path]) -> str:
    """Return the next command for a compared model: its use, or a diagnosis where it fails.

    fails: its error on the compared runs exceeds the noise. A model that left more than the noise when it was extended fails too.
    """
    axis, lacks = model.axis.value, fails or not is_noise(left_by_addition(model.info))
    if not lacks or is_diagnosed(Path(path)):
        return next_use(axis, path)
    fitted = [p for p in inputs if is_there(p)]
    unseen = [p for p in runs if p.resolve() not in {f.resolve() for f in fitted}]
    known = ("--model", path) if model.effects else ()
    judged = repeated("--validate", unseen) if fitted else []
    return pasted("diagnose", fitted or list(runs), "--axis", axis, *known, *judged)


def is_diagnosed(model: Path) -> bool:
    """Whether a diagnosis in the model's folder was made after the model was written, and named no effect to add.

    A diagnosis of the same runs counts for a model without effects even if it does not name it: it starts from that model.
    """
    fitted = {p.resolve() for p in inputs_of(model)} if not read_yaml(model).get("effects") else set()
    since = model.stat().st_mtime_ns
    return any(
        path.stat().st_mtime_ns >= since
        and not body.get("effects")
        and (model.resolve() in inputs or (bool(fitted) and inputs == fitted))
        for path, body, inputs in records_in([model.parent], "diagnosis")
    )


def headline_of_several(
    result: ComparedSeveral, names: Sequence[str], best: Model, runs: Sequence[Path], inputs: Sequence[Path]
) -> Headline:
    """Return which of several models follows the runs best, if any; inputs: the logs that the best was fitted to."""
    scores = sorted(zip((m.over_floor for m in result.models), names, strict=True))
    (least, first), (second, _) = scores[:2]
    others = ", ".join(f"{n} at {f'{s:.2f} x' if s < MANY else times_noise(s)}" for s, n in scores[1:])
    word = "follows no better than the next" if second <= CLOSE * least else "follows best"
    fitted = [(n, first_names(m.fitted_to)) for n, m in zip(names, result.models, strict=True) if m.fitted_to]
    seen = [f"{n} was fitted to {to}: no fair judge of it" for n, to in fitted]
    if len(fitted) == len(names) and len({to for _, to in fitted}) == 1:
        seen = [f"every one was fitted to {fitted[0][1]}: no fair judge"]
    rests = "; ".join([f"{counted(len(result.models[0].runs), 'run')}, angle and rate pooled", *seen])
    then = command_after_compare(result.best, best, not is_noise(least), runs, inputs)
    return Headline(f"{first} {word}: {times_noise(least)}; {others}", rests, then)


def headline_of_simulation(result: Simulation, axis: str, maneuver: str | None, run: Path | None) -> Headline:
    """Return the duration of a simulated motion and the range of its angle."""
    reach = result.signals["yaw_rad" if axis == "yaw" else "pitch_rad"]
    how = f"the maneuver {maneuver}" if maneuver else f"the fin of {run}"
    factor, unit = angles().of("rad")
    swing = f"{number(factor * reach.low, 3)} .. {number(factor * reach.high, 3)} {unit}"
    says = f"{result.seconds:.1f} s, {axis} {swing} under {how}"
    rests = f"{result.model}, {counted(result.samples, 'sample')}"
    if result.file is None:
        return Headline(says, rests, typed_with("-o", "simulated.parquet"))
    if run is None:
        return Headline(says, rests, pasted("identify", result.file, "--axis", axis, "-o", "models/"))
    return Headline(says, rests, pasted("compare", result.model, run))


def headline_of_history(result: History, inputs: Sequence[Path]) -> Headline:
    """Return how the error fell with each added effect; inputs: the logs that the model was fitted to."""
    gains = [g.step.gain for g in result.generations if g.step]
    axis, model = result.axis.value, result.model
    was_diagnosed = is_diagnosed(Path(model))
    logs = [] if was_diagnosed else [p for p in inputs if is_there(p)]
    if not gains:
        next_ = next_use(axis, model) if was_diagnosed else pasted("diagnose", logs, "--axis", axis) if logs else pasted("status")
        return Headline("nothing was added yet", f"{model}, whose line begins with itself", next_)
    first, last = gains[0].over_floor[0], gains[-1].over_floor[1]
    added = ", then ".join("+".join(g.added) for g in gains)
    says = f"with {added} the error fell from {noise_fall(first, last)}"
    state = "every file is as it was" if result.intact else "not every file is as it was"
    more = not is_noise(last) and logs
    next_ = pasted("diagnose", logs, "--axis", axis, "--model", model) if more else next_use(axis, model)
    return Headline(says, f"{counted(len(result.generations), 'model')}, each hash checked: {state}", next_)
