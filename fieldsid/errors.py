"""The errors a user can meet: each says what is wrong, what was found and a hint that can be pasted."""

from __future__ import annotations


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

    def __str__(self) -> str:
        parts = [self.what]
        if self.found:
            parts.append(f"  found: {self.found}")
        if self.hint:
            parts.append(f"\nhint: {self.hint}")
        return "\n".join(parts)


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
