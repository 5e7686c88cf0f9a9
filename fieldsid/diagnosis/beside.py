"""Work shared out between this process and a forked copy of it, where the system has a second core and can copy a process.

What comes back refers to the records and effects that both processes know, instead of bringing copies of them.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import Any, Never, TypeVar

from fieldsid.fitting.problem import Problem
from fieldsid.models.effect import Effect, form_of, in_form
from fieldsid.models.record import Record

T = TypeVar("T")
R = TypeVar("R")

_IS_COPY = "FIELDSID_IS_COPY"
MOST = 256
"""Items that are shared out at most: their numbers are bytes."""
WHOLE = b"that is all"
"""What ends the answer of a copy that came to its end."""
_ENDING: list[int] = []
"""Copies that have answered: giving its memory back takes one as long as making it, and nobody need wait for that."""


class Beside:
    """What two processes know: records by their place, effects by their name."""

    def __init__(self, records: Iterable[Record], effects: Iterable[Effect]) -> None:
        self.records = tuple(records)
        self.effects = {e.name: e for e in effects}

    def each(self, function: Callable[[T], R], items: Sequence[T]) -> list[R]:
        """Return a function of every item, in order, some of them from a copy of this process: each takes the next one left.

        What the function changes is seen in one of the two only: all that matters must be in what it returns. Where the
        copy comes to nothing, its items are done here.
        """
        if not 1 < len(items) < MOST or not can_copy():
            return [function(item) for item in items]
        _see_off()
        left, source, target = _numbers(len(items)), *os.pipe()
        try:
            copy = os.fork()
        except OSError:  # where memory or processes are short there is no copy
            for end in (left, source, target):
                os.close(end)
            return [function(item) for item in items]
        if copy == 0:
            os.close(source)
            self._answer(function, items, left, target)
        os.close(target)
        with os.fdopen(source, "rb") as stream:
            try:
                done = dict(_taken(function, items, left))
                answer = stream.read()
            except BaseException:
                os.kill(copy, signal.SIGKILL)
                os.waitpid(copy, 0)
                raise
            finally:
                os.close(left)
        _ENDING.append(copy)
        if answer.endswith(WHOLE):
            done |= self.loads(answer)
        return [done[i] if i in done else function(item) for i, item in enumerate(items)]

    def _answer(self, function: Callable[[T], R], items: Sequence[T], left: int, target: int) -> Never:
        """Write what the items taken come to and end the copy, without a word and without what a process does at its end."""
        try:
            os.environ[_IS_COPY] = "1"
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, 1)
            os.dup2(nowhere, 2)
            answer = self.dumps(dict(_taken(function, items, left)))
            with os.fdopen(target, "wb") as stream:
                stream.write(answer + WHOLE)
        finally:
            os._exit(0)

    def dumps(self, value: object) -> bytes:
        """Return a value as bytes that `loads` reads."""
        out = BytesIO()
        _Writer(out, self).dump(value)
        return out.getvalue()

    def loads(self, answer: bytes) -> Any:
        """Return what `dumps` was given, the known records and effects in it themselves."""
        return _Reader(BytesIO(answer), self).load()


def _see_off() -> None:
    """Wait for the copies that have answered to be gone, unless somebody else has."""
    while _ENDING:
        with suppress(ChildProcessError):
            os.waitpid(_ENDING.pop(), 0)


def _numbers(count: int) -> int:
    """Return a pipe's end that gives each number below count once, to whoever reads it."""
    source, target = os.pipe()
    with os.fdopen(target, "wb") as stream:
        stream.write(bytes(range(count)))
    return source


def _taken(function: Callable[[T], R], items: Sequence[T], left: int) -> Iterator[tuple[int, R]]:
    """Yield the places and values of the items that are taken here."""
    while number := os.read(left, 1):
        yield number[0], function(items[number[0]])


def can_copy() -> bool:
    """Whether this process is alone, may be copied, and would not share a core with its copy.

    Other threads may hold what a copy would wait for; elsewhere than on Linux libraries do not survive it.
    """
    if not sys.platform.startswith("linux") or _IS_COPY in os.environ:
        return False
    return len(os.sched_getaffinity(0)) > 1 and threading.active_count() == 1 and not _warns()


def _warns() -> bool:
    """Whether Python would warn of a copy, as it does from 3.12 on beside any thread, a linear algebra library's too."""
    threads = Path("/proc/self/task")
    return sys.version_info >= (3, 12) and (not threads.is_dir() or sum(1 for _ in threads.iterdir()) > 1)


class _Writer(pickle.Pickler):
    def __init__(self, out: BytesIO, known: Beside) -> None:
        super().__init__(out, protocol=5)
        self.places = {id(r): i for i, r in enumerate(known.records)}
        self.effects = known.effects

    def persistent_id(self, obj: object) -> tuple[str, object] | None:
        """Return what stands for a known record or an effect, none for all else."""
        if isinstance(obj, Record) and id(obj) in self.places:
            return "record", self.places[id(obj)]
        if isinstance(obj, Effect) and obj.name in self.effects:
            names = tuple(c.name for c in obj.coefficients)
            same = formed(self.effects[obj.name], names)
            return ("effect", (obj.name, names)) if same is not None and same.coefficients == obj.coefficients else None
        return None

    def reducer_override(self, obj: object) -> Any:
        """Return how a mapping that is read only is made anew, and a problem without the arrays of its last call."""
        if isinstance(obj, MappingProxyType):
            return _read_only, (dict(obj),)
        if isinstance(obj, Problem):
            return Problem, (obj.records, obj.layout)
        return NotImplemented


def _read_only(values: dict[str, object]) -> MappingProxyType[str, object]:
    """Return a mapping that is read only; its own class cannot be named in what is written."""
    return MappingProxyType(values)


class _Reader(pickle.Unpickler):
    def __init__(self, stream: BytesIO, known: Beside) -> None:
        super().__init__(stream)
        self.known = known

    def persistent_load(self, pid: tuple[str, Any]) -> object:
        """Return the record or effect that a name stands for, an effect in the form its coefficients are of."""
        kind, what = pid
        if kind == "record":
            return self.known.records[what]
        name, coefficients = what
        effect = formed(self.known.effects[name], coefficients)
        if effect is None:
            raise pickle.UnpicklingError(f"no form of {name} has {', '.join(coefficients)}")
        return effect


def formed(effect: Effect, names: tuple[str, ...]) -> Effect | None:
    """Return an effect in the form that has coefficients of these names, itself where they are its own."""
    if names == tuple(c.name for c in effect.coefficients):
        return effect
    form = form_of(effect, names)
    return None if form is None else in_form(effect, form)
