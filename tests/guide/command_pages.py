"""A page for every command: its help, and what it says on the tour's trial; and the page that lists them."""

from __future__ import annotations

import os
from contextlib import redirect_stdout
from io import StringIO
from unittest.mock import patch

from guide.blocks import console
from guide.effect_pages import sentence, table
from guide.examples import EXAMPLES, Example
from guide.schema_pages import RESULTS, file_of
from guide.session import Session, tidied

from fieldsid.cli.app import main
from fieldsid.cli.help.catalogue import entries
from fieldsid.cli.help.command_order import COMMAND_ORDER

INDEX = """# Commands

In the order of an engineer's day. `sysid COMMAND --help` explains one. Data go to standard output, all else to standard error;
`--json` prints one JSON object, whose schema is linked on each page, or what is wrong as `fieldsid/error/1` with the keys
exit_code, what, found and hint. Exit code 0 means done, 1 done but a gate that you asked for failed, 2 bad usage or unusable
input, 3 a bug of the program (the message says where the trace is). Inputs are never changed, and a file that exists is
replaced only with `--force`.

The output on these pages is real. It comes from the trial that `sysid demo -o demo` makes, whose vehicle hides a slow servo.
"""


def pages(session: Session) -> dict[str, str]:
    """Return the pages of all commands, by path below `commands/`."""
    return {"index.md": index(), **{f"{name}.md": page(name, session) for name in entries()}}


def index() -> str:
    """Return the page that lists the commands by the time of the day."""
    known, parts = entries(), [INDEX]
    for title, names in COMMAND_ORDER:
        rows = [(f"[{n}]({n}.md)", known[n].summary) for n in names if n in known]
        parts += [f"## {title}\n\n{table(('command', 'what it gives'), rows)}"] if rows else []
    return "\n".join(parts)


def page(name: str, session: Session) -> str:
    """Return one command's page."""
    helps = [name, *(f"{name} {sub}" for sub in subcommands(name))]
    return "\n".join(
        [
            f"# sysid {name}\n\n{sentence(entries()[name].summary)}\n",
            *(f"{_example(e, session)}" for e in EXAMPLES[name]),
            *([_schemas(name)] if any(c.split()[0] == name for c in RESULTS) else []),
            "## Help\n",
            *(f"```text\n{help_of(*words.split())}\n```\n" for words in helps),
        ]
    )


def subcommands(name: str) -> list[str]:
    """Return a command's own commands, in their order."""
    _, found, rest = help_of(name).partition("\nCommands:\n")
    return [line.split()[0] for line in rest.splitlines() if line.startswith("  ") and line[2] != " "] if found else []


def help_of(*words: str) -> str:
    """Return a command's page of help in 80 columns."""
    out = StringIO()
    with patch.dict(os.environ, {"COLUMNS": "80"}), redirect_stdout(out):
        main([*words, "--help"])
    return tidied(out.getvalue())


def _example(example: Example, session: Session) -> str:
    return f"{example.says}\n\n{console((example.line, example.kept(session.run(example.line))))}"


def _schemas(name: str) -> str:
    links = [f"[{file_of(c)}](../schemas/{file_of(c)})" for c in RESULTS if c.split()[0] == name]
    return f"What `--json` prints: {', '.join(links)}.\n"
