"""The options of every command that set how it prints: `--json`, `--quiet`, `-v` and `--deg`."""

from __future__ import annotations

from collections.abc import Sequence
from contextvars import ContextVar
from dataclasses import dataclass
from itertools import takewhile

from fieldsid.rounding import DEGREES as IN_DEGREES
from fieldsid.rounding import RADIANS, Angles

JSON, QUIET, VERBOSE, DEGREES = "--json", "--quiet", "-v", "--deg"
SAYS = {
    JSON: "Print one JSON object instead of text.",
    QUIET: "Say the verdict, what it rests on and the next command, nothing below; and errors.",
    VERBOSE: "Say warnings in full, where a terminal gets a line of each.",
    DEGREES: "Show angles in degrees; files and JSON stay in radians.",
}
"""The description of each on the pages of help."""
HAS_OWN_V = ("demo",)
"""Commands that have a `-v` of their own, which prints more than warnings."""


@dataclass(frozen=True, slots=True)
class Voice:
    """How a command prints: JSON in place of text, the first lines alone, warnings in full, angles in degrees."""

    is_json: bool = False
    is_quiet: bool = False
    is_verbose: bool = False
    is_in_degrees: bool = False


_VOICE = ContextVar("voice", default=Voice())  # noqa: B039 - frozen


def voice() -> Voice:
    """Return how the running command prints."""
    return _VOICE.get()


def take(arguments: Sequence[str]) -> list[str]:
    """Set the voice from a command line and return the line without these options, except `--json`, which the journal records.

    Words after `--` are no options.
    """
    end = arguments.index("--") if "--" in arguments else len(arguments)
    words, rest = arguments[:end], arguments[end:]
    _VOICE.set(Voice(is_json=JSON in words, is_quiet=QUIET in words, is_verbose=VERBOSE in words, is_in_degrees=DEGREES in words))
    taken = set(SAYS) - {JSON} - ({VERBOSE} if arguments and arguments[0] in HAS_OWN_V else set())
    return [*(a for a in words if a not in taken), *rest]


def command_first(arguments: Sequence[str]) -> list[str]:
    """Return a command line with the options of every command moved behind the command, where they were typed before it."""
    before = list(takewhile(SAYS.__contains__, arguments))
    rest = list(arguments[len(before) :])
    end = rest.index("--") if "--" in rest else len(rest)
    return [*rest[:end], *before, *rest[end:]]


def angles() -> Angles:
    """Return the unit that angles are shown in."""
    return IN_DEGREES if voice().is_in_degrees else RADIANS
