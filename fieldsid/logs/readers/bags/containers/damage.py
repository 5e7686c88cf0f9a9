"""Where a file of records can be read on behind damage: the first place from which several records follow each other."""

from __future__ import annotations

import mmap
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

Bytes = bytes | mmap.mmap
CHAIN = 3
"""Records that must follow each other: three by chance, each with its op, length and known connection, are none."""


def resumed(candidates: Iterable[int], sound: Callable[[int], int | None], end: int) -> int | None:
    """Return the first candidate from which records follow each other; `sound` gives the end of a record, or None."""
    return next((place for place in candidates if _follow(place, sound, end)), None)


def _follow(place: int, sound: Callable[[int], int | None], end: int) -> bool:
    for _ in range(CHAIN):
        stop = sound(place)
        if stop is None:
            return False
        if stop == end:
            return True
        place = stop
    return True


@contextmanager
def mapped(path: Path) -> Iterator[mmap.mmap]:
    """Yield a file's bytes, read as they are asked for."""
    with path.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        yield data


def forget(data: Bytes, place: int) -> None:
    """Give back the memory of a mapped file up to a place; the bytes are read again should anybody ask for them."""
    if isinstance(data, mmap.mmap) and hasattr(mmap, "MADV_DONTNEED"):
        data.madvise(mmap.MADV_DONTNEED, 0, place // mmap.PAGESIZE * mmap.PAGESIZE)
