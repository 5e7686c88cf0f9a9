"""How large a packed log may become: some bytes can claim, and give, any number of others.

A log's own numbers pack a few times, constants beside them some hundred times; what goes beyond is no log, and is refused before
it fills the memory, as soon as that is known.
"""

from __future__ import annotations

from pathlib import Path

from fieldsid.errors import LogError

SMALL = 128 << 20
"""Unpacked bytes that are read however they were packed."""
MOST_TIMES = 300
"""Times its own bytes that a larger log may unpack to: a table of three hundred columns, most of them constant, comes to that."""


class UnpackedSize:
    """Counts what a log of so many bytes unpacks to; raises LogError where it is more than a log can be."""

    def __init__(self, path: Path, packed: int | None = None) -> None:
        self.path = path
        self.packed = path.stat().st_size if packed is None else packed
        self.size = 0

    @property
    def left(self) -> int:
        """Bytes that may still be unpacked."""
        return max(SMALL, MOST_TIMES * self.packed) - self.size

    def add(self, size: int) -> None:
        """Count bytes that have been unpacked, or that the file says it will unpack to."""
        self.size += size
        if self.left < 0:
            raise LogError(
                f"`{self.path}` is no log: it unpacks to far more than a vehicle records",
                found=f"at least {self.size} bytes from {self.packed}",
                hint="write it again with the samples alone, or leave out what is constant",
            )
