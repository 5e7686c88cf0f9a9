"""Text of others as one printable line: no name, note or cell steers a terminal or adds a line to a file."""

from __future__ import annotations


def one_line(text: object) -> str:
    r"""Return a text as one line: ends of lines, control codes, marks that turn the direction of writing are shown, as `\x1b`.

    Text that is printable stays as it is, in any script.
    """
    said = str(text)
    return said if said.isprintable() else "".join(c if c.isprintable() else _shown(c) for c in said)


def _shown(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")
