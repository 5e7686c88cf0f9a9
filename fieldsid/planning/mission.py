"""Mission snippets: a leg's commands and abort conditions rendered through the templates of `templates/plan/mission`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined, TemplateError

from fieldsid._version import __version__
from fieldsid.errors import ArtifactError, UsageError
from fieldsid.models.axis import NAMES
from fieldsid.planning.abort import Abort, aborts_of
from fieldsid.planning.leg import Leg, commands_of
from fieldsid.planning.plan import Plan
from fieldsid.registry import near
from fieldsid.templates import template_names, template_path

FOLDER = "plan/mission"
SUFFIX = ".j2"


@dataclass(frozen=True, slots=True)
class Step:
    """From `time` s on: the fin about trim in rad, or the autopilot."""

    time: float
    fin: float
    autopilot: bool

    @property
    def degrees(self) -> float:
        """The fin in degrees."""
        return math.degrees(self.fin)


def styles() -> tuple[str, ...]:
    """Return the file names a mission can be written as, such as `moos_timer_script.moos`: one per template."""
    return tuple(Path(n).name.removesuffix(SUFFIX) for n in template_names() if n.startswith(f"{FOLDER}/") and n.endswith(SUFFIX))


def steps_of(plan: Plan, leg: Leg) -> tuple[Step, ...]:
    """Return the instants at which the command of a leg changes; within the limits, whatever the plan holds."""
    time, fin, steered = commands_of(leg, plan.envelope)
    fin = np.where(steered > 0, 0.0, fin)
    changed = (np.diff(fin, prepend=np.nan) != 0) | (np.diff(steered, prepend=np.nan) != 0)
    return tuple(
        Step(round(float(t), 4), round(float(f), 6), bool(s))
        for t, f, s in zip(time[changed], fin[changed], steered[changed], strict=True)
    )


def render(plan: Plan, leg: Leg, style: str) -> str:
    """Return one leg as text in a style; raises UsageError for an unknown one, ArtifactError for a broken template."""
    if style not in styles():
        raise UsageError(f"there is no mission style {style!r}", found=", ".join(styles()) or "none", hint=near(style, styles()))
    try:
        text: str = _environment().get_template(style + SUFFIX).render(_context(plan, leg))
    except TemplateError as error:
        place = f"line {getattr(error, 'lineno', '?')}: {error}"
        what = f"the template `{FOLDER}/{style}{SUFFIX}` is broken"
        raise ArtifactError(what, found=place, hint="compare it with the one that was shipped") from error
    return text.rstrip() + "\n"


@cache
def _environment() -> Environment:
    loader = FileSystemLoader(template_path(FOLDER))
    # The output is configuration and code of vehicles, never HTML.
    return Environment(loader=loader, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, autoescape=False)  # noqa: S701


def _context(plan: Plan, leg: Leg) -> dict[str, Any]:
    names = NAMES[plan.axis]
    return {
        "tool": f"fieldsid {__version__}",
        "plan": plan,
        "leg": leg,
        "axis": plan.axis.value,
        "fin": names.fin.removesuffix("_rad"),
        "angle": names.angle,
        "vehicle": "".join(c for c in plan.vehicle if c.isprintable())[:80],
        "rule": None if leg.open_loop else leg.candidate.record.says,
        "spec": leg.candidate.spec,
        "steps": steps_of(plan, leg) if leg.open_loop else (),
        "aborts": aborts_of(plan.axis, leg, plan.envelope),
        "limits": plan.envelope,
        "degrees": math.degrees,
        "limit_of": _limit_of(aborts_of(plan.axis, leg, plan.envelope)),
    }


def _limit_of(aborts: tuple[Abort, ...]) -> dict[str, float]:
    return {f"{a.signal}.{a.kind}": a.limit for a in aborts}
