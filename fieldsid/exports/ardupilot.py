"""ArduPilot parameters: NAME,VALUE lines for a script's own parameter table, from `templates/exports/ardupilot.param`.

ArduPilot has no table of gains over speed; a Lua script that declares the table `SCH_` reads these (names of at most
16 characters).
"""

from __future__ import annotations

from fieldsid.exports._target import templated

EXPORT = templated("ardupilot", "ArduPilot .param lines for a scripted table", "ardupilot.param", node="SCH")
