"""Values as the bytes that go between this process and one that it began."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from io import BytesIO
from types import MappingProxyType
from typing import Any


class WorkerPickler(pickle.Pickler):
    """A pickler that writes read-only mappings too."""

    def __init__(self, out: BytesIO) -> None:
        super().__init__(out, protocol=5)

    def reducer_override(self, obj: object) -> Any:
        """Return how a read-only mapping is built again, and anything else as the base class does."""
        return (_read_only, (dict(obj),)) if isinstance(obj, MappingProxyType) else NotImplemented


def _read_only(values: dict[str, object]) -> MappingProxyType[str, object]:
    """Return a read-only mapping; its own class cannot be named in what is pickled."""
    return MappingProxyType(values)


def dumps(value: object, writer: Callable[[BytesIO], WorkerPickler] = WorkerPickler) -> bytes:
    """Return a value as the bytes that a pickler writes."""
    out = BytesIO()
    writer(out).dump(value)
    return out.getvalue()


def loads(answer: bytes) -> Any:
    """Return the value that this process, one it began, or the one that began it has written."""
    return pickle.loads(answer)  # noqa: S301 - nobody else wrote it
