"""A map shared with a worker that goes through the same computation (single program, multiple data).

A worker that is forked for one map costs a copy of this process's page tables, and then of each page that either process writes.
A search of a few seconds has thirty maps: its worker is forked at the first of them and kept. It goes through what is between the
maps itself, and at each takes items as this process does. What both have worked out is exchanged, and read by both from the same
bytes, so that both hold equal values and come to the same next map; a worker that has not come there ends, and another is forked.

On three cases of the second bank, two processes of a worker for each map took 4.6 to 5.4 s of processor time and 120,000 to
146,000 page faults where one process alone took 3.5 to 4.0 s; with the worker kept they take 4.2 to 4.9 s and 17,000 to
20,000.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, BinaryIO, Never, Self, TypeVar

from fieldsid.runtime.pickling import dumps, loads
from fieldsid.runtime.worker_pool import fork, wait_later

T = TypeVar("T")
R = TypeVar("R")

END = 255
"""The byte that ends the numbers of a map's items, once for each process."""
MAX_ITEMS = END
"""Number of items from which on a map is not shared: the number of an item is one byte."""
WORD_BYTES = 8
"""Bytes of a number that is sent: the length of a message, or the place that two processes have come to."""


def parallel_map(function: Callable[[T], R], items: Sequence[T]) -> list[R]:
    """Return function(item) of every item as `Lockstep.map` does, with a worker for this map alone."""
    return Lockstep().map(function, items)


class Lockstep:
    """Two processes at the same computation: this one and its worker, or the worker and the process it was forked from.

    As a context it keeps its worker, which ends where the context is left, with whatever error: what is printed or written to a
    file must come after. `write` and `read` turn values, by the place of their items, to bytes and back; `state` is a number that
    is equal in two processes that have come to the same place.
    """

    def __init__(
        self, write: Callable[[dict[int, Any]], bytes] = dumps, read: Callable[[bytes], dict[int, Any]] = loads,
        state: Callable[[], int] = int,
    ) -> None:  # fmt: skip
        self._write, self._read, self._state = write, read, state
        self._other: _Worker | _Parent | None = None
        self._is_kept, self._is_sharing = False, False

    def __enter__(self) -> Self:
        self._is_kept = True
        return self

    def __exit__(self, error: object, *_more: object) -> None:
        self._is_kept = False
        self._part(wait=error is not None)

    def map(self, function: Callable[[T], R], items: Sequence[T]) -> list[R]:
        """Return function(item) of every item, in order; this process and the worker each take the next item left.

        What the function changes is seen in one of the two processes only: all that matters must be in the value it returns.
        Where the worker ends without an answer, its items are evaluated here; an error of the function is raised here. A map
        within a map is not shared.
        """
        if self._is_sharing or not 1 < len(items) < MAX_ITEMS:
            return [function(item) for item in items]
        place = hash((getattr(function, "__qualname__", ""), len(items), self._state())) % 256**WORD_BYTES
        self._is_sharing = True
        try:
            other = self._at(place, len(items))
            done = {} if other is None else self._done(function, items, other)
        except BaseException:
            self._part(wait=True)
            raise
        finally:
            self._is_sharing = False
        if not self._is_kept:
            self._part()
        return [done[i] if i in done else function(item) for i, item in enumerate(items)]

    def _at(self, place: int, count: int) -> _Worker | _Parent | None:
        """Return the other process where it has come, or comes, to the same place; None where there is none."""
        if self._other is None or not self._other.begin(place, count):
            self._part()
            self._other = _forked()
            if self._other is not None:
                self._other.begin(place, count)
        return self._other

    def _done(self, function: Callable[[T], R], items: Sequence[T], other: _Worker | _Parent) -> dict[int, R]:
        """Return what this process and the other, where it has not ended, have worked out, by the place of the items."""
        own = dict(_taken(function, items, other.numbers))
        # nobody reads what this process writes to a worker that ends with this map
        written = self._write(own) if self._is_kept or isinstance(other, _Parent) else b""
        theirs = other.exchange(written)
        if theirs is None:
            self._part(wait=True)
            return own
        return (self._read(written) if written else own) | self._read(theirs)

    def _part(self, *, wait: bool = False) -> None:
        """End the worker, this process where it is the worker; `wait` for its end."""
        if self._other is not None:
            other, self._other = self._other, None
            other.end(wait=wait)


