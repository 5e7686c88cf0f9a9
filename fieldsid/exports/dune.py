"""DUNE configuration: one section with a comma-separated list per column, from `templates/exports/dune.ini`."""

from __future__ import annotations

from fieldsid.exports._target import templated

EXPORT = templated("dune", "DUNE ini section, a list per column", "dune.ini", node="Control.AUV.GainSchedule")
