"""The files written with a plan: fin commands as CSV and as a bag, and mission snippets."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from fieldsid.artifacts import plain, write_text
from fieldsid.errors import UsageError
from fieldsid.logs.readers.bags.ros2_commands import write_commands
from fieldsid.models.axis import NAMES
from fieldsid.numerics.arrays import FloatArray
from fieldsid.planning.design.leg import Leg, aborts_of, commands_of
from fieldsid.planning.design.plan import Plan
from fieldsid.planning.output.mission import instead, refuse_blind, render, styles
from fieldsid.planning.safety.envelope import NOT_LIMITED, limits_said
from fieldsid.records.keys import body_of
from fieldsid.registry import near

TABLE, BAG = "csv", "ros2"


def formats() -> tuple[str, ...]:
    """Return the names of the formats: the table, the bag, and the stem of every mission style."""
    return (TABLE, BAG, *sorted({_family(s) for s in styles()}))


def write_all(plan: Plan, folder: Path, wanted: Sequence[str] = (), *, force: bool = False) -> list[Path]:
    """Write every leg in the requested formats (all when empty) and return the files.

    A leg whose maneuver is a rule is written as the list of its expected fin angles if these, flown open loop, stay within the
    envelope; otherwise it is left out, or refused where a format was named. Raises UsageError for that and for an unknown format,
    ArtifactError where a file exists or cannot be written.
    """
    check_formats(wanted)
    chosen = tuple(wanted) or formats()
    stems = [(leg, folder / _stem(i, leg)) for i, leg in enumerate(plan.legs, 1)]
    if wanted:
        for leg in plan.legs:
            refuse_blind(plan, leg)
    listed = [(leg, stem) for leg, stem in stems if leg.flown_from_list_in(plan.envelope)]
    return [p for leg, stem in listed for p in _leg_files(plan, leg, stem, chosen, force=force)]


def unwritten(plan: Plan) -> list[str]:
    """Return a sentence on each leg for which no list of fin angles was written."""
    out = []
    for i, leg in enumerate(plan.legs, 1):
        if not leg.flown_from_list_in(plan.envelope):
            out.append(
                f"no commands were written for leg {i}: {leg.candidate.maneuver} at {leg.speed:g} m/s follows the motion, and "
                f"its expected fins flown blind leave the envelope {leg.replay_risk:.0%} of the time; {instead(leg)}"
            )
    return out


def check_formats(wanted: Sequence[str]) -> None:
    """Raise UsageError for a name that is no format."""
    known = formats()
    for name in wanted:
        if name not in known:
            raise UsageError(f"there is no format {name!r} for commands", found=", ".join(known), hint=near(name, known))


def table_text(plan: Plan, leg: Leg) -> str:
    """Return a leg's commands as CSV: time, fin about trim (0 while the autopilot steers), 1 while it does, and each fin."""
    time, fin, steered, each = _commands(plan, leg)
    head = ",".join(["time_s", NAMES[plan.axis].fin, "autopilot", *each])
    samples = zip(time.tolist(), fin.tolist(), steered.tolist(), *(v.tolist() for v in each.values()), strict=True)
    rows = [",".join([f"{t:.6g}", f"{f:.6g}", f"{s:.0f}", *(f"{v:.6g}" for v in fins)]) for t, f, s, *fins in samples]
    return "\n".join([head, *rows]) + "\n"


def _commands(plan: Plan, leg: Leg) -> tuple[FloatArray, FloatArray, FloatArray, dict[str, FloatArray]]:
    """Return time, fin and autopilot of a leg, see `commands_of`, and the command (n,) of each of several fins."""
    time, fin, steered = commands_of(leg, plan.envelope)
    return time, fin, steered, {} if plan.fins is None else dict(zip(plan.fins.names, plan.fins.fin_commands(fin), strict=True))


def _leg_files(plan: Plan, leg: Leg, stem: Path, chosen: Sequence[str], *, force: bool) -> list[Path]:
    made = []
    if TABLE in chosen:
        made.append(write_text(stem.with_name(f"{stem.name}.csv"), table_text(plan, leg), force=force))
    if BAG in chosen:
        topic = f"/{NAMES[plan.axis].fin.removesuffix('_rad')}_command"
        bag = stem.with_name(f"{stem.name}_bag")
        text = conditions_text(plan, leg)
        time, fin, steered, each = _commands(plan, leg)
        commands = {topic: fin, **{f"/{name}_command": values for name, values in each.items()}}
        made.append(write_commands(bag, time, commands, steered, conditions=text, force=force))
    missions = [s for s in styles() if _family(s) in chosen]
    made += [write_text(stem.with_name(f"{stem.name}_{s}"), render(plan, leg, s), force=force) for s in missions]
    return made


def conditions_text(plan: Plan, leg: Leg) -> str:
    """Return the conditions for the playback of a bag as JSON: abort conditions, fin limits, and the names without a limit."""
    limits = leg.envelope_in(plan.envelope)
    body = {
        "schema": "fieldsid/abort/1",
        "fin_max_rad": limits.fin,
        "fin_rate_max_rad_s": limits.fin_rate,
        "fins": None if plan.fins is None else body_of(plan.fins),
        "abort": [asdict(a) for a in aborts_of(leg, plan.envelope)],
        "not_limited": [name for name, words in limits_said(limits).items() if words == NOT_LIMITED],
    }
    return json.dumps(plain(body), allow_nan=False)


def _family(style: str) -> str:
    """Return `moos` for `moos_timer_script.moos`."""
    return style.partition(".")[0].partition("_")[0]


def _stem(number: int, leg: Leg) -> str:
    return f"leg{number:02d}_{leg.candidate.maneuver}_{leg.speed:.2f}m_s"
