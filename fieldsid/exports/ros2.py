"""ROS 2 parameters: flat float arrays of equal length, since a parameter file has no lists of maps.

Every number has a decimal point and none an exponent: rcl takes `1` for an integer and refuses a mixed array.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

from fieldsid.exports._target import NAMES, Target, columns_of, decimal, notes_of
from fieldsid.models.allocation import PlaneFins
from fieldsid.schedule.record import Schedule


def render(schedule: Schedule, node: str, template: Path | None) -> str:
    """Return a parameter file for `node` (`/**` for every node)."""
    name = f"{NAMES[schedule.axis]}_schedule"
    lines = [f"# {line}" for line in notes_of(schedule)]
    lines += [f"{_key(node)}:", "  ros__parameters:", f"    {name}:", f'      controller: "{schedule.kind}"']
    lines += [f"      {column}: [{', '.join(decimal(v) for v in values)}]" for column, values in columns_of(schedule).items()]
    lines += [] if schedule.fins is None else _of_fins(NAMES[schedule.axis], schedule.fins)
    return "\n".join(lines) + "\n"


def _of_fins(plane: str, fins: PlaneFins) -> list[str]:
    """Return the block of the fins that make up the command: the share of each in one rad, and its limit."""
    numbers = [f"      {key}: [{', '.join(map(decimal, v))}]" for key, v in (("shares", fins.shares), ("limits", fins.limits))]
    return [f"    {plane}_fins:", "      names: [" + ", ".join(f'"{name}"' for name in fins.names) + "]", *numbers]


def _key(node: str) -> str:
    """Return a node's name as a YAML key, quoted where it is more than a plain word."""
    return node if re.fullmatch(r"[\w/][\w/*-]*", node, re.ASCII) else json.dumps(node)


EXPORT = Target(
    name="ros2", says="ROS 2 parameter YAML, flat float arrays of equal length", suffix=".yaml", render=render, node="/**"
)
