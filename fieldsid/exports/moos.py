"""MOOS: a ProcessConfig block with one line per speed, from `templates/exports/schedule.moos`."""

from __future__ import annotations

from fieldsid.exports._target import templated

EXPORT = templated("moos", "MOOS ProcessConfig block, a line per speed", "schedule.moos", node="pGainSchedule")
