"""The errors for the user: each says what is wrong, what was found, and gives a hint that can be pasted."""

from __future__ import annotations

import errno
from reprlib import Repr

from fieldsid.text.one_line import one_line

FOUND = "  found: "
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Error numbers of the system where a disk, or a user's quota, is full."""
MAKE_ROOM = "make room, and run it again"
_SHORT = Repr()
_SHORT.maxlevel, _SHORT.maxlist, _SHORT.maxdict = 2, 3, 3
_SHORT.maxstring = _SHORT.maxother = _SHORT.maxlong = 80


def shortened(value: object) -> str:
    """Return the repr of a value, cut where it is long or deep, for the quotation of an untrusted file in an error."""
    return _SHORT.repr(value)


class FieldsidError(Exception):
    """Base of every error this package raises on purpose; the command line turns it into exit code 2.

    `signal` is the signal in whose line of a mapping, or whose cells, the error is; empty where it concerns none or all.
    """

    def __init__(self, what: str, *, found: str = "", hint: str = "", signal: str = "") -> None:
        super().__init__(what)
        self.what = what
        self.found = found
        self.hint = hint
        self.signal = signal

    @property
    def shown(self) -> tuple[str, str, str]:
        """The three parts as text without control characters: only `found` may have several lines."""
        found = f"\n{' ' * len(FOUND)}".join(map(one_line, self.found.split("\n")))
        return one_line(self.what), found, one_line(self.hint)

    def __str__(self) -> str:
        what, found, hint = self.shown
        return "".join((what, f"\n{FOUND}{found}" if found else "", f"\n\nhint: {hint}" if hint else ""))


class UsageError(FieldsidError):
    """An argument or option that makes no sense."""


class LogError(FieldsidError):
    """A log file that cannot be read with the given options."""


class MappingError(FieldsidError):
    """A mapping that does not fit the log, or is not a mapping."""


class VehicleError(FieldsidError):
    """A vehicle description that is not valid."""


class ArtifactError(FieldsidError):
    """A file of this tool that cannot be written, or read back."""


class DataError(FieldsidError):
    """Data that do not allow the requested result: too short, not excited, wrong sign."""


class ModelError(FieldsidError):
    """A model that cannot be built or simulated."""


class DivergenceError(ModelError):
    """A fit or a search that arrived at an unbounded motion, or at a number that is not finite."""


class EffectError(FieldsidError):
    """An effect of the package or a user that is wrong or cannot be used."""
