"""The errors a user can meet: each says what is wrong, what was found and a hint that can be pasted."""

from __future__ import annotations

from reprlib import Repr

from fieldsid.text.one_line import one_line

FOUND = "  found: "
_SHORT = Repr()
_SHORT.maxlevel, _SHORT.maxlist, _SHORT.maxdict = 2, 3, 3
_SHORT.maxstring = _SHORT.maxother = _SHORT.maxlong = 80


def shortened(value: object) -> str:
    """Return a value as Python writes it, cut where it is long or deep: what an error quotes of a file that anybody wrote."""
    return _SHORT.repr(value)


class FieldsidError(Exception):
    """Base of every error this package raises on purpose; the command line turns it into exit code 2.

    `signal` is the one whose line of a mapping, or whose cells, it is about; empty where it is about none, or about all.
    """

    def __init__(self, what: str, *, found: str = "", hint: str = "", signal: str = "") -> None:
        super().__init__(what)
        self.what = what
        self.found = found
        self.hint = hint
        self.signal = signal

    @property
    def shown(self) -> tuple[str, str, str]:
        """The three parts for a reader, whatever names they hold: only what was found may have lines, below its first."""
        found = f"\n{' ' * len(FOUND)}".join(map(one_line, self.found.split("\n")))
        return one_line(self.what), found, one_line(self.hint)

    def __str__(self) -> str:
        what, found, hint = self.shown
        return "".join((what, f"\n{FOUND}{found}" if found else "", f"\n\nhint: {hint}" if hint else ""))


class UsageError(FieldsidError):
    """An argument or option that cannot be meant."""


class LogError(FieldsidError):
    """A log file that cannot be read as asked."""


class MappingError(FieldsidError):
    """A mapping that does not fit the log, or is not a mapping."""


class VehicleError(FieldsidError):
    """A vehicle description that is not valid."""


class ArtifactError(FieldsidError):
    """A file of this tool that cannot be written, or read back."""


class DataError(FieldsidError):
    """Data that do not allow what was asked: too short, not excited, wrong sign."""


class ModelError(FieldsidError):
    """A model that cannot be built or simulated."""


class DivergenceError(ModelError):
    """A fit or a search that came to a motion without bound, or to a number that is none."""


class EffectError(FieldsidError):
    """An effect, ours or a user's, that is wrong or cannot take part."""
