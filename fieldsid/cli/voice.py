"""How every command speaks: `--json` an object, `--quiet` its first lines, `-v` warnings in full, `--deg` its text in degrees."""

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
"""What each of them does, in the words of the pages of help."""
HAS_OWN_V = ("demo",)
"""Commands whose own `-v` says more than warnings."""


@dataclass(frozen=True, slots=True)
class Voice:
    """Whether a result is one JSON object, or its first lines alone, whether warnings are said in full, angles in degrees."""

    is_json: bool = False
    is_quiet: bool = False
    is_verbose: bool = False
    is_in_degrees: bool = False


_VOICE = ContextVar("voice", default=Voice())  # noqa: B039 - frozen


def voice() -> Voice:
    """Return how much the command under way says."""
    return _VOICE.get()


def take(arguments: Sequence[str]) -> list[str]:
    """Set the voice by a command line and return the line without what set it, but for `--json`, which its journal keeps.

    What follows `--` is left as it is.
    """
    end = arguments.index("--") if "--" in arguments else len(arguments)
    own, rest = arguments[:end], arguments[end:]
    _VOICE.set(Voice(is_json=JSON in own, is_quiet=QUIET in own, is_verbose=VERBOSE in own, is_in_degrees=DEGREES in own))
    taken = set(SAYS) - {JSON} - ({VERBOSE} if arguments and arguments[0] in HAS_OWN_V else set())
    return [*(a for a in own if a not in taken), *rest]


def command_first(arguments: Sequence[str]) -> list[str]:
    """Return a command line with what any command answers to behind the command, where it stands before it."""
    before = list(takewhile(SAYS.__contains__, arguments))
    rest = list(arguments[len(before) :])
    end = rest.index("--") if "--" in rest else len(rest)
    return [*rest[:end], *before, *rest[end:]]


def angles() -> Angles:
    """Return the unit that angles are shown in."""
    return IN_DEGREES if voice().is_in_degrees else RADIANS
