"""The sections of the report: verdicts first, then each part with its numbers, as plain data for the templates."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from typing import Any

from fieldsid._version import __version__
from fieldsid.comparison.compare import Channel, left_in_words
from fieldsid.comparison.sufficient import is_noise, pooled
from fieldsid.display import line_of, page_of
from fieldsid.extension.lineage import Loop
from fieldsid.figures import compare, law, loop, schedule, turn
from fieldsid.figures.bars import places
from fieldsid.models.axis import NAMES
from fieldsid.page import Block, counted
from fieldsid.reporting.chart import bars, chart, legend
from fieldsid.reporting.made_from import lineage
from fieldsid.reporting.material import AxisMaterial, Material, Shown
from fieldsid.rounding import DEGREES, MANY, number
from fieldsid.schedule.record import Schedule
from fieldsid.trial_folder.journal import Entry
from fieldsid.trial_folder.next_step import REPORT, verification_of
from fieldsid.trial_folder.patterns import shortened
from fieldsid.trial_folder.state import DONE, FolderState, Item
from fieldsid.views._candidates import candidates
from fieldsid.views._words import merit_blocks, parameter_block
from fieldsid.views.comparison import verdict
from fieldsid.views.schedule import blocks_of
from fieldsid.views.turn_prediction import tightest, turns_of


def context_of(material: Material) -> dict[str, Any]:
    """Return the template's context for a report's material."""
    state, (why, command) = material.state, material.next_step
    name = material.vehicle.name if material.vehicle is not None else state.folder.resolve().name
    return {
        "name": name,
        "folder": state.folder.resolve().name,
        "made": datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z"),
        "tool": f"fieldsid {__version__}",
        "verdicts": [v for a in material.axes for v in _verdicts(a, state)] + _state_verdict(state),
        "next": {"why": why, "command": "" if command.startswith(REPORT) else command},  # this page is that report
        "runs": [{"name": r.name, "says": line_of(r), "page": page_of(r)} for r in material.runs],
        "models": [s.path for a in material.axes for s in a.shown],
        "axes": [_axis(a) for a in material.axes],
        "vehicle": _vehicle(material),
        "files": lineage(state),
        "commands": _commands(state),
        "notes": material.notes.strip(),
        "skipped": list(material.skipped),
    }


def _verdicts(axis: AxisMaterial, state: FolderState) -> list[dict[str, str]]:
    best = axis.shown[0]
    out = []
    if best.found:
        unseen = [c for c in best.found if not best.was_fitted_to(c.run)]
        judged = unseen or best.found
        on = f"on {counted(len(judged), 'run')} {'it was not fitted to' if unseen else 'it was fitted to'}"
        says, good = f"{on}: {verdict(judged, DEGREES)}", is_noise(pooled(c.over_noise for c in judged))
        effects = f" with {', '.join(best.model.effects)}" if best.model.effects else ""
        out.append({"what": f"{axis.axis} model{effects}", "says": says, "state": "good" if good else "warn"})
    if axis.diagnosis is not None:
        body = axis.diagnosis.body
        says = str(body.get("short") or body.get("says", ""))
        out.append({"what": f"{axis.axis} diagnosis: {body['verdict']}", "says": says, "state": "plain"})
    if axis.turning is not None:
        out.append(_turn_verdict(axis.turning.body))
    if axis.schedule is not None and axis.gains is not None:
        out.append(_gain_verdict(axis.gains, verification_of(state, axis.schedule)))
    return out


def _turn_verdict(body: Mapping[str, Any]) -> dict[str, str]:
    row = min(body["rows"], key=lambda r: float(r["radius_m"]))
    return {"what": "tightest turn", "says": tightest(row), "state": "warn" if row["extrapolated"] else "good"}


FAILED = ("does not hold", "FAILED")
"""First words of a verification that the gains did not pass."""


def _gain_verdict(gains: Schedule, verified: Entry | None) -> dict[str, str]:
    worst, wanted = min(gains.rows, key=lambda r: r.phase_margin_deg), gains.phase_margin_deg
    phase = worst.phase_margin_deg
    says = f"{line_of(gains)} at {number(worst.speed, 3)} m/s, {wanted:.0f} deg asked for, by the estimate"
    return {
        "what": f"{gains.axis.value} gains at {counted(len(gains.rows), 'speed')}",
        "says": says if verified is None else f"{says}; verified: {verified.verdict}",
        "state": "good" if phase >= wanted - 0.5 and not (verified and verified.verdict.startswith(FAILED)) else "warn",
    }


def _state_verdict(state: FolderState) -> list[dict[str, str]]:
    stale = sorted((i for i in state.items if i.stale), key=lambda i: i.stale.endswith(" is stale"))  # causes first
    if not stale:
        return []
    reasons = "; ".join(f"{i.path}: {i.stale}" for i in stale[:3]) + (f" and {len(stale) - 3} more" if len(stale) > 3 else "")
    return [{"what": f"{counted(len(stale), 'stale file')}", "says": reasons, "state": "warn"}]


def _axis(axis: AxisMaterial) -> dict[str, Any]:
    best = axis.shown[0]
    failing = [(c.run, ch, c) for c in best.found for ch in c.failing]
    models = axis.shown[:1] if axis.line else axis.shown
    return {
        "name": axis.axis,
        "pairs": [_run_section(shown, c, axis) for shown in axis.shown for c in shown.found],
        "merits": [_errors(s) for s in axis.shown],
        "failures": [
            {
                "title": f"{run}: the {_channel_error(channel)}",
                "chart": bars(places(channel.where, most=8), f"where the {channel.name} of {run} fails"),
                "moves": ", ".join(f"{m.signal} ({100 * m.explained:.0f} %)" for m in c.moves_with[:3]),
            }
            for run, channel, c in failing[:6]
        ],
        "candidates": None if axis.diagnosis is None else candidates(axis.diagnosis.body, DEGREES),
        "diagnosis": axis.diagnosis.body if axis.diagnosis is not None else None,
        "loop": None if axis.loop is None else _loop(axis.loop),
        "parameters": [(parameter_block([("", s.model)]), s.path) for s in models],
        "laws": _laws(axis),
        "radius": None if axis.turning is None else _radius(axis.turning),
        "gains": None if axis.schedule is None or axis.gains is None else _gains(axis.gains, axis.schedule.path),
    }  # fmt: skip


def _loop(found: Loop) -> dict[str, Any]:
    """Return the loop in four charts: failure of the first model, its places, the last model, the error after each step."""
    before, where, after, errors = loop.panels(found)
    return {
        "run": found.run, "start": found.start, "added": ", ".join(found.added),
        "before": chart([before], before.title), "before_key": legend([before]), "before_left": found.left_by(found.before),
        "after": chart([after], after.title), "after_key": legend([after]), "after_left": found.left_by(found.after),
        "where": bars(where, where.title) if where.rows else "", "steps": bars(errors, errors.title),
        "most": DEGREES.words(found.where[0].condition) if found.where else "",
    }  # fmt: skip


def _channel_error(channel: Channel) -> str:
    """Return the name of a channel with the error of the model in it."""
    return f"{channel.name} {left_in_words(channel.over_floor, channel.fit, 2)}"


def _run_section(shown: Shown, found: Any, axis: AxisMaterial) -> dict[str, Any]:
    panels = compare.panels(found)
    drawn = chart(panels, f"{shown.path} on {found.run}: free run and measurement")
    over = ", ".join(_channel_error(c) for c in found.channels)
    return {
        "model": shown.path, "run": found.run, "chart": drawn, "legend": legend(panels),
        "over": over, "fitted": shown.was_fitted_to(found.run), "first": shown is axis.shown[0],
    }  # fmt: skip


def _errors(shown: Shown) -> Block:
    """Return a table of a model's errors on each run: over the noise, whether it was fitted to the run, and in their units."""
    merits, units = merit_blocks(((c.run, c.shown.record.speed, c.merit, c.floor) for c in shown.found), DEGREES)
    rows = tuple(
        (run, f"{c.over_noise:.2f}" if c.over_noise < MANY else "no noise", "yes" if shown.was_fitted_to(c.run) else "no", *cells)
        for c, (run, *cells) in zip(shown.found, merits.rows, strict=True)
    )
    title = f"{shown.path}, effects: {', '.join(shown.model.effects) or 'none'}; {units}"
    return Block(title, rows, (merits.columns[0], "x noise", "fitted to", *merits.columns[1:]))


