"""Plain YAML: a list of rows with everything known of each, for software that reads any YAML."""

from __future__ import annotations

from pathlib import Path

from fieldsid.artifacts import to_yaml
from fieldsid.exports._target import NAMES, Target, notes_of
from fieldsid.schedule.record import Schedule, body_of


def render(schedule: Schedule, node: str, template: Path | None) -> str:
    """Return the schedule under `node` as YAML, notes as comments above."""
    body = body_of(schedule)
    head = "".join(f"# {line}\n" for line in notes_of(schedule))
    rows = [{k: v for k, v in row.items() if k in schedule.columns or k.endswith(("_deg", "_db", "_s"))} for row in body["rows"]]
    inner = {
        "schema": "fieldsid/export/1",
        "axis": body["axis"],
        "angle": NAMES[schedule.axis],
        "controller": body["controller"],
        **({} if schedule.fins is None else {"fins": schedule.fins.record()}),
        "rows": rows,
        "provenance": body["provenance"],
    }
    return head + to_yaml({node: inner})


EXPORT = Target(
    name="yaml", says="plain YAML, a list of rows with provenance", suffix=".yaml", render=render, node="gain_schedule"
)
