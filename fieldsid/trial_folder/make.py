"""A new trial folder: vehicle.yaml, mapping.yaml, notes.md, and the folders of its runs and models."""

from __future__ import annotations

import re
from pathlib import Path

from fieldsid.artifacts import write_text
from fieldsid.errors import ArtifactError, UsageError
from fieldsid.registry import near
from fieldsid.templates import template_path

LOGS, RUNS, MODELS, MAPPING = "logs", "runs", "models", "mapping.yaml"
VEHICLE = "vehicle.yaml"

_NAME = re.compile(r"^name: .*$", re.MULTILINE)


def new_trial(folder: Path, template: str = "torpedo") -> list[Path]:
    """Make a trial folder and return its files.

    Raises UsageError for an unknown template, ArtifactError when one of the files exists.
    """
    kinds = {p.stem: p for p in sorted(template_path("vehicle").glob("*.yaml"))}
    if template not in kinds:
        raise UsageError(f"there is no template {template!r} for a vehicle", found=", ".join(kinds), hint=near(template, kinds))
    vehicle = _NAME.sub(f"name: {_yaml_name(folder)}", kinds[template].read_text(encoding="utf-8"), count=1)
    texts = {
        VEHICLE: vehicle,
        MAPPING: template_path("mapping.yaml").read_text(encoding="utf-8"),
        "notes.md": template_path("notes.md").read_text(encoding="utf-8"),
    }
    there = [n for n in texts if (folder / n).exists()]
    if there:
        raise ArtifactError(
            f"`{folder / there[0]}` exists", found=", ".join(there), hint="name another folder: `sysid init NAME`"
        )
    made = [write_text(folder / name, text) for name, text in texts.items()]
    for place in (LOGS, RUNS, MODELS):
        (folder / place).mkdir(exist_ok=True)
    return made


def _yaml_name(folder: Path) -> str:
    """Return the folder's name quoted for YAML, so that a trial called `2026` stays a name."""
    return "'" + (folder.name or folder.resolve().name).replace("'", "''") + "'"
