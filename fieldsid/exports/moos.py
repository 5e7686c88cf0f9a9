"""MOOS: a ProcessConfig block with one line per speed, from `templates/exports/schedule.moos`."""

from __future__ import annotations

from pathlib import Path

from fieldsid.exports._target import Target, from_template
from fieldsid.schedule.record import Schedule


def render(schedule: Schedule, node: str, template: Path | None) -> str:
    """Return the block of process `node`."""
    return from_template("schedule.moos", schedule, node, template)


EXPORT = Target(
    name="moos", says="MOOS ProcessConfig block, a line per speed", suffix=".moos", render=render, node="pGainSchedule",
    template="schedule.moos",
)  # fmt: skip
