"""The kinds of files a figure is written as, by the suffix. It imports nothing heavy."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from fieldsid.errors import UsageError

TOOL = "fieldsid"
KINDS: Mapping[str, Mapping[str, str | None]] = MappingProxyType(
    {
        "png": {"Software": TOOL},
        "svg": {"Creator": TOOL, "Date": None},
        "pdf": {"Creator": TOOL, "Producer": TOOL, "CreationDate": None},
    }
)
"""Metadata of each kind of file; without a date, so that the same figure gives the same file."""


def is_figure(path: Path) -> bool:
    """Whether a path has the suffix of a figure and is not a folder."""
    return path.suffix.removeprefix(".").lower() in KINDS and not path.is_dir()


def figure_at(output: Path, name: str, *, is_one: bool = True) -> Path:
    """Return the file of a figure: in a folder, or at a figure's path, to which `name` is added where it is not the only one."""
    if not is_figure(output):
        return output / f"{name}.png"
    return output if is_one else output.with_name(f"{output.stem}_{name}{output.suffix}")


def kind_of(path: Path) -> str:
    """Return the kind of file a figure is written as; raises UsageError for a suffix that is none of them."""
    kind = path.suffix.removeprefix(".").lower()
    if kind in KINDS:
        return kind
    raise UsageError(
        f"a figure cannot be written as `{path.name}`",
        found=path.suffix or "no suffix",
        hint=f"name it `{path.with_suffix('.png')}`, or with " + ", ".join(f".{k}" for k in KINDS if k != "png"),
    )
