"""The templates that a user copies and edits: in the wheel, or at the top of the source tree."""

from __future__ import annotations

from pathlib import Path

from fieldsid.errors import UsageError
from fieldsid.registry import near

_PACKAGE = Path(__file__).resolve().parent


def template_root() -> Path:
    """Return the folder of all templates."""
    installed = _PACKAGE / "_templates"
    return installed if installed.is_dir() else _PACKAGE.parent / "templates"


def template_names() -> tuple[str, ...]:
    """Return every template's path below the folder, in order, with forward slashes."""
    root = template_root()
    files = (p.relative_to(root) for p in root.rglob("*") if p.is_file())
    return tuple(sorted(p.as_posix() for p in files if "__pycache__" not in p.parts))  # an installer compiles Python files


def template_path(name: str) -> Path:
    """Return the file or folder of one template, such as `vehicle/torpedo.yaml`; raises UsageError naming the near ones."""
    path = template_root() / name
    if name and path.exists():
        return path
    known = template_names()
    raise UsageError(f"there is no template {name!r}", found=", ".join(known) or "no templates", hint=near(name, known))
