"""ArduPilot parameters: NAME,VALUE lines for a script's own parameter table, from `templates/exports/ardupilot.param`.

ArduPilot has no table of gains over speed; a Lua script that declares the table `SCH_` reads these (names of at most
16 characters).
"""

from __future__ import annotations

from pathlib import Path

from fieldsid.exports._target import Target, from_template
from fieldsid.schedule.record import Schedule


def render(schedule: Schedule, node: str, template: Path | None) -> str:
    """Return the parameter lines, each name beginning with `node`."""
    return from_template("ardupilot.param", schedule, node, template)


EXPORT = Target(
    name="ardupilot", says="ArduPilot .param lines for a scripted table", suffix=".param", render=render, node="SCH",
    template="ardupilot.param",
)  # fmt: skip
