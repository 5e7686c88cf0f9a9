"""How every command speaks: `--quiet` its first lines alone, `-v` warnings in full, `--deg` angles of its text in degrees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import takewhile
from math import pi

from fieldsid.angles import in_degrees
from fieldsid.rounding import in_unit, interval, with_error

QUIET, VERBOSE, DEGREES = "--quiet", "-v", "--deg"
SAYS = {
    QUIET: "Say the verdict, what it rests on and the next command, nothing below; and errors.",
    VERBOSE: "Say warnings in full, where a terminal gets a line of each.",
    DEGREES: "Show angles in degrees; files and JSON stay in radians.",
}
"""What each of them does, in the words of the pages of help."""
HAS_OWN_V = ("demo",)
"""Commands whose own `-v` says more than warnings."""


@dataclass(frozen=True, slots=True)
class Voice:
    """Whether a result's first lines are all that is said, whether warnings are said in full, and angles in degrees."""

    is_quiet: bool = False
    is_verbose: bool = False
    is_in_degrees: bool = False


_VOICE = [Voice()]


def voice() -> Voice:
    """Return how much the command under way says."""
    return _VOICE[0]


def take(arguments: Sequence[str]) -> list[str]:
    """Set the voice by a command line and return the line without what set it; what follows `--` is left as it is."""
    end = arguments.index("--") if "--" in arguments else len(arguments)
    own, rest = arguments[:end], arguments[end:]
    _VOICE[0] = replace(Voice(), is_quiet=QUIET in own, is_verbose=VERBOSE in own, is_in_degrees=DEGREES in own)
    taken = set(SAYS) - ({VERBOSE} if arguments and arguments[0] in HAS_OWN_V else set())
    return [*(a for a in own if a not in taken), *rest]


def command_first(arguments: Sequence[str]) -> list[str]:
    """Return a command line with what any command answers to behind the command, where it stands before it."""
    before = list(takewhile((*SAYS, "--json").__contains__, arguments))
    rest = list(arguments[len(before) :])
    end = rest.index("--") if "--" in rest else len(rest)
    return [*rest[:end], *before, *rest[end:]]


def shown_in(unit: str) -> tuple[float, str]:
    """Return what a number in a unit is multiplied by to be shown, and the unit it is then in; a plain number has none.

    The one place that knows of `--deg`. Of a unit the radian is changed wherever it stands, to the power it stands in.
    """
    above, _, below = unit.partition("/")
    power = above.count("rad") - below.count("rad")
    if not voice().is_in_degrees or "rad" not in unit:
        return 1.0, in_unit(unit)
    squares = above.count("rad^2") - below.count("rad^2")
    return (180.0 / pi) ** (power + squares), unit.replace("rad", "deg")


def shown_estimate(value: float, std_error: float, interval95: Sequence[float], unit: str) -> tuple[str, str, str]:
    """Return an estimate as the cells of a table: value with its error, unit, 95 % interval."""
    factor, unit = shown_in(unit)
    low, high = interval95
    return with_error(factor * value, factor * std_error), unit, interval(factor * low, factor * high)


def shown_words(text: str) -> str:
    """Return a sentence with the angles in it as they are shown: `rate: 0.05 .. 0.1 rad/s`."""
    return in_degrees(text) if voice().is_in_degrees else text
