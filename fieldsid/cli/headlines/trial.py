"""Headlines of the trial as a whole: init, plan, status, report, batch, demo."""

from __future__ import annotations

import shlex
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.cli.headlines.headline import Headline
from fieldsid.cli.headlines.typed import pasted, typed_with
from fieldsid.page import counted
from fieldsid.trial_folder.next_step import PORT

if TYPE_CHECKING:
    from fieldsid.results.plans import Planned
    from fieldsid.results.trial import Batch, Demo, Init, Report, Status


def of_trial(told: Init) -> Headline:
    """Return the folder that was made."""
    return Headline(
        f"{told.folder}: a trial folder; fill in its vehicle.yaml and put the logs in {told.folder}/logs",
        f"the template {told.template}: its limits are not your vehicle's",
        f"cd {shlex.quote(told.folder)} && {pasted('status')}",
    )


def of_plan(told: Planned, model: Path | None) -> Headline:
    """Return what is to be flown and what it buys."""
    from fieldsid.planning.design.leg import error_in_words
    from fieldsid.planning.safety.envelope import NOT_LIMITED

    plan, legs = told.plan, told.plan.legs
    shown = [{n: e for n, e in leg.expected.items() if isfinite(e.relative) and e.relative} for leg in legs]
    at_most = [max((e.relative for e in known.values()), default=0.0) for known in shown]
    hardest = at_most.index(max(at_most))
    bought = ", ".join(f"{n} to {error_in_words(e.value, e.std_error, e.relative)}" for n, e in shown[hardest].items())
    speeds = {leg.speed for leg in legs}
    which = f", the least sure of {len(speeds)} speeds" if len(speeds) > 1 else f", by the least sure of {len(legs)} legs"
    at = f" at {legs[hardest].speed:g} m/s{which}" if len(legs) > 1 else ""
    what = "minutes" if plan.minutes != 1 else "minute"
    says = f"{counted(len(legs), 'leg')} of {plan.minutes:.1f} {what} buy {bought or 'what tells the effects apart'}{at}"
    known_by = str(model) if model is not None else f"the prior {plan.prior}"
    unlimited = [name for name, limit in plan.limits.items() if limit == NOT_LIMITED]
    risk = f"risk of leaving the envelope {100.0 * plan.break_probability:.1f} %"
    rests = f"{known_by}; {risk}, {NOT_LIMITED}: {', '.join(unlimited) or 'nothing'}"
    file = next((f for f in told.files if Path(f).name == "plan.yaml"), None)
    if file is None:
        return Headline(says, rests, typed_with("-o", "plan"))
    return Headline(says, rests, pasted("live", "--axis", plan.axis.value, "--udp", str(PORT), "--plan", file))


def of_status(told: Status) -> Headline:
    """Return what a folder holds and what to do next."""
    lines = counted(len(told.journal), "line")
    rests = f"{counted(len(told.files), 'file')}, {lines} of the journal; {told.next.why}"
    return Headline(told.verdict, rests, told.next.command)


def of_report(told: Report, folder: Path) -> Headline:
    """Return what the report says first, and how it is opened."""
    first = next((f"{v.what}: {v.says}" for v in told.verdicts), "nothing was identified yet")
    rests = (
        f"{counted(len(told.runs), 'run')} and {counted(len(told.models), 'model')} in {folder.resolve().name}: "
        f"{told.file}, {told.bytes / 1e6:.2f} MB, {counted(told.figures, 'figure')}"
    )
    return Headline(first, rests, f"python -m webbrowser {shlex.quote(told.file)}")


def of_batch(told: Batch, *, trend: bool) -> Headline:
    """Return how many runs were identified and what was found in them."""
    bad = told.skipped_runs
    verdicts = ", ".join(f"{count} {name}" for name, count in told.verdicts.items())
    effects = ", ".join(f"{name} {count}" for name, count in list(told.effects.items())[:4])
    found = (verdicts or "not diagnosed") + (f" ({effects})" if effects else "")
    known = f", {told.known_logs} of them known" if told.known_logs else ""
    return Headline(
        f"{counted(told.runs, 'run')} identified, {len(bad)} not; {found}",
        f"{counted(told.logs, 'log')}{known}, took {told.seconds:.1f} s on {told.where}",
        typed_with("--trend") if told.runs and not trend else pasted("inspect", bad[0].file) if bad else "",
    )


def of_demo(told: Demo) -> Headline:
    """Return whether the hidden effect was found."""
    from fieldsid.models.axis import NAMES

    hidden, base = told.hidden, NAMES[told.hidden.axis].base
    values = ", ".join(f"{n} = {v:.3g}" for n, v in hidden.values.items() if n not in base)
    figures = sum(f.endswith(".png") for f in told.files)
    return Headline(
        f"hidden in the trial was {hidden.effect} ({values}); diagnose named {', '.join(told.named) or 'nothing'}",
        f"{counted(len(told.files), 'file')} in {told.folder}, {figures} of them figures; the tour took {told.seconds:.1f} s",
        pasted("status", told.folder),
    )
