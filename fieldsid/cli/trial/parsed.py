"""A command line, parsed without being run: which parameters are given, and which are left to the trial folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer

from fieldsid.cli.programs import program_of


@dataclass(frozen=True, slots=True)
class Parsed:
    """The full name of a command, such as `schedule design`, and its parameters by name, None where not given."""

    name: str
    values: Mapping[str, Any]

    def paths(self, *names: str) -> list[Path]:
        """Return the files that the named parameters give, in the order of the names; without names, those of all parameters."""
        given = [self.values.get(n) for n in names] if names else list(self.values.values())
        flat = [v for value in given for v in (value if isinstance(value, (list, tuple)) else [value])]
        return [v for v in flat if isinstance(v, Path)]


def parse(arguments: Sequence[str]) -> Parsed | None:
    """Return the parsed command line; None where there is none, it asks for help or cannot be parsed: running it reports why."""
    if not arguments or "--help" in arguments:
        return None
    program, words, name = program_of(arguments)
    command: Any = typer.main.get_command(program)
    name = name.removeprefix("sysid").strip()
    while hasattr(command, "commands"):
        if not words or words[0] not in command.commands:
            return None
        command, name, words = command.commands[words[0]], f"{name} {words[0]}".strip(), words[1:]
    try:
        context = command.make_context(name, list(words), resilient_parsing=True)
    except typer.TyperException:
        return None
    return Parsed(name, dict(context.params))
