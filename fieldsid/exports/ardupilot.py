"""ArduPilot parameters: NAME,VALUE lines for a script's own parameter table, from `templates/exports/ardupilot.param`.

ArduPilot has no table of gains over speed; a Lua script that declares the table `SCH_` reads these (names of at most
16 characters).
"""

from __future__ import annotations

from functools import partial

from fieldsid.exports._target import Target, from_template

EXPORT = Target(
    name="ardupilot",
    says="ArduPilot .param lines for a scripted table",
    suffix=".param",
    render=partial(from_template, "ardupilot.param"),
    node="SCH",
    template="ardupilot.param",
)
