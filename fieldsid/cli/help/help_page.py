"""The front page, `sysid --help`: the commands in the order of an engineer's day."""

from __future__ import annotations

from fieldsid._version import __version__
from fieldsid.cli.help.catalogue import Entry
from fieldsid.cli.help.command_order import COMMAND_ORDER

PAGE = 80
_HEAD = f"""Usage: sysid COMMAND [ARGUMENTS]        fieldsid {__version__}

From a short excitation log of an underwater vehicle to a model, the physical
effect it is missing, a turning radius and gains. Start with `sysid demo`.
"""
_FOOT = """
Every command: `--help` explains it, `--json` prints one JSON object.
`--quiet` says a result's first lines alone, `-v` its warnings in full.
The tabulator key completes commands and options: `--install-completion`.
Exit codes: 0 done, 1 done but a gate failed, 2 bad usage or input, 3 our bug.
"""


def front_page(known: dict[str, Entry]) -> str:
    """Return the page of help for these commands."""
    return f"{_HEAD}\n{command_list(known)}\n{_FOOT}"


def command_list(known: dict[str, Entry]) -> str:
    """Return the list of commands in the order of an engineer's day, each with its summary."""
    placed = {name for _, names in COMMAND_ORDER for name in names}
    groups = [*COMMAND_ORDER, ("Also", tuple(n for n in known if n not in placed))]
    width = max((len(n) for n in known), default=0)
    lines: list[str] = []
    for title, names in groups:
        here = [known[n] for n in names if n in known]
        if here:
            lines += [f"{title}:", *(line for e in here for line in _entry(e, width)), ""]
    return "\n".join(lines).rstrip()


def _entry(entry: Entry, width: int) -> list[str]:
    """Return a command's name and its summary, broken between words where the page ends (textwrap costs a third of the start)."""
    lines, line = [], f"  {entry.name:<{width}} "
    for word in entry.summary.split():
        if len(line) + 1 + len(word) > PAGE:
            lines.append(line)
            line = " " * (width + 3)
        line += f" {word}"
    return [*lines, line]
