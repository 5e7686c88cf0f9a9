"""Pickling of values that are sent between this process and a child process."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from io import BytesIO
from types import MappingProxyType
from typing import Any


class WorkerPickler(pickle.Pickler):
    """A pickler that can also write read-only mappings."""

    def __init__(self, out: BytesIO) -> None:
        super().__init__(out, protocol=5)

    def reducer_override(self, obj: object) -> Any:
        """Return how a read-only mapping is built again, and anything else as the base class does."""
        return (_read_only, (dict(obj),)) if isinstance(obj, MappingProxyType) else NotImplemented


def _read_only(values: dict[str, object]) -> MappingProxyType[str, object]:
    """Return a read-only mapping; its class cannot be pickled by name."""
    return MappingProxyType(values)


def dumps(value: object, writer: Callable[[BytesIO], WorkerPickler] = WorkerPickler) -> bytes:
    """Return a value as the bytes that a pickler writes."""
    out = BytesIO()
    writer(out).dump(value)
    return out.getvalue()


def loads(answer: bytes) -> Any:
    """Return the value from bytes written by `dumps` in this, a child or the parent process."""
    return pickle.loads(answer)  # noqa: S301 - nobody else wrote it
