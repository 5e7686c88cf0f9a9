"""Errors of files that planning reads: every missing or wrong part is reported with the name of the file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fieldsid.errors import ArtifactError, FieldsidError
from fieldsid.records.check import ShapeError


@contextmanager
def whole_file(path: Path, kind: str, hint: str) -> Iterator[None]:
    """Raise ArtifactError with the file's name where reading its content in this block fails."""
    try:
        yield
    except FieldsidError as error:
        raise ArtifactError(f"`{path}`: {error.what}", found=error.found, hint=error.hint or hint) from error
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        found = str(error) if isinstance(error, ShapeError) else f"{type(error).__name__}: {error}"
        raise ArtifactError(f"`{path}` is not a complete {kind}", found=found, hint=hint) from error