def _laws(axis: AxisMaterial) -> list[dict[str, str]]:
    """Return a chart of each parameter over speed: its law, or its points where all are of one speed."""
    if axis.source is None:
        return []
    laws = {} if axis.source.laws is None else axis.source.laws.by_name
    out = []
    for name in NAMES[axis.source.axis].base:
        known, exponent = [p for p in axis.source.points if name in p.values], laws[name].exponent if name in laws else None
        if known:
            panel = law.panel(laws[name]) if name in laws else law.points(name, known)
            says = "" if exponent is None else f"|{name}| grows as {exponent.says}"
            out.append({"name": name, "chart": chart([panel], f"{name} over {panel.x}"), "key": legend([panel]), "says": says})
    return out


def _radius(item: Item) -> dict[str, Any]:
    panels = turn.panels(item.body)
    blocks = turns_of(item.body, DEGREES)
    return {"chart": chart(panels, "turning radius over speed"), "legend": legend(panels), "blocks": blocks, "path": item.path}


def _gains(gains: Schedule, path: str) -> dict[str, Any]:
    panels = schedule.panels(gains)
    drawn, key = chart(panels, "gains and phase margin over speed"), legend(panels)
    return {"chart": drawn, "legend": key, "blocks": tuple(blocks_of(gains, DEGREES)), "path": path}


def _vehicle(material: Material) -> list[tuple[str, str]]:
    v = material.vehicle
    if v is None:
        return []
    pairs = (
        ("length", v.length_m, "m"), ("rudder limit", v.rudder_max_rad, "rad"), ("elevator limit", v.elevator_max_rad, "rad"),
        ("fin rate", v.fin_rate_rad_s, "rad/s"), ("slowest", v.speed_min_m_s, "m/s"), ("fastest", v.speed_max_m_s, "m/s"),
    )  # fmt: skip
    facts = [(name, f"{number(value, 3)} {unit}") for name, value, unit in pairs if value is not None]
    planes = () if v.fins is None else ((v.fins.of("yaw"), "rudder"), (v.fins.of("pitch"), "elevator"))
    return [*facts, *(("fins", ", ".join(fins.says(plane))) for fins, plane in planes if fins is not None)]


def _commands(state: FolderState) -> list[dict[str, str]]:
    """Return the successful commands of the journal, without reports and overviews."""
    successful = [e for e in state.entries if e.exit in DONE and e.name not in ("report", "status")]
    return [{"line": shortened(e.command, state.folder), "verdict": e.verdict, "time": e.when} for e in successful]
