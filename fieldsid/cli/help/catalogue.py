"""The list of commands, read from the first line of each file in `commands/`, so that help imports none of them."""

from __future__ import annotations

import os
from typing import NamedTuple

_OPENING = '"""sysid '


class Entry(NamedTuple):
    """A command: its name, its module, and its line on the page of help."""

    name: str
    module: str
    summary: str


def entries(folder: str = f"{os.path.dirname(os.path.dirname(__file__))}/commands") -> dict[str, Entry]:  # noqa: PTH120 - pathlib costs a third of the start
    """Return the commands of a folder by name."""
    found = {}
    for file in sorted(os.listdir(folder)):  # noqa: PTH208 - the same
        if file.endswith(".py") and (entry := _entry(f"{folder}/{file}", file[:-3])):
            found[entry.name] = entry
    return found


def _entry(path: str, stem: str) -> Entry | None:
    with open(path, encoding="utf-8") as stream:  # noqa: PTH123 - the same
        line = stream.readline().strip()
    if not line.startswith(_OPENING):
        return None
    name, _, summary = line[len(_OPENING) :].partition(": ")
    return Entry(name, f"fieldsid.cli.commands.{stem}", summary.removesuffix('"""').removesuffix("."))
