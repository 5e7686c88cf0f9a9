"""The contract of an export target, and functions for several targets: numbers as text, columns, comments."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from jinja2.sandbox import ImmutableSandboxedEnvironment

from fieldsid.errors import ArtifactError
from fieldsid.models.axis import Axis
from fieldsid.schedule.record import Schedule
from fieldsid.templates import template_path
from fieldsid.text.one_line import one_line

DECIMALS = 6
NAMES = {Axis.YAW: "heading", Axis.PITCH: "pitch"}
MISTAKES = (jinja2.TemplateError, ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError)
"""The errors that a wrong template raises: those of jinja, and those of the expressions in it."""


@dataclass(frozen=True, slots=True)
class Target:
    """One target: name, one sentence, file suffix, and render(schedule, node, template) -> the file's text.

    `node` is the name of the gains in the vehicle's software; `template` is a user's template, None for the shipped one.
    """

    name: str
    says: str
    suffix: str
    render: Callable[[Schedule, str, Path | None], str]
    node: str
    template: str | None = None


def templated(name: str, says: str, template: str, node: str) -> Target:
    """Return the target whose file is rendered from a template, with the suffix of the template."""
    return Target(name, says, Path(template).suffix, partial(from_template, template), node, template)


def decimal(value: float) -> str:
    """Return a number with a decimal point and no exponent: `1.0`, `-0.000012`."""
    return str(np.format_float_positional(round(float(value), DECIMALS) + 0.0, trim="0"))


def columns_of(schedule: Schedule) -> dict[str, list[float]]:
    """Return the schedule as columns of equal length, all numbers; `supported` is 1.0 or 0.0."""
    return {name: [round(float(v), DECIMALS) + 0.0 for v in schedule.column(name)] for name in schedule.columns}


def notes_of(schedule: Schedule) -> list[str]:
    """Return the comment lines of an exported file: law, signs, units, support, origin and margins.

    Each is a single line, whatever names a schedule has, as the file goes to a vehicle.
    """
    p = schedule.provenance
    models = ", ".join(f"{Path(str(m['path'])).name} (sha256 {str(m['sha256'])[:12]})" for m in p.get("models", []))
    low, high = (float(v) for v in p.get("supported_m_s", (schedule.speeds[0], schedule.speeds[-1])))
    phase = min(r.phase_margin_deg for r in schedule.rows)
    gain = min(r.gain_margin_db for r in schedule.rows)
    delay = min(r.delay_margin_s for r in schedule.rows)
    lines = (
        f"{NAMES[schedule.axis]} gain schedule, controller {schedule.kind}, by {p.get('tool', 'fieldsid')}",
        str(p.get("law", "")),
        f"signs: {p.get('sign_convention', '')}",
        f"schedule variable: {p.get('schedule_variable', '')}; between rows {p.get('between_rows', '')}",
        f"outside the rows: {p.get('outside_rows', '')}",
        f"supported by data from {low:.2f} to {high:.2f} m/s (supported = 1.0)",
        f"least margins: {phase:.0f} deg, {'no limit' if gain == float('inf') else f'{gain:.1f} dB'}, {delay:.2f} s of delay",
        *schedule.fins_said,
        f"models: {models or 'none named'}",
        f"runs: {', '.join(map(str, p.get('runs', []))) or 'none named'}",
    )
    return [one_line(line) for line in lines]


def from_template(shipped: str, schedule: Schedule, node: str, own: Path | None) -> str:
    """Render a template with the schedule's rows (numbers as text), columns and notes; raises ArtifactError."""
    path = own or template_path(f"exports/{shipped}")
    # Configuration text, not HTML: nothing is escaped. A template may come from somebody else: the sandbox gives it no access to
    # Python.
    options: dict[str, Any] = {"trim_blocks": True, "lstrip_blocks": True, "keep_trailing_newline": True}
    environment = ImmutableSandboxedEnvironment(undefined=jinja2.StrictUndefined, autoescape=False, **options)
    try:
        template = environment.from_string(path.read_text(encoding="utf-8"))
        return template.render(**_context(schedule, node))
    except OSError as error:
        raise ArtifactError(
            f"template `{path}` cannot be read", found=str(error.strerror), hint="leave `--template` out"
        ) from error
    except MISTAKES as error:
        raise ArtifactError(
            f"template `{path}` is not valid", found=str(error), hint=f"start from `{template_path(f'exports/{shipped}')}`"
        ) from error


def _fins(schedule: Schedule) -> list[dict[str, str]]:
    """Return each of several fins as text: its name, its share of a command of one rad, and its limit."""
    known = schedule.fins
    if known is None:
        return []
    fins = zip(known.names, known.shares, known.limits, strict=True)
    return [{"name": name, "share": decimal(share), "limit": decimal(limit)} for name, share, limit in fins]


def _context(schedule: Schedule, node: str) -> dict[str, Any]:
    columns = columns_of(schedule)
    texts = {name: [decimal(v) for v in values] for name, values in columns.items()}
    count = len(schedule.rows)
    return {
        "node": one_line(node),
        "axis": schedule.axis.value,
        "name": NAMES[schedule.axis],
        "controller": schedule.kind,
        "columns": texts,
        "rows": [{name: values[i] for name, values in texts.items()} for i in range(count)],
        "count": count,
        "notes": notes_of(schedule),
        "depth": schedule.depth,
        "fins": _fins(schedule),
    }
