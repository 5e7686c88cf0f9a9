"""A file that planning reads: whatever is missing or wrong in it is told with the file's name."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fieldsid.errors import ArtifactError, FieldsidError
from fieldsid.records.check import ShapeError


@contextmanager
def whole_file(path: Path, kind: str, hint: str) -> Iterator[None]:
    """Raise ArtifactError where what is read of a file in this block is missing or wrong."""
    try:
        yield
    except FieldsidError as error:
        raise ArtifactError(f"`{path}`: {error.what}", found=error.found, hint=error.hint or hint) from error
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        found = str(error) if isinstance(error, ShapeError) else f"{type(error).__name__}: {error}"
        raise ArtifactError(f"`{path}` is not a complete {kind}", found=found, hint=hint) from error
