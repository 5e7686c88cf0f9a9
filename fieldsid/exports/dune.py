"""DUNE configuration: one section with a comma-separated list per column, from `templates/exports/dune.ini`."""

from __future__ import annotations

from functools import partial

from fieldsid.exports._target import Target, from_template

EXPORT = Target(
    name="dune",
    says="DUNE ini section, a list per column",
    suffix=".ini",
    render=partial(from_template, "dune.ini"),
    node="Control.AUV.GainSchedule",
    template="dune.ini",
)
