"""Errors for a log that is given where a file of this program is expected."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from math import isfinite
from pathlib import Path
from shlex import quote

from fieldsid.errors import ArtifactError, LogError
from fieldsid.logs.channels import TableForm
from fieldsid.logs.reader import ReadOptions, reader_of
from fieldsid.records.reading import read_yaml


@contextmanager
def unless_log(path: Path, wanted: str) -> Iterator[None]:
    """Raise an error that names the file a log, where reading it as `wanted` (such as "a model") fails and it is a log."""
    try:
        yield
    except ArtifactError as error:
        try:
            read_yaml(path)
        except ArtifactError:  # a table of numbers is not YAML with keys
            if (log := if_log(path, wanted)) is not None:
                raise log from error
        raise


def if_log(path: Path, wanted: str) -> ArtifactError | None:
    """Return the error that a file is a log and not what is wanted; None where it is not a log.

    A text without canonical names and without a time may be anything, and is not called a log.
    """
    try:
        reader = reader_of(path)
        known = reader.own_map(path, ReadOptions())
        if known is None and not isfinite(reader.inventory(path, ReadOptions(), TableForm()).duration_s):
            return None
    except LogError:
        return None
    signals = known.sources if known is not None else {}
    axis = next((axis for fin, axis in (("rudder", "yaw"), ("elevator", "pitch")) if any(s.startswith(fin) for s in signals)), "")
    hint = f"identify it first: `sysid identify {quote(str(path))} --axis {axis} -o models/`"
    return ArtifactError(
        f"`{path}` is a log, not {wanted}",
        found=f"signals {', '.join(signals)}" if signals else "no names that are known: it needs a mapping",
        hint=hint if axis else f"see what is in it: `sysid inspect {quote(str(path))}`",
    )
