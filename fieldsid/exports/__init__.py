"""Export targets of a schedule: one file per target, found by the registry; `_patch.py` writes into an existing YAML file."""

from __future__ import annotations

from collections.abc import Mapping

from fieldsid.exports._target import Target
from fieldsid.registry import members, pick


def all_targets() -> Mapping[str, Target]:
    """Return every export target by name, plug-ins (entry points) included."""
    return members("fieldsid.exports", "EXPORT")


def pick_target(name: str) -> Target:
    """Return one target by name; raises UsageError naming the near matches."""
    target: Target = pick("fieldsid.exports", "EXPORT", name)
    return target
