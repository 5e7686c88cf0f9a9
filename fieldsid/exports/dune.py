"""DUNE configuration: one section with a comma-separated list per column, from `templates/exports/dune.ini`."""

from __future__ import annotations

from pathlib import Path

from fieldsid.exports._target import Target, from_template
from fieldsid.schedule.record import Schedule


def render(schedule: Schedule, node: str, template: Path | None) -> str:
    """Return the section `node`."""
    return from_template("dune.ini", schedule, node, template)


EXPORT = Target(
    name="dune", says="DUNE ini section, a list per column", suffix=".ini", render=render, node="Control.AUV.GainSchedule",
    template="dune.ini",
)  # fmt: skip
