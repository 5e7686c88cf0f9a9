"""What every result begins with: the verdict with its number, what it rests on, the next command ready to paste."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from fieldsid.records.keys import Key

LONGEST = 200
"""Characters of a line that is read at a glance; what a verdict has beyond them is told below it."""


@dataclass(frozen=True, slots=True)
class Headline:
    """The first lines that a reader gets."""

    says: Annotated[str, Key("The verdict with its number.")]
    rests_on: Annotated[str, Key("What it rests on.")]
    next: Annotated[str, Key("The command that comes next, ready to paste; empty where nothing is left to do.")] = ""

    @property
    def lines(self) -> tuple[str, ...]:
        """The lines as they are printed."""
        shown = (begun(self.says)[0], begun(f"rests on {self.rests_on}")[0])
        return (*shown, *([f"next: {self.next}"] if self.next else []))

    @property
    def rest(self) -> tuple[str, ...]:
        """What the first two lines have no room for."""
        return tuple(rest for text in (self.says, f"rests on {self.rests_on}") if (rest := begun(text)[1]))


def begun(text: str) -> tuple[str, str]:
    """Return a text as far as a line has room, whole clauses where there are any, and the rest of it."""
    if len(text) <= LONGEST:
        return text, ""
    room = text[: LONGEST - len(" ...")]
    end = next((at for mark in ("; ", ": ", ", ", " ") if (at := room.rfind(mark)) > LONGEST // 3), len(room))
    return f"{room[:end]} ...", text[end:].lstrip(";:, ")
