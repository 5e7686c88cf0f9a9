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


def headline_of_trial(result: Init) -> Headline:
    """Return the folder that was made."""
    return Headline(
        f"{result.folder}: a trial folder; fill in its vehicle.yaml and put the logs in {result.folder}/logs",
        f"the template {result.template}: its limits are not your vehicle's",
        f"cd {shlex.quote(result.folder)} && {pasted('status')}",
    )


def headline_of_plan(result: Planned, model: Path | None) -> Headline:
    """Return the legs to fly, their time, and the standard errors that they are expected to give."""
    from fieldsid.planning.design.leg import error_in_words
    from fieldsid.planning.safety.envelope import NOT_LIMITED

    plan, legs = result.plan, result.plan.legs
    shown = [{n: e for n, e in leg.expected.items() if isfinite(e.relative) and e.relative} for leg in legs]
    worst = [max((e.relative for e in known.values()), default=0.0) for known in shown]
    hardest = worst.index(max(worst))
    bought = ", ".join(f"{n} to {error_in_words(e.value, e.std_error, e.relative)}" for n, e in shown[hardest].items())
    speeds = {leg.speed for leg in legs}
    which = f", the least sure of {len(speeds)} speeds" if len(speeds) > 1 else f", by the least sure of {len(legs)} legs"
    at = f" at {legs[hardest].speed:g} m/s{which}" if len(legs) > 1 else ""
    time = f"{plan.minutes:.1f} {'minutes' if plan.minutes != 1 else 'minute'}{' in all' if len(legs) > 1 else ''}"
    does = f"buy {bought or 'nothing that shows'}{at}"
    if result.separation is not None:
        does = f"tell {result.separation.verdict()}"
    does = does if len(legs) > 1 else does.replace(" ", "s ", 1)
    says = f"{counted(len(legs), 'leg')} of {time} {does}"
    known_by = str(model) if model is not None else f"the prior {plan.prior}"
    unlimited = [name for name, limit in plan.limits.items() if limit == NOT_LIMITED]
    risk = f"risk of leaving the envelope {100.0 * plan.break_probability:.1f} %"
    rests = f"{known_by}; {risk}, {NOT_LIMITED}: {', '.join(unlimited) or 'nothing'}"
    file = next((f for f in result.files if Path(f).name == "plan.yaml"), None)
    live = file and pasted("live", "--axis", plan.axis.value, "--udp", str(PORT), "--plan", file)
    return Headline(says, rests, live or typed_with("-o", "plan"))


def headline_of_status(result: Status) -> Headline:
    """Return what a folder contains and what to do next."""
    state = result.state
    rests = f"{counted(len(state.items), 'file')}, {counted(len(state.entries), 'line')} of the journal; {result.next.why}"
    return Headline(result.verdict, rests, result.next.command)


def headline_of_report(result: Report, folder: Path) -> Headline:
    """Return the first verdict of the report; the next command opens it."""
    first = next((f"{v.what}: {v.says}" for v in result.verdicts), "nothing was identified yet")
    rests = (
        f"{counted(len(result.runs), 'run')} and {counted(len(result.models), 'model')} in {folder.resolve().name}: "
        f"{result.file}, {result.bytes / 1e6:.2f} MB, {counted(result.figures, 'figure')}"
    )
    return Headline(first, rests, f"python -m webbrowser {shlex.quote(result.file)}")


def headline_of_batch(result: Batch, *, trend: bool) -> Headline:
    """Return how many runs were identified and what was found in them."""
    bad = result.skipped_runs
    verdicts = ", ".join(f"{count} {name}" for name, count in result.verdicts.items())
    effects = ", ".join(f"{name} {count}" for name, count in list(result.effects.items())[:4])
    found = (verdicts or "not diagnosed") + (f" ({effects})" if effects else "")
    known = f", {result.known_logs} of them known" if result.known_logs else ""
    return Headline(
        f"{counted(result.runs, 'run')} identified, {len(bad)} not; {found}",
        f"{counted(result.logs, 'log')}{known}, took {result.seconds:.1f} s on {result.where}",
        typed_with("--trend") if result.runs and not trend else pasted("inspect", bad[0].file) if bad else "",
    )


def headline_of_demo(result: Demo) -> Headline:
    """Return the hidden effect and the effects that the diagnosis named."""
    from fieldsid.models.axis import NAMES

    hidden, base = result.hidden, NAMES[result.hidden.axis].base
    values = ", ".join(f"{n} = {v:.3g}" for n, v in hidden.values.items() if n not in base)
    files, figures = counted(len(result.files), "file"), sum(f.endswith(".png") for f in result.files)
    return Headline(
        f"hidden in the trial was {hidden.effect} ({values}); diagnose named {', '.join(result.named) or 'nothing'}",
        f"{files} in {result.folder}, {figures} of them figures; the tour took {result.seconds:.1f} s",
        pasted("status", result.folder),
    )
