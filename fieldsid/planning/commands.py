"""Everything that is written beside a plan: fin commands as CSV and as a bag, and mission snippets."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fieldsid.artifacts import write_text
from fieldsid.errors import UsageError
from fieldsid.logs.readers._ros2_commands import write_commands
from fieldsid.models.axis import NAMES
from fieldsid.planning.leg import Leg, commands_of
from fieldsid.planning.mission import render, styles
from fieldsid.planning.plan import Plan
from fieldsid.registry import near

TABLE, BAG = "csv", "ros2"


def formats() -> tuple[str, ...]:
    """Return the names of what can be written: the table, the bag, and the stem of every mission style."""
    return (TABLE, BAG, *sorted({_family(s) for s in styles()}))


def write_all(plan: Plan, folder: Path, wanted: Sequence[str] = (), *, force: bool = False) -> list[Path]:
    """Write every leg in the wanted formats (all when empty) and return the files.

    Raises UsageError for an unknown format, ArtifactError where a file exists or cannot be written.
    """
    known = formats()
    for name in wanted:
        if name not in known:
            raise UsageError(f"there is no format {name!r} for commands", found=", ".join(known), hint=near(name, known))
    chosen = tuple(wanted) or known
    stems = [folder / _stem(i, leg) for i, leg in enumerate(plan.legs, 1)]
    return [p for leg, stem in zip(plan.legs, stems, strict=True) for p in _leg_files(plan, leg, stem, chosen, force=force)]


def table_text(plan: Plan, leg: Leg) -> str:
    """Return a leg's commands as CSV: time, fin about trim (0 while the autopilot steers), and 1 while it does."""
    time, fin, steered = commands_of(leg, plan.envelope)
    head = f"time_s,{NAMES[plan.axis].fin},autopilot"
    rows = [f"{t:.6g},{f:.6g},{s:.0f}" for t, f, s in zip(time.tolist(), fin.tolist(), steered.tolist(), strict=True)]
    return "\n".join([head, *rows]) + "\n"


def _leg_files(plan: Plan, leg: Leg, stem: Path, chosen: Sequence[str], *, force: bool) -> list[Path]:
    made = []
    if TABLE in chosen:
        made.append(write_text(stem.with_name(f"{stem.name}.csv"), table_text(plan, leg), force=force))
    if BAG in chosen:
        topic = f"/{NAMES[plan.axis].fin.removesuffix('_rad')}_command"
        bag = stem.with_name(f"{stem.name}_bag")
        made.append(write_commands(bag, *commands_of(leg, plan.envelope), topic=topic, force=force))
    missions = [s for s in styles() if _family(s) in chosen]
    made += [write_text(stem.with_name(f"{stem.name}_{s}"), render(plan, leg, s), force=force) for s in missions]
    return made


def _family(style: str) -> str:
    """Return `moos` for `moos_timer_script.moos`."""
    return style.partition(".")[0].partition("_")[0]


def _stem(number: int, leg: Leg) -> str:
    return f"leg{number:02d}_{leg.candidate.maneuver}_{leg.speed:.2f}m_s"
