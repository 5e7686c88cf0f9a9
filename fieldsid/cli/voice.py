"""How much a command says besides its result: `--quiet` errors alone, `-v` warnings in full, on every command."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

QUIET, VERBOSE = "--quiet", "-v"
HAS_OWN_V = ("demo",)
"""Commands whose own `-v` says more than warnings."""


@dataclass(frozen=True, slots=True)
class Voice:
    """Whether messages are left out, and whether warnings are said in full on a terminal, where they else have a line each."""

    is_quiet: bool = False
    is_verbose: bool = False


_VOICE = [Voice()]


def voice() -> Voice:
    """Return how much the command under way says."""
    return _VOICE[0]


def take(arguments: Sequence[str]) -> list[str]:
    """Set the voice by a command line and return the line without what set it; what follows `--` is left as it is."""
    end = arguments.index("--") if "--" in arguments else len(arguments)
    own, rest = arguments[:end], arguments[end:]
    _VOICE[0] = replace(Voice(), is_quiet=QUIET in own, is_verbose=VERBOSE in own)
    taken = {QUIET} if arguments and arguments[0] in HAS_OWN_V else {QUIET, VERBOSE}
    return [*(a for a in own if a not in taken), *rest]
