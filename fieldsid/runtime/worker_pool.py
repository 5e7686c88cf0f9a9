"""Work done in a forked copy of this process, where the system has a second core and can copy a process."""

from __future__ import annotations

import os
import pickle
import select
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import Any, Never, Self, TypeVar

T = TypeVar("T")
R = TypeVar("R")

_IS_WORKER = "FIELDSID_IS_COPY"
ANSWER_COMPLETE = b"that is all"
"""What ends the answer of a copy that came to its end."""
MAX_WORKERS = 2
"""Copies at work that was put off."""
MAX_ITEMS = 256
"""Items that are shared out at most: their numbers are bytes."""
_BACKGROUND_TASKS: list[tuple[Worker, Callable[[], None]]] = []
"""Work that was put off, and the copies that are at it."""
_FINISHING: list[bool] = []
"""Whether `await_background` is under way."""
_ENDING: list[int] = []
"""Copies that have answered: giving its memory back takes one as long as making it, and nobody need wait for that."""


class Worker:
    """A copy of this process at work; left with an error it is ended."""

    def __init__(self, process: int, source: int) -> None:
        self.process, self._stream = process, os.fdopen(source, "rb")

    def answer(self) -> bytes | None:
        """Wait for what the copy has worked out and return it; None where it came to nothing."""
        answer = self._stream.read()
        return answer.removesuffix(ANSWER_COMPLETE) if answer.endswith(ANSWER_COMPLETE) else None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, error: object, *_more: object) -> None:
        if error is None:
            self._stream.close()
            _ENDING.append(self.process)
            return
        self.end()

    def is_at_work(self) -> bool:
        """Whether the copy has not come to its end."""
        return not select.select([self._stream], [], [], 0.0)[0]

    def end(self) -> None:
        """End the copy, whatever it is doing."""
        self._stream.close()
        os.kill(self.process, signal.SIGKILL)
        os.waitpid(self.process, 0)


def parallel_map(
    function: Callable[[T], R], items: Sequence[T],
    write: Callable[[dict[int, R]], bytes] | None = None, read: Callable[[bytes], dict[int, R]] | None = None,
) -> list[R]:  # fmt: skip
    """Return a function of every item, in order, some of them from a copy of this process: each takes the next one left.

    What the function changes is seen in one of the two only: all that matters must be in what it returns, which goes from one
    to the other by write and read, by default `dumps` and `loads`. Where the copy comes to nothing, its items are done
    here.
    """
    if not 1 < len(items) < MAX_ITEMS:
        return [function(item) for item in items]
    left = job_queue(len(items))
    try:
        copy = fork_worker(lambda: (write or dumps)(dict(_taken(function, items, left))))
        if copy is None:
            return [function(item) for item in items]
        with copy:
            done = dict(_taken(function, items, left))
            answer = copy.answer()
    finally:
        os.close(left)
    if answer is not None:
        done |= (read or loads)(answer)
    return [done[i] if i in done else function(item) for i, item in enumerate(items)]


def run_in_background(work: Callable[[], None]) -> None:
    """Do some work that leaves all it comes to on the disk: at once, or, inside `await_background`, beside what follows."""
    busy = sum(copy.is_at_work() for copy, _ in _BACKGROUND_TASKS)
    copy = fork_worker(lambda: _nothing(work)) if _FINISHING and busy < MAX_WORKERS else None
    if copy is None:
        work()
    else:
        _BACKGROUND_TASKS.append((copy, work))


@contextmanager
def await_background() -> Iterator[None]:
    """Be inside work of which `run_in_background` may put some off.

    It is done at the end, and what went wrong is met again and raised.

    Inside another one nothing is waited for: that is left to the outer one.
    """
    if _FINISHING:
        yield
        return
    _FINISHING.append(True)
    is_well = False
    try:
        yield
        is_well = True
    finally:
        _FINISHING.clear()
        left = _BACKGROUND_TASKS.copy()
        _BACKGROUND_TASKS.clear()
        with ExitStack() as copies:
            for copy, _ in left:
                copies.enter_context(copy)
            for copy, work in left:
                if copy.answer() is None and is_well:
                    work()


def _nothing(work: Callable[[], None]) -> bytes:
    work()
    return b""


def job_queue(count: int) -> int:
    """Return a pipe's end that gives each number below count once, to whoever reads it."""
    source, target = os.pipe()
    with os.fdopen(target, "wb") as stream:
        stream.write(bytes(range(count)))
    return source


def _taken(function: Callable[[T], R], items: Sequence[T], left: int) -> Iterator[tuple[int, R]]:
    """Yield the places and values of the items that are taken here."""
    while number := os.read(left, 1):
        yield number[0], function(items[number[0]])


def fork_worker(work: Callable[[], bytes]) -> Worker | None:
    """Return a copy of this process that does some work; None where no copy is to be had.

    What the work changes is seen in the copy only, and what it says or raises nowhere: all that matters must be in what it
    returns.
    """
    if not can_fork():
        return None
    while _ENDING:  # wait for the copies that have answered to be gone, unless somebody else has
        with suppress(ChildProcessError):
            os.waitpid(_ENDING.pop(), 0)
    source, target = os.pipe()
    try:
        process = os.fork()
    except OSError:  # where memory or processes are short
        os.close(source)
        os.close(target)
        return None
    if process == 0:
        os.close(source)
        _work(work, target)
    os.close(target)
    return Worker(process, source)


def _work(work: Callable[[], bytes], target: int) -> Never:
    """Write what the work comes to and end the copy, without a word and without what a process does at its end."""
    try:
        os.environ[_IS_WORKER] = "1"
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        answer = work()
        with os.fdopen(target, "wb") as stream:
            stream.write(answer + ANSWER_COMPLETE)
    finally:
        os._exit(0)


def can_fork() -> bool:
    """Whether this process is alone, may be copied, and would not share a core with its copy.

    Other threads may hold what a copy would wait for; elsewhere than on Linux libraries do not survive it.
    """
    if not sys.platform.startswith("linux") or _IS_WORKER in os.environ:
        return False
    return len(os.sched_getaffinity(0)) > 1 and threading.active_count() == 1 and not _warns()


def _warns() -> bool:
    """Whether Python would warn of a copy, as it does from 3.12 on beside any thread, a linear algebra library's too."""
    threads = Path("/proc/self/task")
    return sys.version_info >= (3, 12) and (not threads.is_dir() or sum(1 for _ in threads.iterdir()) > 1)


class WorkerPickler(pickle.Pickler):
    """Writes what goes from one process to the other, mappings that are read only as well."""

    def __init__(self, out: BytesIO) -> None:
        super().__init__(out, protocol=5)

    def reducer_override(self, obj: object) -> Any:
        """Return how a mapping that is read only is made anew."""
        return (_read_only, (dict(obj),)) if isinstance(obj, MappingProxyType) else NotImplemented


def _read_only(values: dict[str, object]) -> MappingProxyType[str, object]:
    """Return a mapping that is read only; its own class cannot be named in what is written."""
    return MappingProxyType(values)


def dumps(value: object, writer: Callable[[BytesIO], WorkerPickler] = WorkerPickler) -> bytes:
    """Return a value as the bytes that a writer makes of it."""
    out = BytesIO()
    writer(out).dump(value)
    return out.getvalue()


def loads(answer: bytes) -> Any:
    """Return the value that a copy of this process has written."""
    return pickle.loads(answer)  # noqa: S301 - nobody else wrote it
