"""Blocks of a page that were run: `$ ` before each command line, what it said below it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from guide.sameness import shortened

CONSOLE = re.compile(r"(?<=^```console\n).*?(?=^```$)", re.MULTILINE | re.DOTALL)
PYTHON = re.compile(r"(?<=^```python\n).*?(?=^```$)", re.MULTILINE | re.DOTALL)
YAML_FILE = re.compile(r"(?<=^```yaml\n)# (?P<path>\S+)\n.*?(?=^```$)", re.MULTILINE | re.DOTALL)
"""A block of YAML that says in its first line which file it is."""
PROMPT = "$ "
WIDTH = 78


def commands_of(text: str) -> list[tuple[str, str]]:
    """Return the command lines of a page's blocks in order, each with what stands below it."""
    return [part for block in CONSOLE.findall(text) for part in _parts(block)]


def filled(text: str, run: Callable[[str], str]) -> str:
    """Return a page with what each command line says now below it, as long as what stood there."""

    def block(match: re.Match[str]) -> str:
        return "".join(shown(line, shortened(was, run(line))) for line, was in _parts(match.group()))

    return CONSOLE.sub(block, text)


def shown(line: str, said: str) -> str:
    """Return a command line and what it said, as a block has them."""
    return f"{PROMPT}{broken(line)}\n" + (f"{said}\n" if said else "")


def console(*parts: tuple[str, str]) -> str:
    """Return a block of command lines and what they said."""
    return "```console\n" + "".join(shown(line, said) for line, said in parts) + "```\n"


def broken(line: str) -> str:
    """Return a command line with `\\` where it goes on in the next one; an option stays with its value."""
    rows = [""]
    for part in re.split(r" (?=-|\|)", line):
        for word in [part] if len(part) < WIDTH // 2 else part.split(" "):
            if len(rows[-1]) + len(word) > WIDTH - 4 and rows[-1]:
                rows.append("   ")
            rows[-1] += (" " if rows[-1] else "") + word
    return " \\\n".join(rows)


def _parts(block: str) -> Iterator[tuple[str, str]]:
    lines, said = "", list[str]()
    for row in block.splitlines():
        if lines.endswith("\\"):
            lines = f"{lines[:-1].rstrip()} {row.strip()}"
        elif row.startswith(PROMPT):
            if lines:
                yield lines, "\n".join(said)
            lines, said = row.removeprefix(PROMPT), []
        else:
            said.append(row)
    if lines:
        yield lines, "\n".join(said)
