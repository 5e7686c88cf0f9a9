"""The program that parses a command line: one Typer application for the command that its first word names."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING

from fieldsid.cli.voice import JSON

if TYPE_CHECKING:
    import typer


FORMER_NAMES = {"--rudder-max": "--fin-max", "--fin-limit": "--fin-max"}
"""Former names of options, each with its present one: they are still understood, and documented nowhere."""


def program_of(arguments: Sequence[str]) -> tuple[typer.Typer, list[str], str]:
    """Return the program of a command, the words to give it, and its name in messages; raises UsageError where unknown."""
    from fieldsid.cli.help.catalogue import entries

    known, name = entries(), arguments[0]
    arguments = [name, *(_with_present_name(word) for word in arguments[1:] if word != JSON)]
    if name not in known:
        raise _unknown(name, tuple(known))
    import typer

    from fieldsid.cli.help.command_page import CommandPage

    module = import_module(known[name].module)
    program = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    if isinstance(module.command, typer.Typer):
        for leaf in module.command.registered_commands:
            leaf.cls = CommandPage
        program.add_typer(module.command, name=name)
        return program, arguments, "sysid"
    program.command(name, cls=CommandPage)(module.command)
    return program, arguments[1:], f"sysid {name}"


def _with_present_name(word: str) -> str:
    name, equals, value = word.partition("=")
    return f"{FORMER_NAMES.get(name, name)}{equals}{value}"


def _unknown(name: str, known: tuple[str, ...]) -> Exception:
    from fieldsid.errors import UsageError
    from fieldsid.registry import near

    return UsageError(f"there is no command {name!r}", found=", ".join(known), hint=near(name, known))
