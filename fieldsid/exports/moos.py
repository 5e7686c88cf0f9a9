"""MOOS: a ProcessConfig block with one line per speed, from `templates/exports/schedule.moos`."""

from __future__ import annotations

from functools import partial

from fieldsid.exports._target import Target, from_template

EXPORT = Target(
    name="moos",
    says="MOOS ProcessConfig block, a line per speed",
    suffix=".moos",
    render=partial(from_template, "schedule.moos"),
    node="pGainSchedule",
    template="schedule.moos",
)
