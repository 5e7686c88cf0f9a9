"""sysid init: a trial folder from templates: vehicle.yaml, mapping.yaml, notes."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fieldsid.artifacts import write_text
from fieldsid.cli.options import JsonFlag
from fieldsid.errors import ArtifactError, UsageError
from fieldsid.registry import near
from fieldsid.templates import template_path

if TYPE_CHECKING:
    from rich.console import Console

_NAME = re.compile(r"^name: .*$", re.MULTILINE)


def command(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the trial, and of the folder to make.")],
    template: Annotated[str, typer.Option("--template", metavar="KIND", help="Kind of vehicle: torpedo or surface.")] = "torpedo",
    as_json: JsonFlag = False,
) -> None:
    """Make a trial folder with a vehicle.yaml, a mapping.yaml and notes to fill in; nothing is ever replaced.

    Example: sysid init pandan --template torpedo
    """
    from fieldsid.cli.console import emit

    files = new_trial(Path(name), template)

    def render(console: Console) -> None:
        for file in files:
            console.print(str(file), markup=False, soft_wrap=True)

    body = {"schema": "fieldsid/init/1", "folder": name, "template": template, "files": [str(f) for f in files]}
    emit(body, as_json=as_json, render=render)


def new_trial(folder: Path, template: str = "torpedo") -> list[Path]:
    """Make a trial folder and return its files.

    Raises UsageError for an unknown template, ArtifactError when one of the files exists.
    """
    kinds = {p.stem: p for p in sorted(template_path("vehicle").glob("*.yaml"))}
    if template not in kinds:
        raise UsageError(f"there is no template {template!r} for a vehicle", found=", ".join(kinds), hint=near(template, kinds))
    vehicle = _NAME.sub(f"name: {_yaml_name(folder)}", kinds[template].read_text(encoding="utf-8"), count=1)
    texts = {
        "vehicle.yaml": vehicle,
        "mapping.yaml": template_path("mapping.yaml").read_text(encoding="utf-8"),
        "notes.md": template_path("notes.md").read_text(encoding="utf-8"),
    }
    there = [n for n in texts if (folder / n).exists()]
    if there:
        raise ArtifactError(
            f"`{folder / there[0]}` exists", found=", ".join(there), hint="name another folder: `sysid init NAME`"
        )
    return [write_text(folder / name, text) for name, text in texts.items()]


def _yaml_name(folder: Path) -> str:
    """Return the folder's name quoted for YAML, so that a trial called `2026` stays a name."""
    return "'" + (folder.name or folder.resolve().name).replace("'", "''") + "'"
