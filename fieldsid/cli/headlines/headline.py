"""What every result begins with: the verdict with its number, what it rests on, the next command ready to paste."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from fieldsid.records.keys import Key

LONGEST = 200
"""Number of characters of a line that is read at a glance; the rest of a longer verdict is printed below."""


@dataclass(frozen=True, slots=True)
class Headline:
    """The first lines that a reader gets."""

    says: Annotated[str, Key("The verdict with its number.")]
    rests_on: Annotated[str, Key("What it rests on.")]
    next: Annotated[str, Key("The command that comes next, ready to paste; empty where nothing is left to do.")] = ""

    @property
    def lines(self) -> tuple[str, ...]:
        """The lines as they are printed."""
        shown = (split_line(self.says)[0], split_line(f"rests on {self.rests_on}")[0])
        return (*shown, *([f"next: {self.next}"] if self.next else []))

    @property
    def rest(self) -> tuple[str, ...]:
        """The texts that the first two lines have no room for."""
        return tuple(rest for text in (self.says, f"rests on {self.rests_on}") if (rest := split_line(text)[1]))


def split_line(text: str) -> tuple[str, str]:
    """Return the part of a text that a line has room for, cut between clauses where possible, and the rest of it."""
    if len(text) <= LONGEST:
        return text, ""
    room = text[: LONGEST - len(" ...")]
    end = next((at for mark in ("; ", ": ", ", ", " ") if (at := room.rfind(mark)) > LONGEST // 3), len(room))
    return f"{room[:end]} ...", text[end:].lstrip(";:, ")