@dataclass(slots=True)
class _Other:
    """The other process: the pipe that the numbers of items are read from, and the pipes from it and to it."""

    numbers: int
    source: BinaryIO
    target: int

    def send(self, sent: bytes) -> None:
        """Write some bytes to the other process."""
        left = memoryview(sent)
        while left:
            left = left[os.write(self.target, left) :]

    def send_message(self, message: bytes) -> None:
        """Write a message, with its length before it."""
        self.send(len(message).to_bytes(WORD_BYTES) + message)

    def receive_message(self) -> bytes | None:
        """Wait for a message and return it, None where the other process has ended."""
        length = self.source.read(WORD_BYTES)
        message = self.source.read(int.from_bytes(length)) if len(length) == WORD_BYTES else b""
        return message if length and len(message) == int.from_bytes(length) else None


@dataclass(slots=True)
class _Worker(_Other):
    """The worker, by its number, and the pipe that the numbers of items are given out by."""

    process: int
    given_out: int

    def begin(self, place: int, count: int) -> bool:
        """Tell the worker where this process is, and give out the items; whether the worker lives."""
        try:
            self.send(place.to_bytes(WORD_BYTES))
        except BrokenPipeError:
            return False
        os.write(self.given_out, bytes((*range(count), END, END)))
        return True

    def exchange(self, message: bytes) -> bytes | None:
        """Wait for the worker's message, and send it one unless that is empty; None where the worker has ended."""
        theirs = self.receive_message()
        if theirs is not None and message:
            try:
                self.send_message(message)
            except BrokenPipeError:
                return None
        return theirs

    def end(self, *, wait: bool) -> None:
        """End the worker, whatever it is doing; the system takes some milliseconds to clear it away, which `wait` waits for."""
        os.kill(self.process, signal.SIGKILL)
        self.source.close()
        for end in (self.numbers, self.target, self.given_out):
            os.close(end)
        if wait:
            os.waitpid(self.process, 0)
        else:
            wait_later(self.process)


@dataclass(slots=True)
class _Parent(_Other):
    """The process that this one, a worker, was forked from."""

    def begin(self, place: int, _count: int) -> bool:
        """Wait for the parent to come to a map, and end where it is not the one that this process has come to."""
        return self.source.read(WORD_BYTES) == place.to_bytes(WORD_BYTES) or self.end()

    def exchange(self, message: bytes) -> bytes:
        """Send the parent a message, and wait for its own."""
        self.send_message(message)
        theirs = self.receive_message()
        return self.end() if theirs is None else theirs

    def end(self, *, wait: bool = False) -> Never:  # noqa: ARG002 - there is nothing to wait for
        """End this process, without what a process does at its end."""
        os._exit(0)


def _forked() -> _Worker | _Parent | None:
    """Return a worker of this process, and in that its parent; None where this process cannot be forked."""
    numbers, down, up = os.pipe(), os.pipe(), os.pipe()
    process = fork()
    if process is None:
        for end in (*numbers, *down, *up):
            os.close(end)
        return None
    if process == 0:
        try:
            for end in (numbers[1], down[1], up[0]):
                os.close(end)
            return _Parent(numbers[0], os.fdopen(down[0], "rb"), up[1])
        except BaseException:  # noqa: BLE001 - what it goes on to would be done twice
            os._exit(1)
    for end in (down[0], up[1]):
        os.close(end)
    return _Worker(numbers[0], os.fdopen(up[0], "rb"), down[1], process, numbers[1])


def _taken(function: Callable[[T], R], items: Sequence[T], numbers: int) -> Iterator[tuple[int, R]]:
    """Yield the places and values of the items that this process takes."""
    while (number := os.read(numbers, 1)[0]) != END:
        yield number, function(items[number])
