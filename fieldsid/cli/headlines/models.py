"""Headlines of what is done with a model: identify, compare, simulate, history."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from pathlib import Path

from fieldsid.cli.headlines.headline import Headline
from fieldsid.cli.headlines.typed import pasted, repeated, typed_with
from fieldsid.cli.headlines.words import MOST_NAMED, Body, named, used
from fieldsid.cli.voice import angles
from fieldsid.comparison.sufficient import is_noise, over_noise, pooled
from fieldsid.page import counted
from fieldsid.records.named_inputs import is_there
from fieldsid.rounding import MANY, noise_fall, number, times_noise

NO_NOISE, WHOLE_FIT = "filtered_sensor", 99.0
"""Code of the warning that a log shows no white noise, and the fit in per cent from which on nothing is missing of such a one."""


def of_identify(body: Body, files: Sequence[Sequence[Path]]) -> Headline:
    """Return the parameters and what is left; files: of each fit."""
    fits, axis = body["fits"], str(body["axis"])
    over = [over_noise(f, f["noise_floor"]) for f in fits]
    most = max(range(len(fits)), key=lambda i: over[i])
    left = _left(over[most], fits[most])
    if len(fits) == 1:
        says = f"{_parameters(fits[0])}; {left}"
    else:
        says = f"{counted(len(fits), 'model')}, {_span(fits)}; {left}, most in {fits[most]['run']}"
    runs = [r for f in fits for r in f["runs"]]
    seconds = sum(float(r["segment_s"][1] - r["segment_s"][0]) for r in runs)
    methods = ", ".join(sorted({str(f["method"]) for f in fits}))
    rests = f"{counted(len(runs), 'run')} fitted to, {seconds:.0f} s of {named([str(r['run']) for r in runs])}; {methods}"
    return Headline(says, rests, _after_fit(body, axis, over, files))


def _left(over: float, fit: Body) -> str:
    """Return what a fit leaves; of a log without noise, whose floor is that of its digits, how well it follows."""
    fits = [f for n in ("angle", "rate") if isfinite(f := fit[f"{n}_fit_percent"])]
    if over >= MANY or any(w["code"] == NO_NOISE for w in fit["warnings"]):
        followed = (f"{n} fit {fit[f'{n}_fit_percent']:.1f} %" for n in ("angle", "rate") if isfinite(fit[f"{n}_fit_percent"]))
        missing = ": something is missing" if min(fits) < WHOLE_FIT else ""
        return f"{', '.join(followed)}, of a log with next to no noise{missing}"
    return f"what is left is {over:.2f} x the noise" + ("" if is_noise(over) else ": something is missing")


def _parameters(fit: Body) -> str:
    """Return the numbers of a fit that are not of one run alone."""
    base = list(fit["parameters"].values())[:MOST_NAMED]
    shown = [(p["shown"], angles().estimate(p["value"], p["std_error"], p["interval95"], p["unit"])) for p in base]
    return ", ".join(f"{name} = {value} {unit}".rstrip() for name, (value, unit, _) in shown)


def _span(fits: Sequence[Body]) -> str:
    name = next(iter(fits[0]["parameters"]))
    values = sorted(float(f["parameters"][name]["value"]) for f in fits if name in f["parameters"])
    return f"{name} {number(values[0], 3)} .. {number(values[-1], 3)}"


def _after_fit(body: Body, axis: str, over: Sequence[float], files: Sequence[Sequence[Path]]) -> str:
    fits = body["fits"]
    written = [str(f["model"]) for f in fits if f["model"]]
    if not written:
        return typed_with("-o", "models/")
    if not all(is_noise(o) for o in over):
        logs = [p for group in files for p in group]
        known = ("--model", written[0]) if len(written) == 1 and fits[0]["effects"] else ()
        return pasted("diagnose", logs, "--axis", axis, *known)
    if len(written) > 1:
        return pasted("fit", written, "-o", f"law_{axis}.yaml")
    return used(axis, written[0])


def of_compare(body: Body, runs: Sequence[Path], inputs: Sequence[Path]) -> Headline:
    """Return what is left over all runs, the worst of them, and on what it was judged; inputs: what the model was fitted to."""
    entries, axis = body["runs"], str(body["axis"])
    worst = max(entries, key=_badness)
    channel = worst["judged_by"]
    over = pooled(float(e["over_noise"]) for e in entries)
    error = f"error {worst['over_noise']:.2f} x the noise, " if worst["over_noise"] < MANY else ""
    says = f"{worst['run']}: {error}{channel} fit {worst[f'{channel}_fit_percent']:.1f} %"
    if len(entries) > 1 and over < MANY:
        says += f"; over all {len(entries)} runs {over:.2f} x"
    if is_noise(over):
        says += ": nothing is left but the noise"
    elif worst["where"]:
        says += f"; fails most at {angles().words(worst['where'][0]['condition'])}"
    seen = [e["run"] for e in entries if e["fitted_to"]]
    judged = (
        "which it was not fitted to"
        if not seen
        else "which it was fitted to: no fair judge"
        if len(seen) == len(entries)
        else (f"{named(seen)} of them it was fitted to")
    )
    rests = f"a free run over {counted(len(entries), 'run')}, {judged}"
    return Headline(says, rests, after_compare(body["model"], axis, not is_noise(over), runs, inputs))


def after_compare(model: str, axis: str, fails: bool, runs: Sequence[Path], inputs: Sequence[Path]) -> str:
    """Return what to do with a model that does or does not follow its runs; one may leave more on those it was extended on."""
    from fieldsid.models.model import load_model
    from fieldsid.records.reading import read_yaml
    from fieldsid.trial_folder.next_step import left_by

    more = fails or not is_noise(left_by(read_yaml(Path(model))))
    if not more or searched(Path(model)):
        return used(axis, model)
    fitted = [p for p in inputs if is_there(p)]
    unseen = [p for p in runs if p.resolve() not in {f.resolve() for f in fitted}]
    known = ("--model", model) if load_model(Path(model)).effects else ()
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


def _badness(entry: Body) -> tuple[float, float]:
    from fieldsid.comparison.compare import badness

    return badness(float(entry["over_noise"]), float(entry[f"{entry['judged_by']}_fit_percent"]))


def of_several(body: Body, names: Sequence[str], runs: Sequence[Path], inputs: Sequence[Path], *, close: float) -> Headline:
    """Return which of several models follows the runs best, if any; inputs: what that one was fitted to."""
    scores = sorted(zip((float(m["over_floor"]) for m in body["models"]), names, strict=True))
    (least, best), (second, _) = scores[:2]
    others = ", ".join(f"{n} at {f'{s:.2f} x' if s < MANY else times_noise(s)}" for s, n in scores[1:])
    word = "follows no better than the next" if second <= close * least else "follows best"
    over = body["models"][0]["runs"]
    fitted = [(n, named(m["fitted_to"])) for n, m in zip(names, body["models"], strict=True) if m["fitted_to"]]
    seen = [f"{n} was fitted to {to}: no fair judge of it" for n, to in fitted]
    if len(fitted) == len(names) and len({to for _, to in fitted}) == 1:
        seen = [f"every one was fitted to {fitted[0][1]}: no fair judge"]
    rests = f"{counted(len(over), 'run')}, angle and rate pooled" + (f"; {'; '.join(seen)}" if seen else "")
    return Headline(
        f"{best} {word}: {times_noise(least)}; {others}",
        rests,
        after_compare(body["best"], str(body["axis"]), not is_noise(least), runs, inputs),
    )


def of_simulation(body: Body, axis: str, maneuver: str | None, run: Path | None) -> Headline:
    """Return how far a simulated motion goes."""
    name = "yaw_rad" if axis == "yaw" else "pitch_rad"
    reach = body["signals"][name]
    how = f"the maneuver {maneuver}" if maneuver else f"the fin of {run}"
    times, unit = angles().of("rad")
    swing = f"{number(times * reach['low'], 3)} .. {number(times * reach['high'], 3)} {unit}"
    says = f"{body['seconds']:.1f} s, {axis} {swing} under {how}"
    rests = f"{body['model']}, {counted(body['samples'], 'sample')}"
    if body["file"] is None:
        return Headline(says, rests, typed_with("-o", "simulated.parquet"))
    next_ = (
        pasted("identify", body["file"], "--axis", axis, "-o", "models/")
        if run is None
        else pasted("compare", body["model"], run)
    )
    return Headline(says, rests, next_)


def of_history(body: Body, inputs: Sequence[Path]) -> Headline:
    """Return how the error fell along a model's line; inputs: what it was fitted to."""
    steps = [g for g in body["generations"] if g.get("over_floor")]
    axis, model = str(body["axis"]), str(body["model"])
    is_searched = searched(Path(model))
    logs = [] if is_searched else [p for p in inputs if is_there(p)]
    if not steps:
        next_ = used(axis, model) if is_searched else pasted("diagnose", logs, "--axis", axis) if logs else pasted("status")
        return Headline("nothing was added yet", f"{model}, whose line begins with itself", next_)
    first, last = steps[0]["over_floor"]["before"], steps[-1]["over_floor"]["after"]
    added = ", then ".join("+".join(g["added"]) for g in steps)
    says = f"with {added} the error fell from {noise_fall(first, last)}"
    state = "every file is as it was" if body["intact"] else "not every file is as it was"
    more = not is_noise(last) and logs
    next_ = pasted("diagnose", logs, "--axis", axis, "--model", model) if more else used(axis, model)
    return Headline(says, f"{counted(len(body['generations']), 'model')}, each hash checked: {state}", next_)
