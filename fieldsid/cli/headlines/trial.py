"""Headlines of the trial as a whole: init, plan, status, report, batch, demo."""

from __future__ import annotations

import shlex
from pathlib import Path

from fieldsid.cli.headlines.headline import Headline
from fieldsid.cli.headlines.typed import pasted, typed_with
from fieldsid.cli.headlines.words import Body
from fieldsid.page import counted
from fieldsid.trial_folder.next_step import PORT


def of_trial(body: Body) -> Headline:
    """Return the folder that was made."""
    folder, template = str(body["folder"]), str(body["template"])
    return Headline(
        f"{folder}: a trial folder; fill in its vehicle.yaml and put the logs in {folder}/logs",
        f"the template {template}: its limits are not your vehicle's",
        f"cd {shlex.quote(folder)} && {pasted('status')}",
    )


def of_plan(body: Body, model: Path | None) -> Headline:
    """Return what is to be flown and what it buys."""
    from fieldsid.planning.design.leg import error_in_words

    legs = body["legs"]
    hardest = max(legs, key=lambda leg: max((float(e["relative"] or 0.0) for e in leg["expected"].values()), default=0.0))
    bought = ", ".join(
        f"{name} to {error_in_words(e['value'], e['std_error'], e['relative'])}"
        for name, e in hardest["expected"].items()
        if e["relative"]
    )
    speeds = {leg["speed_m_s"] for leg in legs}
    which = f", the least sure of {len(speeds)} speeds" if len(speeds) > 1 else f", by the least sure of {len(legs)} legs"
    at = f" at {hardest['speed_m_s']:g} m/s{which}" if len(legs) > 1 else ""
    what = "minutes" if body["minutes"] != 1 else "minute"
    says = f"{counted(len(legs), 'leg')} of {body['minutes']:.1f} {what} buy {bought or 'what tells the effects apart'}{at}"
    known = str(model) if model is not None else f"the prior {body['prior']}"
    unlimited = [name for name, limit in body["limits"].items() if limit == "NOT LIMITED"]
    risk = f"risk of leaving the envelope {100.0 * body['break_probability']:.1f} %"
    rests = f"{known}; {risk}, NOT LIMITED: {', '.join(unlimited) or 'nothing'}"
    plan = next((f for f in body["files"] if Path(f).name == "plan.yaml"), None)
    if plan is None:
        return Headline(says, rests, typed_with("-o", "plan"))
    return Headline(says, rests, pasted("live", "--axis", body["axis"], "--udp", str(PORT), "--plan", plan))


def of_status(body: Body) -> Headline:
    """Return what a folder holds and what to do next."""
    lines = counted(len(body["journal"]), "line")
    rests = f"{counted(len(body['files']), 'file')}, {lines} of the journal; {body['next']['why']}"
    return Headline(str(body["verdict"]), rests, str(body["next"]["command"]))


def of_report(body: Body, folder: Path) -> Headline:
    """Return what the report says first, and how it is opened."""
    verdicts = body["verdicts"]
    first = f"{verdicts[0]['what']}: {verdicts[0]['says']}" if verdicts else "nothing was identified yet"
    rests = (
        f"{counted(len(body['runs']), 'run')} and {counted(len(body['models']), 'model')} in {folder.resolve().name}: "
        f"{body['file']}, {body['bytes'] / 1e6:.2f} MB, {counted(body['figures'], 'figure')}"
    )
    return Headline(first, rests, f"python -m webbrowser {shlex.quote(str(body['file']))}")


def of_batch(body: Body, *, trend: bool) -> Headline:
    """Return how many runs were identified and what was found in them."""
    bad = body["skipped_runs"]
    verdicts = ", ".join(f"{count} {name}" for name, count in body["verdicts"].items())
    effects = ", ".join(f"{name} {count}" for name, count in list(body["effects"].items())[:4])
    found = (verdicts or "not diagnosed") + (f" ({effects})" if effects else "")
    known = f", {body['known_logs']} of them known" if body["known_logs"] else ""
    return Headline(
        f"{counted(body['runs'], 'run')} identified, {len(bad)} not; {found}",
        f"{counted(body['logs'], 'log')}{known}, took {body['seconds']:.1f} s on {body['where']}",
        typed_with("--trend") if body["runs"] and not trend else pasted("inspect", bad[0]["file"]) if bad else "",
    )


def of_demo(body: Body) -> Headline:
    """Return whether the hidden effect was found."""
    from fieldsid.models.axis import NAMES, Axis

    hidden, folder = body["hidden"], str(body["folder"])
    base = NAMES[Axis(hidden["axis"])].base
    values = ", ".join(f"{n} = {v:.3g}" for n, v in hidden["values"].items() if n not in base)
    own = ", ".join(body["named"]) or "nothing"
    figures = sum(f.endswith(".png") for f in body["files"])
    return Headline(
        f"hidden in the trial was {hidden['effect']} ({values}); diagnose named {own}",
        f"{counted(len(body['files']), 'file')} in {folder}, {figures} of them figures; the tour took {body['seconds']:.1f} s",
        pasted("status", folder),
    )
