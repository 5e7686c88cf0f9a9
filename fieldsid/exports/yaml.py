"""Plain YAML: a list of rows with all their fields, for software that reads any YAML."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fieldsid.artifacts import plain, to_yaml
from fieldsid.exports._target import NAMES, Target, notes_of
from fieldsid.records.keys import body_of
from fieldsid.schedule.record import Schedule
from fieldsid.text.one_line import one_line


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
        **({} if schedule.fins is None else {"fins": body_of(schedule.fins)}),
        "rows": rows,
        "provenance": _in_lines(plain(body["provenance"])),
    }
    return head + to_yaml({node: inner})


def _in_lines(value: Any) -> Any:
    """Return nested plain values with every word in them as one line."""
    if isinstance(value, dict):
        return {one_line(k): _in_lines(v) for k, v in value.items()}
    if isinstance(value, list):
        return [_in_lines(v) for v in value]
    return one_line(value) if isinstance(value, str) else value


EXPORT = Target(
    name="yaml", says="plain YAML, a list of rows with provenance", suffix=".yaml", render=render, node="gain_schedule"
)
